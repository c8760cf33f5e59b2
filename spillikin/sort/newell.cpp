#include "spillikin/sort/newell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "spillikin/mesh/predicates.h"
#include "spillikin/sort/splice.h"

namespace spillikin::sort {
namespace {

// Room for the rounding of measured extents, relative to the distances involved: they only ever spare exact tests.
constexpr double slack = 1e-12;
constexpr std::uint32_t most_windows = 256;

double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace

Newell::Newell(const mesh::Mesh& mesh)
    : mesh_(mesh), centre_(mesh.cell_count()), radius_(mesh.cell_count()), convex_(mesh.cell_count()), xmpvo_(mesh) {
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    Vec3 mean(0.0);
    const auto vertices = mesh.vertices(c);
    for (const mesh::Id v : vertices)
      mean += mesh.points[v];
    mean /= static_cast<double>(vertices.size());
    double radius = 0.0;
    for (const mesh::Id v : vertices)
      radius = std::max(radius, std::sqrt(dot(mesh.points[v] - mean, mesh.points[v] - mean)));
    centre_[c] = mean;
    radius_[c] = radius * (1.0 + slack);
    convex_[c] = isConvex(c) ? 1 : 0;
  }
}

bool Newell::isConvex(mesh::Id cell) {
  mesh::surface(mesh_, cell, surface_);
  const auto vertices = mesh_.vertices(cell);
  return std::all_of(surface_.triangles.begin(), surface_.triangles.end(), [&](const auto& t) {
    return std::all_of(vertices.begin(), vertices.end(), [&](mesh::Id v) {
      return mesh::orient3d(mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]], mesh_.points[v]) <= 0;
    });
  });
}

// Depths are distances from the eye, or heights against the direction to the viewer: both grow along every ray.
void Newell::measure(const Viewpoint& viewpoint) {
  const bool parallel = viewpoint.w == 0.0;
  const Vec3 eye(viewpoint);
  Vec3 middle(0.0);
  for (const Vec3& c : centre_)
    middle += c / static_cast<double>(centre_.size());
  Vec3 forward = parallel ? -eye : middle - eye;
  const double length = std::sqrt(dot(forward, forward));
  forward = length > 0.0 ? forward / length : Vec3(0.0, 0.0, -1.0);
  Vec3 right = std::abs(forward.x) < 0.6 ? cross(forward, Vec3(1.0, 0.0, 0.0)) : cross(forward, Vec3(0.0, 1.0, 0.0));
  right /= std::sqrt(dot(right, right));
  const Vec3 up = cross(right, forward);
  extent_.assign(mesh_.cell_count(), {});
  for (mesh::Id c = 0; c < mesh_.cell_count(); ++c) {
    Extent& e = extent_[c];
    e.lower.fill(std::numeric_limits<double>::infinity());
    e.upper.fill(-std::numeric_limits<double>::infinity());
    e.nearest = std::numeric_limits<double>::infinity();
    e.farthest = -e.nearest;
    bool in_front = true;
    for (const mesh::Id v : mesh_.vertices(c)) {
      const Vec3 p = parallel ? mesh_.points[v] : mesh_.points[v] - eye;
      const double z = dot(p, forward), size = std::sqrt(dot(p, p));
      const double depth = parallel ? z : size;
      const double room = slack * size;
      e.nearest = std::min(e.nearest, depth - room);
      e.farthest = std::max(e.farthest, depth + room);
      in_front = in_front && (parallel || z > 1e-3 * size);
      const double scale = parallel ? 1.0 : 1.0 / z;
      const double image[2] = {dot(p, right) * scale, dot(p, up) * scale};
      for (std::size_t k = 0; k < 2; ++k) {
        const double image_room = parallel ? room : 1e6 * slack;  // z > size / 1000 above
        e.lower[k] = std::min(e.lower[k], image[k] - image_room);
        e.upper[k] = std::max(e.upper[k], image[k] + image_room);
      }
    }
    // A convex cell's nearest point may lie inside it; its bounding sphere is nearer.
    if (!parallel) e.nearest = std::sqrt(dot(centre_[c] - eye, centre_[c] - eye)) * (1.0 - slack) - radius_[c];
    if (!in_front) {
      e.lower.fill(-std::numeric_limits<double>::infinity());
      e.upper.fill(std::numeric_limits<double>::infinity());
    }
  }
}

