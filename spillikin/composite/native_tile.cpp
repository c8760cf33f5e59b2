#include "spillikin/composite/native_tile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "spillikin/composite/native_centres.h"
#include "spillikin/integrate/segment.h"

namespace spillikin::composite::native {

namespace {

// Looking for opaque pixels takes as long as a few cells.
constexpr std::size_t cells_between_looks = 64;

// Fragments that a thread puts in order at a time: 32 MB.
constexpr std::size_t most_fragments = std::size_t{1} << 19U;

}  // namespace

TileStats TilePainter::paint(const Screen& screen, std::span<const Entry> entries, std::span<const PixelBox> pieces,
                             const Box& window, Image& image) {
  screen_ = &screen;
  window_ = window;
  view_.pieces = pieces;
  stats_ = {};
  if (entries.empty()) {
    storeBlank(window.x1 - window.x0, window.y1 - window.y0, image.pixel(window.x0, window.y0),
               4 * static_cast<std::size_t>(image.width));
    return stats_;
  }
  begin(screen, window);
  composite(entries);
  resolve(entries);
  write(image);
  return stats_;
}

// The longest ray is one of a corner: the length of a direction is convex over the tile.
void TilePainter::begin(const Screen& screen, const Box& window) {
  const project::Camera& camera = screen.frame().camera;
  view_.longest = 0.0F;
  for (const int x : {window.x0, window.x0 + tile_size}) {
    for (const int y : {window.y0, window.y0 + tile_size})
      view_.longest = std::max(view_.longest, static_cast<float>(glm::length(camera.direction(x, y))));
  }
  setView();
  clearPixels(view_, pixels_);
  setClips();
}

// Depths relative to the middle of the mesh err by a share of its extent, plain inverse depths by a share of
// themselves.
void TilePainter::setView() {
  constexpr float edge_on_slope = 4e3F;  // where float leaves a thousandth of the mesh's depth unknown
  const Depths& depths = screen_->depths();
  const double farthest = std::max(std::abs(depths.lo), std::abs(depths.hi));
  const bool relative = !depths.parallel && depths.z0 == 0.0;
  view_.screen = screen_;
  view_.x0 = window_.x0;
  view_.y0 = window_.y0;
  view_.width = window_.x1 - window_.x0;
  view_.height = window_.y1 - window_.y0;
  const Frame& frame = screen_->frame();
  view_.peaks = frame.peaks;
  view_.trusted = !frame.peaks && (frame.order.exact || !frame.order_matters);
  view_.relative = relative;
  if (relative) {
    view_.steepest = edge_on_slope;
    view_.nearness_scale = 1.0 / farthest;
    view_.rounding = float_rounding;
    view_.overlap_at = 0.0F;
    view_.overlap_slope = static_cast<float>(overlap_tolerance);
  } else {
    const double range = std::abs(depths.nearness(depths.lo) - depths.nearness(depths.hi));
    view_.steepest = edge_on_slope * static_cast<float>(range);
    view_.nearness_scale = depths.parallel ? std::max(range, farthest * 1e-9) : 1.0 / farthest;
    view_.rounding = float_rounding * static_cast<float>(depths.parallel ? range : range * farthest);
    view_.overlap_at = static_cast<float>(overlap_tolerance * range);
    view_.overlap_slope = 0.0F;
  }
  view_.z0 = static_cast<float>(depths.z0);
  view_.early_slope = 1.0F + view_.overlap_slope;
  view_.solid_at = solid_share * view_.overlap_at;
  view_.solid_slope = 1.0F + solid_share * view_.overlap_slope;
}

// The eye's own limit is depth above 0: nearness from that of infinity up.
void TilePainter::setClips() {
  const Depths& depths = screen_->depths();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float eye = depths.parallel ? -infinity : static_cast<float>(-depths.z0);
  view_.clipped = !screen_->clips().empty();
  if (!view_.clipped && unclipped_ == eye) return;
  pixels_.clip_near.fill(infinity);
  pixels_.clip_far.fill(eye);
  unclipped_ = view_.clipped ? std::numeric_limits<float>::quiet_NaN() : eye;
  for (const sort::HalfSpace& clip : screen_->clips()) {
    for (int y = 0; y < tile_size; ++y) {
      for (int x = 0; x < tile_size; ++x) {
        float& near = pixels_.clip_near[pixelIndex(x, y)];
        float& far = pixels_.clip_far[pixelIndex(x, y)];
        const Limit l = screen_->limit(clip, window_.x0 + x + 0.5, window_.y0 + y + 0.5);
        const double depth = -l.at / l.slope;
        if (l.slope > 0.0) {
          if (depths.parallel || depth > 0.0) near = std::min(near, static_cast<float>(depths.nearness(depth)));
        } else if (l.slope < 0.0) {
          far = depths.parallel || depth > 0.0 ? std::max(far, static_cast<float>(depths.nearness(depth))) : infinity;
        } else if (l.at < 0.0) {
          far = infinity;
        }
      }
    }
  }
}

// Runs of whole tetrahedra go to their kernel, pieces of them come one by one. All other cells have a kernel that takes
// pieces too.
void TilePainter::composite(std::span<const Entry> entries) {
  view_.hand_back = {[](void* self, Entry entry) { static_cast<TilePainter*>(self)->addCell(entry); },
                     [](void* self, Entry entry, std::span<const std::uint16_t> pixels) {
                       static_cast<TilePainter*>(self)->addRays(entry, pixels);
                     },
                     this};
  if (!screen_->mesh().tetrahedral()) {
    stats_.fragments += paintSheets(view_, entries, pixels_, sheets_);
    return;
  }
  for (std::size_t begin = 0; begin < entries.size();) {
    std::size_t end = begin;
    while (end < entries.size() && !entries[end].cut())
      ++end;
    if (end > begin) stats_.fragments += paintTetrahedra(view_, entries.subspan(begin, end - begin), pixels_, scratch_);
    for (; end < entries.size() && entries[end].cut(); ++end) {
      addCell(entries[end]);
      if (view_.trusted && end % cells_between_looks == 0 && markOpaque(pixels_)) return;
    }
    begin = end;
  }
}

mesh::Id TilePainter::cellOf(Entry entry) const {
  const sort::Order& order = screen_->frame().order;
  return entry.cut() ? order.cells[order.cuts[entry.index()].entry] : entry.index();
}

void TilePainter::setShape(Entry entry) {
  std::span<const sort::HalfSpace> keep;
  if (entry.cut()) keep = screen_->frame().order.cuts[entry.index()].keep;
  shape_.set(*screen_, cellOf(entry), keep, window_);
}

integrate::Radiance TilePainter::radiance(std::size_t pixel, const Span& span) const {
  return integrate::integrate(screen_->frame().transfer_function, span.front, span.back,
                              (span.far - span.near) * pixels_.length[pixel]);
}

// A whole cell or a piece of one; pixel by pixel where the vector kernel leaves it.
void TilePainter::addCell(Entry entry) {
  setShape(entry);
  const Box box = shape_.pixels(window_);
  if (box.empty() || shape_.triangles().empty()) return;
  // Of tetrahedra, peaks come here where float does not place them.
  const bool lost = view_.peaks && screen_->mesh().tetrahedral();
  if (!lost && flatten(view_, shape_, box, whole_)) {
    scratch_.left_over.clear();
    stats_.fragments += paintWhole(view_, whole_, pixels_, scratch_);
    for (const std::uint16_t pixel : scratch_.left_over)
      addRay(pixel);
    return;
  }
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x)
      addRay(pixelIndex(x - window_.x0, y - window_.y0));
  }
}

