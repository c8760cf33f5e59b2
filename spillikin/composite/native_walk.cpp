#include "spillikin/composite/native_walk.h"

#include <hwy/detect_compiler_arch.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/combinable.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "spillikin/composite/native_bins.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/mesh/parallel.h"

namespace spillikin::composite::native {

namespace {

// What projecting costs beside its fragments, in steps of a ray beyond what a fragment costs there: every cell is
// ordered and handed out to tiles, one within the image is set up. Measured on two cores with vectors of 16 floats,
// of Intel's; a step gathers from memory, and on AMD's processors (Zen 4) it costs as much more.
constexpr double steps_of_a_cell = 26.0, steps_of_a_set_up = 38.0, slow_gathers = 1.6;
constexpr std::size_t sampled_cells = 1024;

// Links of more bytes than this lie too far from a core for a step to wait for them.
constexpr std::size_t large_links = std::size_t{32} << 20U;

// The mesh's nearest depth as a share of its farthest, at least: so near the eye faces fill the screen.
constexpr double least_nearest = 1e-4;

// What the rounding of depths may make a fragment absorb too much: a quarter of a display step.
constexpr double hidden_light = 1e-3;

// An image is drawn in parts of at most so many pixels a side, so that places on it are fine; the finest and the
// coarsest of them, in parts of a pixel. Differences of places, of which none is larger than farthest_place, fit 32
// bits.
constexpr int region_size = 64 * tile_size;
constexpr std::int32_t finest_pixel = 1 << 18, coarsest_pixel = 1 << 13;
constexpr double farthest_place = 1 << 30;
static_assert(std::int64_t{region_size} * finest_pixel < std::int64_t{1} << 30);

// Where rays are tried again, in pixels from the pixel's centre: some of the finest steps first, and farther each time.
// Towards the right and a little downwards at first, as ties are broken everywhere else.
constexpr float beside[][2] = {{0.0F, 0.0F},     {6.2e-5F, 3.9e-6F}, {5e-4F, 6e-5F},
                               {2e-3F, 2.4e-4F}, {-8e-4F, -1.1e-3F}, {2.3e-3F, -3.4e-3F}};

double costOfAStep() {
#if HWY_ARCH_X86 && (HWY_COMPILER_GCC || HWY_COMPILER_CLANG)
  static const bool slow = __builtin_cpu_is("amd");
  return slow ? slow_gathers : 1.0;
#else
  return 1.0;
#endif
}

// The share of an interval that lies in [0, size].
double shareWithin(double lo, double hi, double size) {
  const double inside = std::min(hi, size) - std::max(lo, 0.0);
  return hi > lo ? std::clamp(inside / (hi - lo), 0.0, 1.0) : inside >= 0.0 ? 1.0 : 0.0;
}

// The pixels of a tetrahedron, roughly: half of its faces' areas, as far as its box lies in the image. Negative where
// none of it does, or where it reaches behind the eye.
double pixelsOf(const project::Camera& camera, const mesh::Mesh& mesh, mesh::Id cell) {
  double x[4], y[4];
  int n = 0;
  for (const mesh::Id v : mesh.vertices(cell)) {
    const Vec3 p = camera.toScreen(mesh.points[v]);
    if (!camera.parallel() && !(p.z > 0.0)) return -1.0;
    x[n] = camera.parallel() ? p.x : p.x / p.z;
    y[n++] = camera.parallel() ? p.y : p.y / p.z;
  }
  const auto doubled = [&](int a, int b, int c) {
    return std::abs((x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]));
  };
  const auto [x0, x1] = std::minmax({x[0], x[1], x[2], x[3]});
  const auto [y0, y1] = std::minmax({y[0], y[1], y[2], y[3]});
  if (x1 < 0.0 || y1 < 0.0 || x0 > camera.width() || y0 > camera.height()) return -1.0;
  return 0.25 * (doubled(0, 1, 2) + doubled(0, 1, 3) + doubled(0, 2, 3) + doubled(1, 2, 3)) *
         shareWithin(x0, x1, camera.width()) * shareWithin(y0, y1, camera.height());
}

}  // namespace

