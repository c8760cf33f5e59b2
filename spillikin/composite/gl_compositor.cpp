#include "spillikin/composite/gl_compositor.h"

#include <array>
#include <cstdint>
#include <optional>

#include "spillikin/base/error.h"
#include "spillikin/composite/gl_cell_drawer.h"
#include "spillikin/composite/gl_clock.h"
#include "spillikin/composite/gl_frame.h"
#include "spillikin/composite/gl_look.h"
#include "spillikin/composite/gl_polygon_drawer.h"
#include "spillikin/composite/gl_program.h"
#include "spillikin/composite/gl_shaders.h"
#include "spillikin/composite/gl_target.h"
#include "spillikin/composite/peaks.h"

namespace spillikin::composite {

namespace {

// The shaders' uniform block View.
struct ViewBlock {
  std::array<float, 4> pixel{}, lens{}, window{};
  std::array<std::int32_t, 4> counts{};
};

Window windowOf(const Tile& tile, const FrameMap& map) {
  const auto left = static_cast<float>(tile.x - map.center_x());
  const auto top = static_cast<float>(tile.y - map.center_y());
  return {left, top, left + static_cast<float>(tile.width), top + static_cast<float>(tile.height)};
}

class GlCompositor : public Compositor {
 public:
  explicit GlCompositor(std::unique_ptr<GlContext> context);
  ~GlCompositor() override;
  GlCompositor(const GlCompositor&) = delete;
  GlCompositor& operator=(const GlCompositor&) = delete;

  FrameStats draw(const Frame& frame, Image& image) override;
  Backend backend() const override { return context_->backend(); }

 private:
  void prepare(const Frame& frame, const FrameMap& map, bool changed);
  void sendView(const Frame& frame, const FrameMap& map, const Window& window);

  std::unique_ptr<GlContext> context_;
  const Gl& gl_;
  GlTarget target_;
  GlBuffer view_;
  GlSampleCount samples_;
  GlLook look_;
  std::optional<GlCellDrawer> cells_;
  std::optional<GlPolygonDrawer> polygons_;
  std::optional<Bounds> bounds_;
};

GlCompositor::GlCompositor(std::unique_ptr<GlContext> context) : context_(std::move(context)), gl_(context_->gl()) {
  const CurrentContext current(*context_);
  cells_.emplace(gl_);
  polygons_.emplace(gl_);
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  check(gl_, "preparing the context");
}

GlCompositor::~GlCompositor() {
  try {
    const CurrentContext current(*context_);
    cells_->destroy();
    polygons_->destroy();
    look_.destroy(gl_);
    view_.destroy(gl_);
    target_.destroy(gl_);
    samples_.destroy(gl_);
  } catch (const Error&) {
    // A context that cannot be made current any more takes its objects with it.
  }
}

FrameStats GlCompositor::draw(const Frame& frame, Image& image) {
  if (frame.peaks && frame.integration == Integration::vertex) {
    throw Error("--optics mip draws no polygons with looks at their vertices; leave --integrate vertex out");
  }
  const auto start = Clock::now();
  const CurrentContext current(*context_);
  const bool changed = !frame.same_mesh || !bounds_;
  if (changed) {
    bounds_ = bounds(frame.mesh);
  }
  const FrameMap map(frame.camera, *bounds_);
  prepare(frame, map, changed);
  FrameStats stats;
  stats.project_seconds = secondsSince(start);
  image.width = frame.camera.width();
  image.height = frame.camera.height();
  image.rgba.resize(4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  gl_.BlendEquation(frame.peaks ? GL_MAX : GL_FUNC_ADD);
  samples_.begin(gl_);
  for (const Tile& tile : target_.tiles(gl_, image.width, image.height)) {
    target_.begin(gl_, tile);
    const Window window = windowOf(tile, map);
    sendView(frame, map, window);
    if (frame.integration == Integration::vertex) {
      polygons_->draw(frame, map, stats);
    } else {
      cells_->draw(frame, map, look_, window, stats);
    }
    target_.read(gl_, tile, image);
  }
  stats.fragments = samples_.end(gl_);
  check(gl_, "drawing");
  if (frame.peaks) {
    colorPeaks(frame, image);
  }
  stats.composite_seconds = secondsSince(start) - stats.project_seconds;
  return stats;
}

void GlCompositor::prepare(const Frame& frame, const FrameMap& map, bool changed) {
  if (frame.integration == Integration::vertex) {
    polygons_->prepare(frame);
    if (changed) {
      cells_->forgetMesh();
    }
    look_.forget(frame);
    return;
  }
  look_.prepare(gl_, frame, map.unit());
  cells_->prepare(frame, map, look_, changed);
}

void GlCompositor::sendView(const Frame& frame, const FrameMap& map, const Window& window) {
  const float width = window.x1 - window.x0;
  const float height = window.y1 - window.y0;
  ViewBlock block;
  block.pixel = {window.x0, window.y0, map.weightTerms()[0], map.weightTerms()[1]};
  block.lens = {map.eyeDepth(), map.squaredSlope(), static_cast<float>(map.unit()), 0.0F};
  // Row 0 of the framebuffer is the image's top row: y down in the image is y up in clip space.
  block.window = {2.0F / width, 2.0F / height, -1.0F - 2.0F * window.x0 / width, -1.0F - 2.0F * window.y0 / height};
  block.counts = {static_cast<std::int32_t>(frame.camera.view().clips.size()), look_.pieces(), transfer_bins, 0};
  view_.upload(gl_, GL_UNIFORM_BUFFER, &block, sizeof block);
  gl_.BindBufferBase(GL_UNIFORM_BUFFER, gl_binding::view, view_.id());
}

}  // namespace

std::unique_ptr<Compositor> makeGlCompositor(std::unique_ptr<GlContext> context) {
  return std::make_unique<GlCompositor>(std::move(context));
}

}  // namespace spillikin::composite