void TilePainter::addRays(Entry entry, std::span<const std::uint16_t> pixels) {
  setShape(entry);
  for (const std::uint16_t pixel : pixels)
    addRay(pixel);
}

void TilePainter::addRay(std::size_t pixel) {
  const std::size_t block = pixel / block_pixels;
  const std::size_t lane = pixel % block_pixels;
  const double x = view_.x0 + static_cast<double>(centres.x[block % block_columns][lane]);
  const double y = view_.y0 + static_cast<double>(centres.y[block / block_columns][lane]);
  shape_.spans(x, y, spans_);
  for (const Span& span : spans_)
    addSpan(pixel, span);
}

void TilePainter::addSpan(std::size_t i, const Span& span) {
  ++stats_.fragments;
  // At the eye itself nearness has no end, nor would a share of it.
  const double near = std::min(screen_->depths().nearness(span.near), nearness_limit * view_.nearness_scale);
  const double far = screen_->depths().nearness(span.far);
  const double tolerance = view_.overlap_at + view_.overlap_slope * std::max(near, 0.0);
  if (near > far + solid_share * tolerance) {
    if (near > pixels_.last[i] + tolerance) addPixel(pixels_.flagged, i);
    pixels_.last[i] = static_cast<float>(far);
  }
  if (view_.peaks) {
    pixels_.red[i] = std::max(pixels_.red[i], static_cast<float>(screen_->scaled(std::max(span.front, span.back))));
    pixels_.light[i] = 0.0F;
    return;
  }
  const integrate::Radiance r = radiance(i, span);
  const float light = pixels_.light[i];
  pixels_.red[i] += light * static_cast<float>(r.color[0]);
  pixels_.green[i] += light * static_cast<float>(r.color[1]);
  pixels_.blue[i] += light * static_cast<float>(r.color[2]);
  pixels_.light[i] = light - light * static_cast<float>(r.alpha);
}