bool walkPays(const Frame& frame) {
  const mesh::Mesh& mesh = frame.mesh;
  if (!mesh.tetrahedral() || mesh.cell_count() == 0) return false;
  const std::size_t step = std::max<std::size_t>(1, mesh.cell_count() / sampled_cells);
  const double cost = costOfAStep();
  double saved = 0.0;
  for (std::size_t c = 0; c < mesh.cell_count(); c += step) {
    const double pixels = pixelsOf(frame.camera, mesh, static_cast<mesh::Id>(c));
    saved += steps_of_a_cell + (pixels < 0.0 ? 0.0 : steps_of_a_set_up - pixels * cost);
  }
  return saved > 0.0;
}

// The mesh's values lie between its field's ends. A last piece that only its own beginning reaches, and that begins as
// the one before it ends, is left to that one.
void PieceTable::set(const Screen& screen) {
  const mesh::Field& field = screen.frame().field;
  const std::vector<Piece>& all = screen.pieces();
  const std::size_t first = screen.piece(field.lo);
  std::size_t last = screen.piece(field.hi);
  const auto jumpAfter = [&](std::size_t k) {
    const auto& points = screen.frame().transfer_function.points();
    const double at = points[k].value;
    return (k > 0 && points[k - 1].value == at) || (k + 1 < points.size() && points[k + 1].value == at);
  };
  if (last > first && static_cast<float>(screen.scaled(field.hi)) <= all[last - 1].end && !jumpAfter(last - 1)) --last;
  count = static_cast<std::int32_t>(last - first + 1);
  straight = all[first].reach >= static_cast<std::int32_t>(last);
  jumps = false;
  for (std::size_t k = first; k < last; ++k)
    jumps = jumps || jumpAfter(k);

  constexpr std::size_t padding = RayPacket::rays;
  const auto fill = [&](std::vector<float>& to, const auto& of) {
    to.assign(std::max<std::size_t>(last - first + 1, padding), 0.0F);
    for (std::size_t k = first; k <= last; ++k)
      to[k - first] = of(all[k]);
  };
  fill(end, [](const Piece& p) { return p.end; });
  begin.assign(end.size(), -std::numeric_limits<float>::max());
  std::copy_n(end.begin(), last - first, begin.begin() + 1);
  end[last - first] = std::numeric_limits<float>::max();
  fill(anchor, [](const Piece& p) { return p.anchor; });
  fill(extinction, [](const Piece& p) { return p.extinction; });
  fill(extinction_slope, [](const Piece& p) { return p.extinction_slope; });
  fill(bent, [](const Piece& p) { return p.bent; });
  for (std::size_t c = 0; c < 3; ++c) {
    fill(color[c], [c](const Piece& p) { return p.color[c]; });
    fill(color_slope[c], [c](const Piece& p) { return p.color_slope[c]; });
    fill(kink[c], [c](const Piece& p) { return p.kink[c]; });
  }
  setBendLimits();
}

void PieceTable::setBendLimits() {
  float largest = 0.0F;
  for (std::int32_t k = 1; k < count; ++k)
    largest = std::max(largest, bent[static_cast<std::size_t>(k)] - bent[static_cast<std::size_t>(k - 1)]);
  const float all = bent[static_cast<std::size_t>(count - 1)] - bent[0];
  // Half of what the scalar may change by, so that such bends leave out little enough of the thinnest series'
  // fragments.
  const auto half = [](float bend, float left_out) { return 0.5F * bend_left_out / (bend * left_out); };
  one_bend_half = half(largest, tiltLeftOut(thin_depth, thin_growth));
  few_bends_half = half(all, bowLeftOut(thin_depth, thin_growth, 2.0F, 1.0F));
}