void Newell::windows() {
  double lower[2], upper[2];
  for (std::size_t k = 0; k < 2; ++k) {
    lower[k] = std::numeric_limits<double>::infinity();
    upper[k] = -lower[k];
    for (const Extent& e : extent_) {
      if (!std::isfinite(e.lower[k])) continue;
      lower[k] = std::min(lower[k], e.lower[k]);
      upper[k] = std::max(upper[k], e.upper[k]);
    }
  }
  const double n = std::max(1.0, std::sqrt(static_cast<double>(mesh_.cell_count()) / 4.0));
  side_ = std::min(most_windows, static_cast<std::uint32_t>(n));
  window_.resize(std::size_t{side_} * side_);
  window_head_.assign(window_.size(), 0);
  for (auto& window : window_)
    window.clear();
  const auto place = [&](double x, std::size_t k) {
    const double at = (x - lower[k]) / (upper[k] - lower[k]) * side_;
    return static_cast<std::uint32_t>(std::clamp(std::isnan(at) ? 0.0 : at, 0.0, static_cast<double>(side_ - 1)));
  };
  for (const mesh::Id c : list_) {
    Extent& e = extent_[c];
    for (std::size_t k = 0; k < 2; ++k) {
      e.first[k] = place(e.lower[k], k);
      e.last[k] = place(e.upper[k], k);
    }
    for (std::uint32_t y = e.first[1]; y <= e.last[1]; ++y) {
      for (std::uint32_t x = e.first[0]; x <= e.last[0]; ++x)
        window_[std::size_t{y} * side_ + x].push_back(c);
    }
  }
}

void Newell::halves(mesh::Id cell, const Viewpoint& viewpoint, std::vector<Half>& out) {
  out.clear();
  mesh::surface(mesh_, cell, surface_);
  for (const auto& t : surface_.triangles) {
    const Triangle corner{mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]]};
    out.push_back({corner, mesh::orientViewpoint(corner[0], corner[1], corner[2], viewpoint)});
  }
}

// Tests 2, 3, 1' and 2'; test 1 is made by the caller.
bool Newell::mayHide(mesh::Id a, mesh::Id b, const Viewpoint& viewpoint) const {
  const Extent &e = extent_[a], &f = extent_[b];
  for (std::size_t k = 0; k < 2; ++k) {
    if (e.upper[k] < f.lower[k] || f.upper[k] < e.lower[k]) return false;
  }
  if (viewpoint.w == 0.0) return true;
  const Vec3 p = centre_[a] - Vec3(viewpoint), q = centre_[b] - Vec3(viewpoint);
  const double dp = std::sqrt(dot(p, p)), dq = std::sqrt(dot(q, q));
  if (dp <= radius_[a] || dq <= radius_[b]) return true;
  // The cones to the spheres are disjoint when the angle between their axes exceeds the sum of their half angles.
  const double angle = std::acos(std::clamp(dot(p, q) / (dp * dq), -1.0, 1.0));
  return angle <= std::asin(radius_[a] / dp) + std::asin(radius_[b] / dq) + 1e-7;
}