// All fragments of the flagged pixels once more, put in the order of their depth.
void TilePainter::resolve(std::span<const Entry> entries) {
  if (!screen_->frame().order_matters) return;
  flagged_.clear();
  for (std::size_t block = 0; block < tile_blocks; ++block) {
    for (unsigned bits = pixels_.flagged[block]; bits != 0; bits &= bits - 1) {
      flagged_.push_back(
          static_cast<std::uint16_t>(block * block_pixels + static_cast<unsigned>(std::countr_zero(bits))));
    }
  }
  stats_.flagged += flagged_.size();
  if (!flagged_.empty()) resolvePart(entries, flagged_);
}

// As many pixels at a time as the memory promised allows; one always is.
void TilePainter::resolvePart(std::span<const Entry> entries, std::span<const std::uint16_t> pixels) {
  wanted_.fill(0);
  for (const std::uint16_t p : pixels)
    addPixel(wanted_, p);
  if (!collect(entries, pixels.size() == 1 ? std::numeric_limits<std::size_t>::max() : most_fragments)) {
    resolvePart(entries, pixels.first(pixels.size() / 2));
    resolvePart(entries, pixels.subspan(pixels.size() / 2));
    return;
  }
  // By pixel, else as they came.
  next_.assign(tile_pixels + 1, 0);
  for (const Fragment& f : fragments_)
    ++next_[f.pixel + 1];
  for (std::size_t p = 0; p < tile_pixels; ++p)
    next_[p + 1] += next_[p];
  by_pixel_.resize(fragments_.size());
  for (const Fragment& f : fragments_)
    by_pixel_[next_[f.pixel]++] = f;
  for (const std::uint16_t p : pixels) {
    const std::size_t begin = p == 0 ? 0 : next_[p - 1U];
    compositeSorted(std::span(by_pixel_).subspan(begin, next_[p] - begin));
  }
}

bool TilePainter::collect(std::span<const Entry> entries, std::size_t most) {
  fragments_.clear();
  view_.hand_back = {[](void* self, Entry entry) { static_cast<TilePainter*>(self)->collectCell(entry); },
                     [](void* self, Entry entry, std::span<const std::uint16_t> pixels) {
                       static_cast<TilePainter*>(self)->collectRays(entry, pixels);
                     },
                     this};
  if (!screen_->mesh().tetrahedral()) {
    return collectSheets(view_, entries, wanted_, pixels_, sheets_, scratch_.blank, most, fragments_);
  }
  for (std::size_t begin = 0; begin < entries.size();) {
    std::size_t end = begin;
    while (end < entries.size() && !entries[end].cut())
      ++end;
    if (end > begin &&
        !collectTetrahedra(view_, entries.subspan(begin, end - begin), wanted_, pixels_, scratch_, most, fragments_)) {
      return false;
    }
    for (; end < entries.size() && entries[end].cut(); ++end) {
      collectCell(entries[end]);
      if (fragments_.size() > most) return false;
    }
    begin = end;
  }
  return true;
}

