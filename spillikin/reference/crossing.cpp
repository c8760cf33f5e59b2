#include "spillikin/reference/crossing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace spillikin::reference {
namespace {

constexpr double unit_roundoff = std::numeric_limits<double>::epsilon() / 2.0;

double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// Sheared coordinates; false when all vertices lie on one side of an axis of the shear beyond rounding, so that the
// line misses the cell. `reach` is the largest component of a vertex relative to the line's origin: x and y are
// accurate to 6 unit roundoffs of it (two differences, the rounded shear and one product, |d_i / d_k| <= 1).
bool shear(const Line& line, const std::vector<Vec3>& points, std::span<const mesh::Id> vertices, CellScratch& s,
           double& reach) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double x_lo = infinity, x_hi = -infinity, y_lo = infinity, y_hi = -infinity;
  reach = 0.0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vec3& p = points[vertices[v]];
    const double a = p[line.i] - line.o[line.i], b = p[line.j] - line.o[line.j], c = p[line.k] - line.o[line.k];
    const double x = a - c * line.sx, y = b - c * line.sy;
    s.x[v] = x;
    s.y[v] = y;
    x_lo = std::min(x_lo, x);
    x_hi = std::max(x_hi, x);
    y_lo = std::min(y_lo, y);
    y_hi = std::max(y_hi, y);
    reach = std::max({reach, std::abs(a), std::abs(b), std::abs(c)});
  }
  const double e = 8.0 * unit_roundoff * reach;
  return x_lo <= e && x_hi >= -e && y_lo <= e && y_hi >= -e;
}

// Signed areas of all edges with their exact signs. With x, y off by 6 unit roundoffs u of reach, the product's
// difference is off by at most 6 u reach (|x_p| + |y_p| + |x_q| + |y_q|), its own rounding adds less than 4 u reach
// times that sum, and squares of u are covered by the rest of 16.
void sides(const Line& line, const std::vector<Vec3>& points, std::span<const mesh::Id> vertices,
           const Pattern& pattern, double reach, CellScratch& s) {
  const double u = 16.0 * unit_roundoff * reach;
  const double floor = u * u;
  for (std::size_t e = 0; e < pattern.edges.size(); ++e) {
    const auto [p, q] = pattern.edges[e];
    const double area = s.x[p] * s.y[q] - s.x[q] * s.y[p];
    const double error = u * (std::abs(s.x[p]) + std::abs(s.y[p]) + std::abs(s.x[q]) + std::abs(s.y[q])) + floor;
    s.edge[e] = area;
    s.error[e] = error;
    s.side[e] = static_cast<std::int8_t>((area > error) - (area < -error));
    if (s.side[e] != 0) continue;
    s.side[e] = static_cast<std::int8_t>(perturbedSide(line, points[vertices[p]], points[vertices[q]], s.edge[e]));
    s.error[e] = 0.0;
  }
}

// Orders the corners 0, 1, 2 by vertex id, so that both sides of a shared triangle compute the same bits.
std::array<std::size_t, 3> byId(const std::array<mesh::Id, 3>& id) {
  std::array<std::size_t, 3> order{0, 1, 2};
  if (id[order[0]] > id[order[1]]) std::swap(order[0], order[1]);
  if (id[order[1]] > id[order[2]]) std::swap(order[1], order[2]);
  if (id[order[0]] > id[order[1]]) std::swap(order[0], order[1]);
  return order;
}

// The place where the line crosses a triangle that it is known to cross.
Crossing place(const Line& line, const std::vector<Vec3>& points, std::span<const mesh::Id> vertices,
               const Pattern::Triangle& triangle, const double* values, const CellScratch& s) {
  std::array<mesh::Id, 3> id{};
  std::array<double, 3> area{};  // opposite to each corner
  double error = 0.0;
  for (std::size_t n = 0; n < 3; ++n) {
    id[n] = vertices[triangle.vertex[n]];
    const Local e = triangle.edge[(n + 1) % 3];
    area[n] = std::abs(s.edge[e]);
    error += s.error[e];
  }
  if (error > barycentric_tolerance * (area[0] + area[1] + area[2])) {
    for (std::size_t n = 0; n < 3; ++n) {
      area[n] = std::abs(exactEdge(line, points[id[(n + 1) % 3]], points[id[(n + 2) % 3]]));
    }
  }
  const auto [a, b, c] = byId(id);
  const double sum = area[a] + area[b] + area[c];
  const double wb = area[b] / sum, wc = area[c] / sum;
  const auto along = [&](std::size_t n) { return dot(points[id[n]] - line.o, line.d) * line.inverse_dd; };
  const double ta = along(a);
  Crossing crossing;
  crossing.t = ta + wb * (along(b) - ta) + wc * (along(c) - ta);
  crossing.face = triangle.face;
  if (values != nullptr) {
    const double sa = values[id[a]];
    crossing.scalar = sa + wb * (values[id[b]] - sa) + wc * (values[id[c]] - sa);
  }
  return crossing;
}

}  // namespace

void CellScratch::reserve(std::size_t vertices, std::size_t edges) {
  x.resize(vertices);
  y.resize(vertices);
  edge.resize(edges);
  error.resize(edges);
  side.resize(edges);
  crossings.reserve(16);
}

void cross(const Line& line, const std::vector<Vec3>& points, std::span<const mesh::Id> vertices,
           const Pattern& pattern, const double* values, CellScratch& s) {
  s.crossings.clear();
  double reach = 0.0;
  if (!shear(line, points, vertices, s, reach)) return;
  sides(line, points, vertices, pattern, reach, s);
  for (const Pattern::Triangle& triangle : pattern.triangles) {
    const int first = s.side[triangle.edge[0]] * triangle.turn[0];
    if (first == 0 || s.side[triangle.edge[1]] * triangle.turn[1] != first ||
        s.side[triangle.edge[2]] * triangle.turn[2] != first) {
      continue;
    }
    s.crossings.push_back(place(line, points, vertices, triangle, values, s));
    // The three sides add up to the triangle's normal times d, over d_k.
    s.crossings.back().leaving = (first > 0) == (line.d[line.k] > 0.0);
  }
  std::sort(s.crossings.begin(), s.crossings.end(), [](const Crossing& a, const Crossing& b) { return a.t < b.t; });
}

}  // namespace spillikin::reference
