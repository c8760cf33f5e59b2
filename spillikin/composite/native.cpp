#include "spillikin/composite/backends.h"

#include <oneapi/tbb/combinable.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <chrono>

#include "spillikin/base/error.h"
#include "spillikin/composite/native_bins.h"
#include "spillikin/composite/native_screen.h"
#include "spillikin/composite/native_tile.h"
#include "spillikin/composite/native_walk.h"
#include "spillikin/composite/peaks.h"

namespace spillikin::composite {

namespace {

using namespace native;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Tile lists longer than this are made for a part of the image at a time: 4 bytes an entry, or a few for each cell.
std::size_t maxEntries(std::size_t cells) {
  return std::max<std::size_t>(std::size_t{1} << 24U, 8 * cells);
}

class Native final : public Compositor {
 public:
  void prepare(const Frame& frame) override;
  bool needsOrder(const Frame& frame) override;
  FrameStats draw(const Frame& frame, Image& image) override;
  Backend backend() const override { return Backend::native; }
  // The tolerance is a share of the range of nearness, at the far end of which a depth is up to four times as long.
  double certificateGrain() const override { return 4.0 * overlap_tolerance * double{solid_share}; }

 private:
  static constexpr int region_step = max_region_tiles * tile_size;
  void forgetWhatChanged(const Frame& frame);
  void setScreen(const Frame& frame);
  FrameStats walk(const Frame& frame, Image& image);
  void drawRegion(const Box& region, Image& image, FrameStats& stats);
  void drawTiles(const Box& region, Image& image, FrameStats& stats);

  Screen screen_;
  bool screen_set_ = false;  // for the frame that is to be drawn next
  Walk walk_;
  Bins bins_;
  std::vector<PixelBox> pieces_;  // of the order's cuts
  bool prepared_ = false;
  double prepare_seconds_ = 0.0;
  tbb::enumerable_thread_specific<std::unique_ptr<TilePainter>> painters_;
};

void Native::prepare(const Frame& frame) {
  const auto start = Clock::now();
  if (!screen_set_) forgetWhatChanged(frame);
  setScreen(frame);
  // An image of one region has its cells' tiles found here already.
  const int width = frame.camera.width();
  const int height = frame.camera.height();
  bins_.forgetBoxes();
  if (width <= region_step && height <= region_step) bins_.findBoxes(screen_, {0, 0, width, height});
  prepared_ = true;
  prepare_seconds_ = secondsSince(start);
}

void Native::forgetWhatChanged(const Frame& frame) {
  if (!frame.same_mesh && !frame.same_topology) walk_.forgetMesh();
  if (!frame.same_mesh || !frame.same_field) walk_.forgetField();
}

void Native::setScreen(const Frame& frame) {
  if (screen_set_) {
    screen_.moveTo(frame);
  } else {
    screen_.set(frame);
  }
  screen_set_ = true;
}

bool Native::needsOrder(const Frame& frame) {
  screen_set_ = false;
  forgetWhatChanged(frame);
  if (frame.walking == Walking::never || (frame.walking == Walking::automatic && !walkPays(frame))) return true;
  if (!walk_.takes(frame)) return true;
  setScreen(frame);
  return !walk_.sees(screen_);
}

FrameStats Native::walk(const Frame& frame, Image& image) {
  FrameStats stats;
  const auto start = Clock::now();
  setScreen(frame);
  screen_set_ = false;
  if (walk_.draw(screen_, image, stats) && frame.peaks) colorPeaks(frame, image);
  stats.composite_seconds = secondsSince(start);
  return stats;
}

FrameStats Native::draw(const Frame& frame, Image& image) {
  if (frame.integration != Integration::exact) {
    throw Error("the native backend composites by exact integration only; use --integrate exact, or --backend osmesa");
  }
  const int width = frame.camera.width();
  const int height = frame.camera.height();
  image.width = width;
  image.height = height;
  image.rgba.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
  if (!frame.ordered) return walk(frame, image);
  if (!prepared_) prepare(frame);
  prepared_ = screen_set_ = false;
  FrameStats stats;
  const auto start = Clock::now();
  findPieces(screen_, pieces_);
  stats.project_seconds = prepare_seconds_ + secondsSince(start);
  for (int y = 0; y < height; y += region_step) {
    for (int x = 0; x < width; x += region_step) {
      drawRegion({x, y, std::min(x + region_step, width), std::min(y + region_step, height)}, image, stats);
    }
  }
  if (frame.peaks) colorPeaks(frame, image);
  stats.certified = stats.unresolved == 0;
  return stats;
}

// Halves the region until its lists fit the memory promised; a single tile's always do.
void Native::drawRegion(const Box& region, Image& image, FrameStats& stats) {
  const auto start = Clock::now();
  const bool fits = bins_.fill(screen_, pieces_, region, maxEntries(screen_.mesh().cell_count()));
  stats.project_seconds += secondsSince(start);
  if (fits) {
    drawTiles(region, image, stats);
    return;
  }
  Box a = region;
  Box b = region;
  if (bins_.columns() >= bins_.rows()) {
    a.x1 = b.x0 = region.x0 + bins_.columns() / 2 * tile_size;
  } else {
    a.y1 = b.y0 = region.y0 + bins_.rows() / 2 * tile_size;
  }
  drawRegion(a, image, stats);
  drawRegion(b, image, stats);
}

void Native::drawTiles(const Box& region, Image& image, FrameStats& stats) {
  const auto start = Clock::now();
  tbb::combinable<TileStats> sums;
  tbb::parallel_for(std::size_t{0}, bins_.tile_count(), [&](std::size_t tile) {
    std::unique_ptr<TilePainter>& painter = painters_.local();
    if (!painter) painter = std::make_unique<TilePainter>();
    const int x = region.x0 + static_cast<int>(tile % static_cast<std::size_t>(bins_.columns())) * tile_size;
    const int y = region.y0 + static_cast<int>(tile / static_cast<std::size_t>(bins_.columns())) * tile_size;
    const Box window{x, y, std::min(x + tile_size, region.x1), std::min(y + tile_size, region.y1)};
    sums.local().add(painter->paint(screen_, bins_.tile(tile), pieces_, window, image));
  });
  const TileStats sum = sums.combine([](TileStats a, const TileStats& b) {
    a.add(b);
    return a;
  });
  stats.polygons += bins_.entries();
  stats.fragments += sum.fragments;
  stats.flagged += sum.flagged;
  stats.resolved += sum.resolved;
  stats.unresolved += sum.unresolved;
  stats.composite_seconds += secondsSince(start);
}

}  // namespace

std::unique_ptr<Compositor> makeNative() {
  return std::make_unique<Native>();
}

}  // namespace spillikin::composite
