#include "spillikin/reference/edge_on.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "spillikin/reference/rays.h"

namespace spillikin::reference {
namespace {

// How near a pixel's centre must be to the projected face, in pixels.
constexpr double nearness = 1.0 / 256.0;
// Where a triangle reaches behind the eye, it is cut at this part of its farthest depth before it is projected.
constexpr double least_depth = 1e-9;

struct Point {
  double x, y;
};
double cross(const Point& a, const Point& b) {
  return a.x * b.y - a.y * b.x;
}
Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y};
}

// World to image position.
class Projection {
 public:
  explicit Projection(const View& view) : view_(view), rays_(view) {
    // The formula of a ray is affine in x and y, so its values at three places give the frame.
    const Ray corner = rays_(0.0, 0.0), across = rays_(1.0, 0.0), down = rays_(0.0, 1.0);
    const bool parallel = view.parallel();
    const Vec3 dx = parallel ? across.origin - corner.origin : across.direction - corner.direction;
    const Vec3 dy = parallel ? down.origin - corner.origin : down.direction - corner.direction;
    x_ = dx / glm::dot(dx, dx);
    y_ = dy / glm::dot(dy, dy);
  }
  double depth(const Vec3& p) const { return glm::dot(p - view_.eye, rays_.forward()); }
  Point operator()(const Vec3& p) const {
    const double scale = view_.parallel() ? 1.0 : 1.0 / depth(p);
    const Vec3 v = p - view_.eye;
    return {view_.width / 2.0 + glm::dot(v, x_) * scale, view_.height / 2.0 + glm::dot(v, y_) * scale};
  }
  bool parallel() const { return view_.parallel(); }

 private:
  const View& view_;
  Rays rays_;
  Vec3 x_{0.0}, y_{0.0};
};

// The corners of a triangle in front of the eye, 0, 3 or 4 of them.
struct Polygon {
  std::array<Vec3, 4> corner;
  std::size_t size = 0;
};

Polygon inFront(const Projection& projection, const std::array<Vec3, 3>& triangle) {
  Polygon out;
  std::array<double, 3> depth{};
  double farthest = 0.0;
  for (std::size_t n = 0; n < 3; ++n) {
    depth[n] = projection.depth(triangle[n]);
    farthest = std::max(farthest, depth[n]);
  }
  const double plane = least_depth * farthest;
  const auto inside = [&](std::size_t n) { return projection.parallel() || (farthest > 0.0 && depth[n] > plane); };
  for (std::size_t n = 0; n < 3; ++n) {
    const std::size_t m = (n + 1) % 3;
    if (inside(n)) out.corner[out.size++] = triangle[n];
    if (inside(n) != inside(m)) {
      out.corner[out.size++] = glm::mix(triangle[n], triangle[m], (plane - depth[n]) / (depth[m] - depth[n]));
    }
  }
  return out;
}

// The segment that a polygon projects to, as its two farthest corners; false when it is wider than `width` pixels.
bool edgeOn(const Projection& projection, const Polygon& polygon, double width, std::array<Point, 2>& segment) {
  std::array<Point, 4> at{};
  for (std::size_t n = 0; n < polygon.size; ++n)
    at[n] = projection(polygon.corner[n]);
  double longest = -1.0;
  for (std::size_t n = 0; n < polygon.size; ++n) {
    for (std::size_t m = 0; m < n; ++m) {
      const double length = std::hypot(at[n].x - at[m].x, at[n].y - at[m].y);
      if (length > longest) {
        longest = length;
        segment = {at[m], at[n]};
      }
    }
  }
  const Point along = segment[1] - segment[0];
  for (std::size_t n = 0; n < polygon.size; ++n) {
    if (std::abs(cross(along, at[n] - segment[0])) > width * longest) return false;
  }
  return true;
}

// The part of segment a + s (b - a) with one coordinate in [lo, hi]; narrows [s0, s1].
bool within(double a, double b, double lo, double hi, double& s0, double& s1) {
  if (a == b) return a >= lo && a <= hi;
  const double first = (lo - a) / (b - a), second = (hi - a) / (b - a);
  s0 = std::max(s0, std::min(first, second));
  s1 = std::min(s1, std::max(first, second));
  return s0 <= s1;
}

// Marks the pixels whose centre lies within `nearness` of the segment, walking along its longer axis.
void mark(const std::array<Point, 2>& segment, const View& view, std::vector<std::uint8_t>& mask) {
  Point a = segment[0], b = segment[1];
  double s0 = 0.0, s1 = 1.0;
  if (!within(a.x, b.x, -1.0, view.width + 1.0, s0, s1) || !within(a.y, b.y, -1.0, view.height + 1.0, s0, s1)) return;
  const Point along = b - a;
  b = {a.x + s1 * along.x, a.y + s1 * along.y};
  a = {a.x + s0 * along.x, a.y + s0 * along.y};
  const bool steep = std::abs(b.y - a.y) > std::abs(b.x - a.x);
  const double from = steep ? std::min(a.y, b.y) : std::min(a.x, b.x),
               to = steep ? std::max(a.y, b.y) : std::max(a.x, b.x);
  const double squared = (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y);
  for (double n = std::floor(from - 1.0); n <= to + 1.0; n += 1.0) {
    const double centre = n + 0.5;
    const double s =
        to > from ? std::clamp((centre - (steep ? a.y : a.x)) / (steep ? b.y - a.y : b.x - a.x), 0.0, 1.0) : 0.0;
    const double other = std::floor(steep ? a.x + s * (b.x - a.x) : a.y + s * (b.y - a.y));
    for (double m = other - 1.0; m <= other + 1.0; m += 1.0) {
      const Point p = steep ? Point{m + 0.5, centre} : Point{centre, m + 0.5};
      if (p.x < 0.0 || p.y < 0.0 || p.x >= view.width || p.y >= view.height) continue;
      const double foot =
          squared > 0.0 ? std::clamp(((p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y)) / squared, 0.0, 1.0) : 0.0;
      const double distance = std::hypot(p.x - a.x - foot * (b.x - a.x), p.y - a.y - foot * (b.y - a.y));
      if (distance > nearness) continue;
      mask[static_cast<std::size_t>(p.y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(p.x)] = 1;
    }
  }
}

}  // namespace

std::vector<std::uint8_t> edgeOnMask(const mesh::Mesh& mesh, const View& view, double width) {
  const Projection projection(view);
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height), 0);
  const auto look = [&](mesh::Id a, mesh::Id b, mesh::Id c) {
    const Polygon polygon = inFront(projection, {mesh.points[a], mesh.points[b], mesh.points[c]});
    std::array<Point, 2> segment{};
    if (polygon.size >= 3 && edgeOn(projection, polygon, width, segment)) mark(segment, view, mask);
  };
  for (std::size_t f = 0; f < mesh.triangle_count(); ++f) {
    if (mesh.triangle_cells[f][1] != mesh::none) continue;
    look(mesh.triangle[f][0], mesh.triangle[f][1], mesh.triangle[f][2]);
  }
  for (std::size_t f = 0; f < mesh.quad_count(); ++f) {
    if (mesh.quad_cells[f][1] != mesh::none) continue;
    look(mesh.quad[f][0], mesh.quad[f][1], mesh.quad[f][2]);
    look(mesh.quad[f][0], mesh.quad[f][2], mesh.quad[f][3]);
  }
  return mask;
}

}  // namespace spillikin::reference