// Composites tiles one after the other; one per thread.
class Walk::Painter {
 public:
  // Returns the number of pixels that could not be certified.
  std::size_t paint(const Walk& walk, const Screen& screen, std::size_t tile, Image& image);
  std::size_t fragments = 0;

 private:
  void begin(const Walk& walk, const Screen& screen, std::size_t tile);
  void setClips();
  void tryPixels(const WalkFrame& frame, const WalkPlace& place, std::span<const std::uint32_t> faces);
  void sortStarts();
  bool takeLayer(std::size_t layer, const WalkFrame& frame);
  std::size_t takeFlagged();

  TileView view_;
  Pixels pixels_;
  WalkScratch scratch_;
  PixelMask wanted_{};
  std::vector<Start> found_, starts_, layer_;
  std::array<std::uint32_t, tile_pixels + 1> begin_{};  // of each pixel's starts
};

void Walk::Painter::begin(const Walk& walk, const Screen& screen, std::size_t tile) {
  const auto columns = static_cast<std::size_t>(walk.columns_);
  view_.screen = &screen;
  view_.x0 = walk.region_.x0 + static_cast<int>(tile % columns) * tile_size;
  view_.y0 = walk.region_.y0 + static_cast<int>(tile / columns) * tile_size;
  view_.width = std::min(tile_size, walk.region_.x1 - view_.x0);
  view_.height = std::min(tile_size, walk.region_.y1 - view_.y0);
  clearPixels(view_, pixels_);
  setClips();
  wanted_.fill(0);
  for (int y = 0; y < view_.height; ++y) {
    for (int x = 0; x < view_.width; ++x)
      addPixel(wanted_, pixelIndex(x, y));
  }
}

// The depths, as the walk counts them, that the clip planes leave on each pixel's ray.
void Walk::Painter::setClips() {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  pixels_.clip_near.fill(-infinity);
  pixels_.clip_far.fill(infinity);
  const Screen& screen = *view_.screen;
  const double z0 = screen.parallel() ? screen.depths().z0 : 0.0;
  for (const sort::HalfSpace& clip : screen.clips()) {
    for (std::size_t p = 0; p < tile_pixels; ++p) {
      const Limit l = screen.limit(clip, view_.x0 + pixelColumn(p) + 0.5, view_.y0 + pixelRow(p) + 0.5);
      const auto depth = static_cast<float>(-l.at / l.slope - z0);
      if (l.slope > 0.0) pixels_.clip_near[p] = std::max(pixels_.clip_near[p], depth);
      if (l.slope < 0.0) pixels_.clip_far[p] = std::min(pixels_.clip_far[p], depth);
      if (l.slope == 0.0 && l.at < 0.0) pixels_.clip_far[p] = -infinity;
    }
  }
}

std::size_t Walk::Painter::paint(const Walk& walk, const Screen& screen, std::size_t tile, Image& image) {
  begin(walk, screen, tile);
  const std::span<const std::uint32_t> faces(walk.face_.data() + walk.offset_[tile],
                                             walk.face_.data() + walk.offset_[tile + 1]);
  float* const out = image.pixel(view_.x0, view_.y0);
  const std::size_t stride = 4 * static_cast<std::size_t>(image.width);
  if (faces.empty()) {
    storeBlank(view_.width, view_.height, out, stride);
    return 0;
  }
  std::size_t uncertified = 0;
  for (const auto& shift : beside) {
    const std::int32_t pixel = walk.frame_.pixel;
    const auto moved = [&](float by) { return static_cast<std::int32_t>(std::lround(by * static_cast<float>(pixel))); };
    const WalkPlace place{walk.first_.x + (view_.x0 - walk.region_.x0) * pixel + moved(shift[0]),
                          walk.first_.y + (view_.y0 - walk.region_.y0) * pixel + moved(shift[1])};
    tryPixels(walk.frame_, place, faces);
    uncertified = takeFlagged();
    if (uncertified == 0) break;
  }
  storePixels(pixels_, view_.width, view_.height, out, stride);
  return uncertified;
}

