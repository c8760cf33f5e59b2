#include "spillikin/composite/native_tile.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "spillikin/integrate/segment.h"

namespace spillikin::composite::native {

TileStats TilePainter::paint(const Screen& screen, std::span<const Entry> entries, const Box& window, Image& image) {
  screen_ = &screen;
  stats_ = {};
  begin(screen, window);
  for (const Entry entry : entries)
    addCell(entry);
  resolve(entries);
  write(image);
  return stats_;
}

void TilePainter::begin(const Screen& screen, const Box& window) {
  window_ = window;
  pixels_.red.fill(0.0F);
  pixels_.green.fill(0.0F);
  pixels_.blue.fill(0.0F);
  pixels_.light.fill(1.0F);
  pixels_.last.fill(std::numeric_limits<float>::infinity());
  pixels_.flagged.fill(0);
  const project::Camera& camera = screen.frame().camera;
  for (int y = 0; y < tile_size; ++y) {
    for (int x = 0; x < tile_size; ++x) {
      pixels_.length[pixelIndex(x, y)] =
          static_cast<float>(glm::length(camera.direction(window.x0 + x + 0.5, window.y0 + y + 0.5)));
    }
  }
  // Depths relative to the middle of the mesh err by a share of its extent, plain inverse depths by a share of
  // themselves.
  const Depths& depths = screen.depths();
  const bool relative = !depths.parallel && depths.z0 == 0.0;
  overlap_slope_ = relative ? overlap_tolerance : 0.0;
  overlap_at_ = relative ? 0.0 : overlap_tolerance * std::abs(depths.nearness(depths.lo) - depths.nearness(depths.hi));
}

mesh::Id TilePainter::setShape(Entry entry) {
  const sort::Order& order = screen_->frame().order;
  const sort::Cut* cut = entry.cut() ? &order.cuts[entry.index()] : nullptr;
  const mesh::Id cell = cut != nullptr ? order.cells[cut->entry] : entry.index();
  shape_.set(*screen_, cell, cut != nullptr ? &cut->keep : nullptr, window_.x0, window_.y0);
  return cell;
}

void TilePainter::addCell(Entry entry) {
  setShape(entry);
  const Box box = shape_.pixels(window_);
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      shape_.spans(x + 0.5, y + 0.5, spans_);
      for (const Span& span : spans_)
        addSpan(pixelIndex(x - window_.x0, y - window_.y0), span);
    }
  }
}

void TilePainter::addSpan(int pixel, const Span& span) {
  ++stats_.fragments;
  const auto i = static_cast<std::size_t>(pixel);
  const double near = screen_->depths().nearness(span.near);
  const double tolerance = overlap_at_ + overlap_slope_ * near;
  if (near > pixels_.last[i] + tolerance) pixels_.flagged[i / block_pixels] |= std::uint16_t(1U << (i % block_pixels));
  pixels_.last[i] = static_cast<float>(screen_->depths().nearness(span.far));
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
        const int i = pixelIndex(x - window_.x0, y - window_.y0);
        if ((pixels_.flagged[static_cast<std::size_t>(i / block_pixels)] >> (i % block_pixels) & 1) == 0) continue;
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
      const auto i = static_cast<std::size_t>(pixelIndex(x - window_.x0, y - window_.y0));
      out[0] = pixels_.red[i];
      out[1] = pixels_.green[i];
      out[2] = pixels_.blue[i];
      out[3] = 1.0F - pixels_.light[i];
    }
  }
}

}  // namespace spillikin::composite::native
