#include "spillikin/composite/native_tile.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "spillikin/composite/native_centres.h"
#include "spillikin/integrate/segment.h"

namespace spillikin::composite::native {

namespace {

// Looking for opaque pixels takes as long as a few cells.
constexpr std::size_t cells_between_looks = 64;

}  // namespace

TileStats TilePainter::paint(const Screen& screen, std::span<const Entry> entries, const Box& window, Image& image) {
  screen_ = &screen;
  window_ = window;
  stats_ = {};
  begin(screen, window);
  setView();
  composite(entries);
  resolve(entries);
  write(image);
  return stats_;
}

void TilePainter::begin(const Screen& screen, const Box& window) {
  pixels_.red.fill(0.0F);
  pixels_.green.fill(0.0F);
  pixels_.blue.fill(0.0F);
  pixels_.light.fill(1.0F);
  pixels_.last.fill(std::numeric_limits<float>::infinity());
  pixels_.flagged.fill(0);
  pixels_.live.fill(1);
  const project::Camera& camera = screen.frame().camera;
  view_.longest = 0.0F;
  for (int y = 0; y < tile_size; ++y) {
    for (int x = 0; x < tile_size; ++x) {
      const auto length = static_cast<float>(glm::length(camera.direction(window.x0 + x + 0.5, window.y0 + y + 0.5)));
      pixels_.length[pixelIndex(x, y)] = length;
      view_.longest = std::max(view_.longest, length);
    }
  }
  setClips();
}

// Depths relative to the middle of the mesh err by a share of its extent, plain inverse depths by a share of
// themselves.
void TilePainter::setView() {
  constexpr float float_rounding = 4e-7F;  // a few units in the last place
  const Depths& depths = screen_->depths();
  const double farthest = std::max(std::abs(depths.lo), std::abs(depths.hi));
  const bool relative = !depths.parallel && depths.z0 == 0.0;
  view_.screen = screen_;
  view_.x0 = window_.x0;
  view_.y0 = window_.y0;
  view_.width = window_.x1 - window_.x0;
  view_.height = window_.y1 - window_.y0;
  view_.trusted = screen_->frame().order.exact;
  if (relative) {
    view_.nearness_scale = 1.0 / farthest;
    view_.rounding = float_rounding;
    view_.overlap_at = 0.0F;
    view_.overlap_slope = static_cast<float>(overlap_tolerance);
  } else {
    const double range = std::abs(depths.nearness(depths.lo) - depths.nearness(depths.hi));
    view_.nearness_scale = depths.parallel ? std::max(range, farthest * 1e-9) : 1.0 / farthest;
    view_.rounding = float_rounding * static_cast<float>(depths.parallel ? range : range * farthest);
    view_.overlap_at = static_cast<float>(overlap_tolerance * range);
    view_.overlap_slope = 0.0F;
  }
}

// The eye's own limit is depth above 0: nearness from that of infinity up.
void TilePainter::setClips() {
  const Depths& depths = screen_->depths();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  pixels_.clip_near.fill(infinity);
  pixels_.clip_far.fill(depths.parallel ? -infinity : static_cast<float>(-depths.z0));
  view_.clipped = !screen_->clips().empty();
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

// Runs of whole tetrahedra go to the vector kernels, what is cut or has other faces comes one by one.
void TilePainter::composite(std::span<const Entry> entries) {
  const bool tetrahedral = screen_->mesh().tetrahedral();
  for (std::size_t begin = 0; begin < entries.size();) {
    std::size_t end = begin;
    while (tetrahedral && end < entries.size() && !entries[end].cut())
      ++end;
    if (end > begin) stats_.fragments += paintTetrahedra(view_, entries.subspan(begin, end - begin), pixels_, scratch_);
    for (; end < entries.size() && (!tetrahedral || entries[end].cut()); ++end) {
      addCell(entries[end]);
      if (view_.trusted && end % cells_between_looks == 0 && markOpaque(pixels_)) return;
    }
    begin = end;
  }
}

mesh::Id TilePainter::setShape(Entry entry) {
  const sort::Order& order = screen_->frame().order;
  const sort::Cut* cut = entry.cut() ? &order.cuts[entry.index()] : nullptr;
  const mesh::Id cell = cut != nullptr ? order.cells[cut->entry] : entry.index();
  shape_.set(*screen_, cell, cut != nullptr ? &cut->keep : nullptr, window_.x0, window_.y0);
  return cell;
}

// A whole cell, or a piece of one, which goes pixel by pixel.
void TilePainter::addCell(Entry entry) {
  setShape(entry);
  const Box box = shape_.pixels(window_);
  if (box.empty()) return;
  if (!entry.cut() && flatten(view_, shape_, box, whole_)) {
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
  const double near = screen_->depths().nearness(span.near);
  const double far = screen_->depths().nearness(span.far);
  const double tolerance = view_.overlap_at + view_.overlap_slope * std::max(near, 0.0);
  if (near > far + solid_share * tolerance) {
    if (near > pixels_.last[i] + tolerance) {
      pixels_.flagged[i / block_pixels] |= static_cast<std::uint16_t>(1U << (i % block_pixels));
    }
    pixels_.last[i] = static_cast<float>(far);
  }
  const integrate::Radiance r = integrate::integrate(screen_->frame().transfer_function, span.front, span.back,
                                                     (span.far - span.near) * pixels_.length[i]);
  const float light = pixels_.light[i];
  pixels_.red[i] += light * static_cast<float>(r.color[0]);
  pixels_.green[i] += light * static_cast<float>(r.color[1]);
  pixels_.blue[i] += light * static_cast<float>(r.color[2]);
  pixels_.light[i] = light - light * static_cast<float>(r.alpha);
}

// All fragments of the flagged pixels once more, in double precision and in the order of their depth.
void TilePainter::resolve(std::span<const Entry> entries) {
  for (const std::uint16_t mask : pixels_.flagged)
    stats_.flagged += static_cast<std::size_t>(__builtin_popcount(mask));
  if (stats_.flagged == 0) return;
  fragments_.clear();
  for (const Entry entry : entries) {
    const mesh::Id cell = setShape(entry);
    const Box box = shape_.pixels(window_);
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) {
        const std::size_t i = pixelIndex(x - window_.x0, y - window_.y0);
        if ((pixels_.flagged[i / block_pixels] >> (i % block_pixels) & 1) == 0) continue;
        shape_.spans(x + 0.5, y + 0.5, spans_);
        for (const Span& span : spans_)
          fragments_.push_back({static_cast<std::uint32_t>(i), cell, span});
      }
    }
  }
  std::stable_sort(fragments_.begin(), fragments_.end(), [](const Fragment& a, const Fragment& b) {
    if (a.pixel != b.pixel) return a.pixel < b.pixel;
    return a.span.near != b.span.near ? a.span.near < b.span.near : a.span.far < b.span.far;
  });
  for (std::size_t begin = 0; begin < fragments_.size();) {
    std::size_t end = begin;
    while (end < fragments_.size() && fragments_[end].pixel == fragments_[begin].pixel)
      ++end;
    compositeSorted(std::span(fragments_).subspan(begin, end - begin));
    begin = end;
  }
}

void TilePainter::compositeSorted(std::span<const Fragment> fragments) {
  const std::size_t i = fragments.front().pixel;
  const double depth_scale = std::max(std::abs(screen_->depths().lo), std::abs(screen_->depths().hi));
  bool overlap = false;
  double end = -std::numeric_limits<double>::infinity();
  integrate::Radiance sum;
  for (const Fragment& f : fragments) {
    overlap = overlap || f.span.near < end - resolved_tolerance * depth_scale;
    end = std::max(end, f.span.far);
    sum = integrate::over(sum, integrate::integrate(screen_->frame().transfer_function, f.span.front, f.span.back,
                                                    (f.span.far - f.span.near) * pixels_.length[i]));
  }
  pixels_.red[i] = static_cast<float>(sum.color[0]);
  pixels_.green[i] = static_cast<float>(sum.color[1]);
  pixels_.blue[i] = static_cast<float>(sum.color[2]);
  pixels_.light[i] = static_cast<float>(1.0 - sum.alpha);
  ++(overlap ? stats_.unresolved : stats_.resolved);
}

void TilePainter::write(Image& image) const {
  for (int y = window_.y0; y < window_.y1; ++y) {
    float* out = image.pixel(window_.x0, y);
    for (int x = window_.x0; x < window_.x1; ++x, out += 4) {
      const std::size_t i = pixelIndex(x - window_.x0, y - window_.y0);
      out[0] = pixels_.red[i];
      out[1] = pixels_.green[i];
      out[2] = pixels_.blue[i];
      out[3] = 1.0F - pixels_.light[i];
    }
  }
}

}  // namespace spillikin::composite::native