// All of the wanted pixels' rays, layer by layer: the first walk of each, the second, and so on.
void Walk::Painter::tryPixels(const WalkFrame& frame, const WalkPlace& place, std::span<const std::uint32_t> faces) {
  scratch_.balance.fill(0);
  found_.clear();
  findStarts(frame, place, faces, wanted_, scratch_, found_);
  for (std::size_t p = 0; p < tile_pixels; ++p) {
    if (hasPixel(wanted_, p) && scratch_.balance[p] != 0) addPixel(pixels_.flagged, p);
  }
  sortStarts();
  scratch_.left.fill(-std::numeric_limits<float>::infinity());
  for (std::size_t layer = 0; takeLayer(layer, frame); ++layer)
    fragments += walkRays(frame, place, layer_, pixels_, scratch_);
}

// By pixel, and there by depth. Of one depth, by face: so that the picture does not depend on the threads.
void Walk::Painter::sortStarts() {
  begin_.fill(0);
  for (const Start& s : found_)
    ++begin_[s.pixel + 1];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  starts_.resize(found_.size());
  std::array<std::uint32_t, tile_pixels + 1> next = begin_;
  for (const Start& s : found_)
    starts_[next[s.pixel]++] = s;
  for (std::size_t p = 0; p < tile_pixels; ++p) {
    if (begin_[p + 1] - begin_[p] < 2) continue;
    std::sort(starts_.begin() + begin_[p], starts_.begin() + begin_[p + 1], [](const Start& a, const Start& b) {
      return a.depth != b.depth ? a.depth < b.depth : a.entrance < b.entrance;
    });
  }
}

// The starts of one layer that are still to be walked. False where there is none of it on any pixel.
bool Walk::Painter::takeLayer(std::size_t layer, const WalkFrame& frame) {
  layer_.clear();
  bool any = false;
  for (std::size_t p = 0; p < tile_pixels; ++p) {
    if (begin_[p] + layer >= begin_[p + 1]) continue;
    any = true;
    const Start& start = starts_[begin_[p] + layer];
    if ((pixels_.light[p] < opaque_light && !frame.peaks) || hasPixel(pixels_.flagged, p)) continue;
    if (start.depth < scratch_.left[p] - frame.tolerance) {
      addPixel(pixels_.flagged, p);
    } else {
      layer_.push_back(start);
    }
  }
  return any;
}

// Clears the flagged pixels: they are wanted next. Returns how many they are.
std::size_t Walk::Painter::takeFlagged() {
  std::size_t count = 0;
  for (std::size_t p = 0; p < tile_pixels; ++p) {
    if (!hasPixel(pixels_.flagged, p)) continue;
    pixels_.red[p] = pixels_.green[p] = pixels_.blue[p] = 0.0F;
    pixels_.light[p] = 1.0F;
    ++count;
  }
  wanted_ = pixels_.flagged;
  pixels_.flagged.fill(0);
  return count;
}

Walk::Walk() = default;
Walk::~Walk() = default;

bool Walk::takes(const Frame& frame) {
  if (frame.integration != Integration::exact) return false;
  if (!linked_) {
    links_.set(frame.mesh);
    linked_ = true;
  }
  return !links_.links().empty();
}

void Walk::setHidden(const Frame& frame) {
  if (hidden_known_) return;
  hidden_known_ = true;
  hidden_.resize(frame.field.hidden.size());
  mesh::parallelFor(hidden_.size(), [&](std::size_t c) { hidden_[c] = frame.field.hidden[c] != 0 ? -1 : 0; });
}

