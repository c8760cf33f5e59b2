#include "spillikin/sort/turns.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace spillikin::sort {
namespace {

// Parts depend on the number of cells alone; a part's histogram is worth its cost from here on.
constexpr std::size_t least_part = 1 << 15, most_parts = 64;
// Room for rounding, relative to the largest coordinate or distance: far above that of a dozen operations.
constexpr double slack = 1e-13;

double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

}  // namespace

DepthBands::DepthBands(const Vec3& lower, const Vec3& upper, const Viewpoint& viewpoint) : viewpoint_(viewpoint) {
  const Vec3 v(viewpoint);
  double near = std::numeric_limits<double>::infinity(), largest = 0.0;
  far_ = -near;
  if (viewpoint.w == 0.0) {
    const double length = std::sqrt(dot(v, v));
    viewpoint_ = Viewpoint(length > 0.0 ? v / length : v, 0.0);
  }
  Vec3 inside(0.0);  // the box's point nearest to the eye
  for (int k = 0; k < 3; ++k)
    inside[k] = std::clamp(v[k], lower[k], upper[k]);
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 p(0.0);
    for (int k = 0; k < 3; ++k) {
      p[k] = ((corner >> k) & 1U) != 0 ? upper[k] : lower[k];
      largest = std::max(largest, std::abs(p[k]));
    }
    const double d = viewpoint.w == 0.0 ? -dot(p, Vec3(viewpoint_)) : std::sqrt(dot(p - v, p - v));
    near = std::min(near, d);
    far_ = std::max(far_, d);
  }
  if (viewpoint.w != 0.0) near = std::sqrt(dot(inside - v, inside - v));
  room_ = slack * std::max(largest, std::max(std::abs(near), std::abs(far_)));
  if (far_ > near && std::isfinite(far_ - near)) depth_ = far_ - near;
  scale_ = depth_ > 0.0 ? (bands - 2) / depth_ : 0.0;
}

Turn DepthBands::band(double distance) const {
  const double at = (far_ - distance) * scale_;
  return static_cast<Turn>(1.0 + std::clamp(std::isnan(at) ? 0.0 : at, 0.0, static_cast<double>(bands - 2)));
}

Turn DepthBands::latest(const Triangle& t) const {
  const Vec3 v(viewpoint_);
  if (viewpoint_.w == 0.0) return band(-std::max({dot(t[0], v), dot(t[1], v), dot(t[2], v)}) - room_);
  // No point lies nearer than its height above the eye along any one direction.
  const Vec3 a = t[0] - v, b = t[1] - v, c = t[2] - v, middle = a + b + c;
  const double length = std::sqrt(dot(middle, middle));
  const double near = length > 0.0 ? std::min({dot(a, middle), dot(b, middle), dot(c, middle)}) / length : 0.0;
  return band(std::max(0.0, near) - room_);
}

Turn DepthBands::earliest(const Triangle& t) const {
  const Vec3 v(viewpoint_);
  if (viewpoint_.w == 0.0) return band(-std::min({dot(t[0], v), dot(t[1], v), dot(t[2], v)}) + room_);
  const Vec3 a = t[0] - v, b = t[1] - v, c = t[2] - v;
  return band(std::sqrt(std::max({dot(a, a), dot(b, b), dot(c, c)})) + room_);
}

std::vector<std::size_t> exteriorRows(const mesh::Mesh& mesh, const FaceSigns& signs,
                                      std::span<const ExteriorTriangle> triangles) {
  std::vector<std::size_t> rows;
  rows.reserve(triangles.size());
  for (const ExteriorTriangle& t : triangles) {
    std::size_t row = t.face;
    if (t.face >= mesh.triangle_count()) {
      const auto& quad = mesh.quad[t.face - mesh.triangle_count()];
      row = t.corner[1] == quad[1] ? signs.firstHalf(t.face) : signs.secondHalf(t.face);
    }
    rows.push_back(row);
  }
  return rows;
}

void raise(Turn& turn, Turn least) {
  const std::atomic_ref<Turn> shared(turn);
  Turn old = shared.load(std::memory_order_relaxed);
  while (old < least && !shared.compare_exchange_weak(old, least, std::memory_order_relaxed)) {
  }
}

void TurnSort::operator()(std::span<const Turn> turn, std::vector<mesh::Id>& cells) {
  constexpr std::size_t turns = std::size_t{std::numeric_limits<Turn>::max()} + 1;
  const std::size_t count = cells.size();
  const std::size_t parts = std::clamp<std::size_t>(count / least_part, 1, most_parts);
  const std::size_t part_size = (count + parts - 1) / parts;
  other_.resize(count);
  Turn last = 0;
  for (const Turn t : turn)
    last = std::max(last, t);
  const std::size_t used = std::min(turns, std::size_t{last} + 1);
  histogram_.resize(parts * used);
  const auto forEachPart = [&](auto&& f) {
    tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
      f(histogram_.data() + part * used, std::min(count, part * part_size), std::min(count, (part + 1) * part_size));
    });
  };
  forEachPart([&](std::uint32_t* histogram, std::size_t begin, std::size_t end) {
    std::fill(histogram, histogram + used, 0U);
    for (std::size_t i = begin; i < end; ++i)
      ++histogram[turn[cells[i]]];
  });
  std::uint32_t sum = 0;
  for (std::size_t t = 0; t < used; ++t) {
    for (std::size_t part = 0; part < parts; ++part) {
      const std::uint32_t here = histogram_[part * used + t];
      histogram_[part * used + t] = sum;
      sum += here;
    }
  }
  forEachPart([&](std::uint32_t* next, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      other_[next[turn[cells[i]]]++] = cells[i];
  });
  cells.swap(other_);
}

}  // namespace spillikin::sort