bool Newell::hides(mesh::Id a, mesh::Id b, const Viewpoint& viewpoint) {
  if (!mayHide(a, b, viewpoint)) return false;
  halves(a, viewpoint, halves_a_);
  halves(b, viewpoint, halves_b_);
  // Test 4: all of b lies before a face of a that is turned towards the viewpoint; test 5: all of a lies behind one of
  // b that is turned away. Both speak of convex cells.
  const auto parts = [&](const std::vector<Half>& halves, int sign, mesh::Id other) {
    const auto vertices = mesh_.vertices(other);
    return std::any_of(halves.begin(), halves.end(), [&](const Half& h) {
      return h.sign == sign && std::all_of(vertices.begin(), vertices.end(), [&](mesh::Id v) {
               return mesh::orient3d(h.corner[0], h.corner[1], h.corner[2], mesh_.points[v]) >= 0;
             });
    });
  };
  if ((convex_[a] != 0 && parts(halves_a_, 1, b)) || (convex_[b] != 0 && parts(halves_b_, -1, a))) return false;
  for (const Half& exit : halves_a_) {
    if (exit.sign >= 0) continue;
    for (const Half& entry : halves_b_) {
      if (entry.sign <= 0) continue;
      if (!seenTogether(exit.corner, entry.corner, viewpoint, std::min(sliver(exit.corner), sliver(entry.corner))))
        continue;
      if (nearer(exit.corner, exit.sign, entry.corner, entry.sign, viewpoint) < 0) continue;
      if (projectionsOverlap(exit.corner, exit.sign, entry.corner, entry.sign, viewpoint)) return true;
    }
  }
  return false;
}

// A cell not yet listed that a hides, or none.
mesh::Id Newell::firstHidden(mesh::Id a, const Viewpoint& viewpoint) {
  const Extent& e = extent_[a];
  for (std::uint32_t y = e.first[1]; y <= e.last[1]; ++y) {
    for (std::uint32_t x = e.first[0]; x <= e.last[0]; ++x) {
      const std::size_t w = std::size_t{y} * side_ + x;
      auto& head = window_head_[w];
      while (head < window_[w].size() && listed_[window_[w][head]] != 0)
        ++head;
      for (std::size_t i = head; i < window_[w].size(); ++i) {
        const mesh::Id b = window_[w][i];
        // Test 1 for it and all that follow: windows keep the first order, which no move disturbs.
        if (extent_[b].farthest < e.nearest) break;
        if (b != a && listed_[b] == 0 && hides(a, b, viewpoint)) return b;
      }
    }
  }
  return mesh::none;
}

void Newell::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cells.clear();
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.exact = exact();
  measure(viewpoint);
  list_.resize(mesh_.cell_count());
  std::iota(list_.begin(), list_.end(), 0U);
  std::sort(list_.begin(), list_.end(), [&](mesh::Id a, mesh::Id b) {
    return extent_[a].farthest != extent_[b].farthest ? extent_[a].farthest > extent_[b].farthest : a < b;
  });
  moved_.assign(mesh_.cell_count(), 0);
  listed_.assign(mesh_.cell_count(), 0);
  windows();
  std::vector<mesh::Id> head;  // cells moved before the rest of the list, the first last
  for (std::size_t next = 0; next < list_.size() || !head.empty();) {
    const mesh::Id a = head.empty() ? list_[next] : head.back();
    if (listed_[a] != 0) {
      head.empty() ? static_cast<void>(++next) : head.pop_back();
      continue;
    }
    const mesh::Id hidden = firstHidden(a, viewpoint);
    if (hidden == mesh::none) {
      listed_[a] = 1;
      order.cells.push_back(a);
      continue;
    }
    if (head.empty()) moved_[a] = 1;
    if (moved_[hidden] != 0) {
      finish(viewpoint, order);
      return;
    }
    moved_[hidden] = 1;
    if (head.empty()) head.push_back(a);
    head.push_back(hidden);
  }
}

void Newell::finish(const Viewpoint& viewpoint, Order& order) {
  xmpvo_(viewpoint, rest_);
  appendUnlisted(rest_, listed_, order);
}

std::string Newell::why() const {
  return exact() ? "every pair of cells that could hide one another is tested exactly" : xmpvo_.why();
}

std::size_t Newell::bytes() const {
  std::size_t bytes = centre_.capacity() * sizeof(Vec3) + radius_.capacity() * sizeof(double) + convex_.capacity() +
                      extent_.capacity() * sizeof(Extent) + list_.capacity() * 4 + moved_.capacity() +
                      listed_.capacity() + xmpvo_.bytes();
  for (const auto& window : window_)
    bytes += window.capacity() * 4;
  return bytes;
}

}  // namespace spillikin::sort