bool Walk::sees(const Screen& screen) {
  const Depths& depths = screen.depths();
  if (!depths.parallel && !(depths.lo >= least_nearest * depths.hi)) return false;
  const double densest = screen.frame().transfer_function.densest();
  const double farthest = depths.parallel ? depths.hi - depths.lo : depths.hi;
  if (!(densest * farthest * std::numeric_limits<float>::epsilon() <= hidden_light)) return false;
  return setFineness(screen);
}

// Whatever part of the image is drawn, no place is farther from its middle than the image is wide, and then as far as
// the mesh reaches beside it.
bool Walk::setFineness(const Screen& screen) {
  const project::Camera& camera = screen.frame().camera;
  const double size = std::max(camera.width(), camera.height());
  using Range = tbb::blocked_range<std::size_t>;
  const float reach = tbb::parallel_reduce(
      Range(0, screen.mesh().points.size(), 1 << 14), 0.0F,
      [&](const Range& range, float most) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          most = std::max({most, std::abs(screen.places()[i].x), std::abs(screen.places()[i].y)});
        return most;
      },
      [](float a, float b) { return std::max(a, b); });
  std::int32_t pixel = finest_pixel;
  while (pixel >= coarsest_pixel && !((double{reach} + size) * pixel < farthest_place))
    pixel /= 2;
  frame_.pixel = pixel;
  return pixel >= coarsest_pixel;
}

bool Walk::draw(const Screen& screen, Image& image, FrameStats& stats) {
  pieces_.set(screen);
  setHidden(screen.frame());
  const Depths& depths = screen.depths();
  frame_.links = links_.links().data();
  frame_.entrances = links_.entrances().data();
  frame_.pieces = &pieces_;
  frame_.cell_values = screen.cell_values().empty() ? nullptr : screen.cell_values().data();
  frame_.hidden = hidden_.empty() ? nullptr : hidden_.data();
  frame_.peaks = screen.frame().peaks;
  frame_.clipped = !screen.clips().empty();
  frame_.many = links_.bytes() > large_links;
  frame_.parallel = screen.parallel();
  frame_.tolerance = static_cast<float>(overlap_tolerance * (depths.hi - depths.lo));
  frame_.most_steps = screen.mesh().cell_count() + RayPath::most;
  const int width = screen.frame().camera.width(), height = screen.frame().camera.height();
  for (int y = 0; y < height; y += region_size) {
    for (int x = 0; x < width; x += region_size) {
      const Box region{x, y, std::min(x + region_size, width), std::min(y + region_size, height)};
      if (!drawRegion(screen, region, image, stats)) return false;
    }
  }
  stats.certified = true;
  stats.kept_bytes = links_.bytes() + points_.size() * sizeof(WalkPoint) + hidden_.size() * sizeof(hidden_[0]);
  return true;
}

bool Walk::drawRegion(const Screen& screen, const Box& region, Image& image, FrameStats& stats) {
  region_ = region;
  columns_ = (region.x1 - region.x0 + tile_size - 1) / tile_size;
  rows_ = (region.y1 - region.y0 + tile_size - 1) / tile_size;
  setPoints(screen);
  frame_.points = points_.data();
  return findTiles(screen) && paint(screen, image, stats);
}

void Walk::setPoints(const Screen& screen) {
  const double x = 0.5 * (region_.x0 + region_.x1), y = 0.5 * (region_.y0 + region_.y1);
  const double pixel = frame_.pixel;
  first_ = {static_cast<std::int32_t>((region_.x0 + 0.5 - x) * pixel),
            static_cast<std::int32_t>((region_.y0 + 0.5 - y) * pixel)};
  const bool parallel = screen.parallel();
  const double z0 = screen.depths().z0;
  points_.resize(screen.mesh().points.size());
  mesh::parallelFor(points_.size(), [&](std::size_t i) {
    const Vertex& v = screen.vertices()[i];
    const double scale = parallel ? 1.0 : 1.0 / v.w;
    const auto place = [&](double at, double middle) {
      return static_cast<std::int32_t>(std::lrint((at * scale - middle) * pixel));
    };
    points_[i] = {place(v.x, x), place(v.y, y), static_cast<float>(parallel ? v.w - z0 : scale), v.value};
  });
}