bool TilePainter::wantedIn(const Box& blocks) const {
  for (int y = blocks.y0; y < blocks.y1; ++y) {
    for (int x = blocks.x0; x < blocks.x1; ++x) {
      if (wanted_[static_cast<std::size_t>(y) * block_columns + static_cast<std::size_t>(x)] != 0) return true;
    }
  }
  return false;
}

void TilePainter::collectCell(Entry entry) {
  const Box box = pixelBox(*screen_, screen_->mesh().vertices(cellOf(entry)), window_);
  if (box.empty() || !wantedIn({(box.x0 - window_.x0) / 4, (box.y0 - window_.y0) / 4, (box.x1 - window_.x0 + 3) / 4,
                                (box.y1 - window_.y0 + 3) / 4})) {
    return;
  }
  setShape(entry);
  if (shape_.triangles().empty()) return;
  if (flatten(view_, shape_, box, whole_)) {
    scratch_.left_over.clear();
    collectWhole(view_, whole_, wanted_, pixels_, scratch_, fragments_);
    for (const std::uint16_t pixel : scratch_.left_over)
      collectRay(pixel);
    return;
  }
  for (int y = box.y0 - window_.y0; y < box.y1 - window_.y0; ++y) {
    for (int x = box.x0 - window_.x0; x < box.x1 - window_.x0; ++x) {
      const std::size_t i = pixelIndex(x, y);
      if ((wanted_[i / block_pixels] >> (i % block_pixels) & 1) != 0) collectRay(i);
    }
  }
}

void TilePainter::collectRays(Entry entry, std::span<const std::uint16_t> pixels) {
  setShape(entry);
  for (const std::uint16_t pixel : pixels) {
    if ((wanted_[pixel / block_pixels] >> (pixel % block_pixels) & 1) != 0) collectRay(pixel);
  }
}

void TilePainter::collectRay(std::size_t i) {
  const std::size_t block = i / block_pixels;
  const std::size_t lane = i % block_pixels;
  shape_.spans(view_.x0 + static_cast<double>(centres.x[block % block_columns][lane]),
               view_.y0 + static_cast<double>(centres.y[block / block_columns][lane]), spans_);
  for (const Span& span : spans_) {
    const integrate::Radiance r = radiance(i, span);
    fragments_.push_back({static_cast<float>(screen_->depths().nearness(span.near)),
                          static_cast<float>(screen_->depths().nearness(span.far)), static_cast<float>(r.color[0]),
                          static_cast<float>(r.color[1]), static_cast<float>(r.color[2]),
                          static_cast<float>(1.0 - r.alpha), static_cast<std::uint32_t>(i)});
  }
}

// What still overlaps, though in order, does so in space.
void TilePainter::compositeSorted(std::span<Fragment> fragments) {
  if (fragments.empty()) return;
  std::stable_sort(fragments.begin(), fragments.end(), [](const Fragment& a, const Fragment& b) {
    return a.near != b.near ? a.near > b.near : a.far > b.far;
  });
  const std::size_t i = fragments.front().pixel;
  bool overlap = false;
  float end = std::numeric_limits<float>::infinity();
  float red = 0.0F, green = 0.0F, blue = 0.0F, light = 1.0F;
  for (const Fragment& f : fragments) {
    const float tolerance = view_.overlap_at + view_.overlap_slope * std::max(f.near, 0.0F);
    if (f.near > f.far + solid_share * tolerance) {
      overlap = overlap || f.near > end + tolerance;
      end = std::min(end, f.far);
    }
    red += light * f.red;
    green += light * f.green;
    blue += light * f.blue;
    light *= f.light;
  }
  pixels_.red[i] = red;
  pixels_.green[i] = green;
  pixels_.blue[i] = blue;
  pixels_.light[i] = light;
  ++(overlap ? stats_.unresolved : stats_.resolved);
}

void TilePainter::write(Image& image) const {
  storePixels(pixels_, view_.width, view_.height, image.pixel(window_.x0, window_.y0),
              4 * static_cast<std::size_t>(image.width));
}

}  // namespace spillikin::composite::native