Walk::TileRange Walk::tilesOf(const Entrance& entrance) const {
  const WalkPoint* corner[3] = {&points_[entrance.corner[0]], &points_[entrance.corner[1]],
                                &points_[entrance.corner[2]]};
  const auto range = [&](std::int32_t WalkPoint::*side, std::int32_t first, int count) {
    const auto [lo, hi] = std::minmax({corner[0]->*side, corner[1]->*side, corner[2]->*side});
    return PixelRange(lo - first, hi - first, frame_.pixel, count);
  };
  const PixelRange x = range(&WalkPoint::x, first_.x, region_.x1 - region_.x0);
  const PixelRange y = range(&WalkPoint::y, first_.y, region_.y1 - region_.y0);
  if (x.last < x.first || y.last < y.first) return {};
  const auto tile = [](int pixel) { return static_cast<std::uint16_t>(pixel / tile_size); };
  return {tile(x.first), tile(y.first), tile(x.last), tile(y.last)};
}

template <class Visit>
void Walk::visitTiles(const TileRange& range, const Visit& visit) const {
  for (std::size_t y = range.y0; y <= range.y1; ++y) {
    for (std::size_t x = range.x0; x <= range.x1; ++x)
      visit(y * static_cast<std::size_t>(columns_) + x);
  }
}

// Counts, then places; within a tile the faces lie in any order.
bool Walk::findTiles(const Screen& screen) {
  const std::size_t most = std::max<std::size_t>(std::size_t{1} << 24U, screen.mesh().cell_count());
  const std::vector<Entrance>& entrances = links_.entrances();
  offset_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
  range_.resize(entrances.size());
  std::atomic<std::size_t> total = 0;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, entrances.size(), 4096), [&](const auto& part) {
    std::size_t count = 0;
    for (std::size_t f = part.begin(); f != part.end() && total.load(std::memory_order_relaxed) + count <= most; ++f) {
      range_[f] = tilesOf(entrances[f]);
      visitTiles(range_[f], [&](std::size_t tile) {
        std::atomic_ref(offset_[tile + 1]).fetch_add(1, std::memory_order_relaxed);
        ++count;
      });
    }
    total.fetch_add(count, std::memory_order_relaxed);
  });
  if (total > most) return false;
  std::partial_sum(offset_.begin(), offset_.end(), offset_.begin());
  face_.resize(total);
  std::vector<std::uint32_t> next(offset_.begin(), offset_.end() - 1);
  mesh::parallelFor(entrances.size(), [&](std::size_t f) {
    visitTiles(range_[f], [&](std::size_t tile) {
      face_[std::atomic_ref(next[tile]).fetch_add(1, std::memory_order_relaxed)] = static_cast<std::uint32_t>(f);
    });
  });
  return true;
}

bool Walk::paint(const Screen& screen, Image& image, FrameStats& stats) {
  std::atomic<bool> certified = true;
  tbb::combinable<std::size_t> fragments([] { return std::size_t{0}; });
  tbb::parallel_for(std::size_t{0}, offset_.size() - 1, [&](std::size_t tile) {
    if (!certified.load(std::memory_order_relaxed)) return;
    std::unique_ptr<Painter>& painter = painters_.local();
    if (!painter) painter = std::make_unique<Painter>();
    painter->fragments = 0;
    if (painter->paint(*this, screen, tile, image) != 0) certified.store(false, std::memory_order_relaxed);
    fragments.local() += painter->fragments;
  });
  stats.fragments += fragments.combine(std::plus<>());
  stats.polygons += face_.size();
  return certified;
}

}  // namespace spillikin::composite::native
