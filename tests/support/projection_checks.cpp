#include "tests/support/projection_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace spillikin::tests {

namespace {

using Vec2 = glm::dvec2;

struct Crossing {
  double depth, value;
  bool leaves;
};

double triangleArea(const Vec2& a, const Vec2& b, const Vec2& c) {
  return 0.5 * ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
}

Vec2 position(const project::Regions& r, std::size_t v) {
  return {r.x[v], r.y[v]};
}

// Barycentric coordinates and weights of a rule of degree 5 on a triangle.
constexpr double rule[7][4] = {{1.0 / 3, 1.0 / 3, 1.0 / 3, 0.225},
                               {0.059715871789770, 0.470142064105115, 0.470142064105115, 0.132394152788506},
                               {0.470142064105115, 0.059715871789770, 0.470142064105115, 0.132394152788506},
                               {0.470142064105115, 0.470142064105115, 0.059715871789770, 0.132394152788506},
                               {0.797426985353087, 0.101286507323456, 0.101286507323456, 0.125939180544827},
                               {0.101286507323456, 0.797426985353087, 0.101286507323456, 0.125939180544827},
                               {0.101286507323456, 0.101286507323456, 0.797426985353087, 0.125939180544827}};

// The mean over a triangle of a function of barycentric coordinates, on 4^level parts.
template <typename F>
double mean(const std::array<std::array<double, 3>, 3>& corner, int level, const F& f) {
  double sum = 0.0;
  if (level == 0) {
    for (const auto& [a, b, c, weight] : rule) {
      std::array<double, 3> at{};
      for (std::size_t k = 0; k < 3; ++k) {
        at[k] = a * corner[0][k] + b * corner[1][k] + c * corner[2][k];
      }
      sum += weight * f(at);
    }
    return sum;
  }
  std::array<std::array<double, 3>, 3> half{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      half[i][k] = 0.5 * (corner[(i + 1) % 3][k] + corner[(i + 2) % 3][k]);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    sum += mean({corner[i], half[(i + 2) % 3], half[(i + 1) % 3]}, level - 1, f);
  }
  return 0.25 * (sum + mean(half, level - 1, f));
}

}  // namespace

std::vector<RayInterval> castRay(const mesh::Mesh& mesh, const mesh::Field& field, mesh::Id cell,
                                 const project::Camera& camera, double x, double y) {
  const Vec3 origin = camera.origin(x, y);
  const Vec3 direction = camera.direction(x, y);
  mesh::Surface surface;
  mesh::surface(mesh, cell, surface);
  std::vector<Crossing> crossings;
  for (const auto& [ia, ib, ic] : surface.triangles) {
    const Vec3 ab = mesh.points[ib] - mesh.points[ia];
    const Vec3 ac = mesh.points[ic] - mesh.points[ia];
    const Vec3 ao = origin - mesh.points[ia];
    const Vec3 normal = glm::cross(ab, ac);
    const double slope = glm::dot(normal, direction);
    const double depth = -glm::dot(normal, ao) / slope;
    const Vec3 p = ao + depth * direction;
    const double nn = glm::dot(normal, normal);
    const double b = glm::dot(glm::cross(p, ac), normal) / nn;
    const double c = glm::dot(glm::cross(ab, p), normal) / nn;
    if (slope == 0.0 || b < 0.0 || c < 0.0 || b + c > 1.0) {
      continue;
    }
    const auto value = [&](mesh::Id v) {
      return field.values[field.association == mesh::Association::cells ? cell : v];
    };
    crossings.push_back({depth, value(ia) + b * (value(ib) - value(ia)) + c * (value(ic) - value(ia)), slope > 0.0});
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) { return a.depth < b.depth; });
  std::vector<RayInterval> intervals;
  for (std::size_t k = 0; k + 1 < crossings.size(); ++k) {
    if (!crossings[k].leaves && crossings[k + 1].leaves) {
      intervals.push_back({crossings[k].depth, crossings[k + 1].depth, crossings[k].value, crossings[k + 1].value});
    }
  }
  return intervals;
}

double area(const project::Regions& regions, std::size_t polygon) {
  double sum = 0.0;
  const std::size_t first = regions.offset[polygon];
  for (std::size_t v = first + 1; v + 1 < regions.offset[polygon + 1]; ++v) {
    sum += triangleArea(position(regions, first), position(regions, v), position(regions, v + 1));
  }
  return sum;
}

double area(const project::Regions& regions) {
  double sum = 0.0;
  for (std::size_t p = 0; p < regions.polygons(); ++p) {
    sum += area(regions, p);
  }
  return sum;
}

double volume(const project::Regions& regions, const project::Camera& camera) {
  const double pixel = glm::length(glm::cross(camera.parallel() ? camera.originDx() : camera.directionDx(),
                                              camera.parallel() ? camera.originDy() : camera.directionDy()));
  double sum = 0.0;
  for (std::size_t p = 0; p < regions.polygons(); ++p) {
    const std::size_t a = regions.offset[p];
    for (std::size_t b = a + 1; b + 1 < regions.offset[p + 1]; ++b) {
      const std::size_t c = b + 1;
      const double base = triangleArea(position(regions, a), position(regions, b), position(regions, c));
      if (camera.parallel()) {
        sum += base * (regions.thickness[a] + regions.thickness[b] + regions.thickness[c]) / 3.0;
        continue;
      }
      const auto cube = [&](const std::vector<double>& depth, const std::array<double, 3>& at) {
        if (depth[a] == 0.0 && depth[b] == 0.0 && depth[c] == 0.0) {
          return 0.0;  // at the eye
        }
        const double w = 1.0 / (at[0] / depth[a] + at[1] / depth[b] + at[2] / depth[c]);
        return w * w * w / 3.0;
      };
      sum += base * mean({{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 3, [&](const std::array<double, 3>& at) {
               return cube(regions.back_depth, at) - cube(regions.front_depth, at);
             });
    }
  }
  return sum * pixel;
}

double hullArea(const mesh::Mesh& mesh, mesh::Id cell, const project::Camera& camera) {
  std::vector<Vec2> points;
  for (const mesh::Id v : mesh.vertices(cell)) {
    const Vec3 h = camera.toScreen(mesh.points[v]);
    points.push_back(camera.parallel() ? Vec2(h.x, h.y) : Vec2(h.x / h.z, h.y / h.z));
  }
  std::sort(points.begin(), points.end(),
            [](const Vec2& a, const Vec2& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  double sum = 0.0;
  for (int half = 0; half < 2; ++half) {
    std::vector<Vec2> chain;
    for (const Vec2& p : points) {
      while (chain.size() >= 2 && triangleArea(chain[chain.size() - 2], chain.back(), p) <= 0.0) {
        chain.pop_back();
      }
      chain.push_back(p);
    }
    for (std::size_t k = 1; k + 1 < chain.size(); ++k) {
      sum += triangleArea(chain[0], chain[k], chain[k + 1]);
    }
    std::reverse(points.begin(), points.end());
  }
  return sum;
}

double cellVolume(const mesh::Mesh& mesh, mesh::Id cell) {
  mesh::Surface surface;
  mesh::surface(mesh, cell, surface);
  const Vec3 origin = mesh.points[mesh.vertices(cell)[0]];
  double six = 0.0;
  for (const auto& [a, b, c] : surface.triangles) {
    six += glm::dot(mesh.points[a] - origin, glm::cross(mesh.points[b] - origin, mesh.points[c] - origin));
  }
  return six / 6.0;
}

bool contains(const project::Regions& regions, std::size_t polygon, double x, double y, double margin) {
  const std::size_t first = regions.offset[polygon];
  const std::size_t end = regions.offset[polygon + 1];
  for (std::size_t v = first; v < end; ++v) {
    const Vec2 a = position(regions, v);
    const Vec2 b = position(regions, v + 1 < end ? v + 1 : first);
    const double length = glm::distance(a, b);
    if (length > 1e-7 && 2.0 * triangleArea(a, b, {x, y}) < margin * length) {  // shorter edges have no direction
      return false;
    }
  }
  return true;
}

namespace {

// Barycentric coordinates of (x, y) in the triangle of the polygon's fan that holds it.
struct Place {
  std::array<std::size_t, 3> vertex{};
  std::array<double, 3> weight{};
};

Place placeIn(const project::Regions& regions, std::size_t polygon, double x, double y) {
  const std::size_t a = regions.offset[polygon];
  const Vec2 p(x, y);
  Place best;
  double best_inside = -1e300;
  for (std::size_t b = a + 1; b + 1 < regions.offset[polygon + 1]; ++b) {
    const std::size_t c = b + 1;
    const double whole = triangleArea(position(regions, a), position(regions, b), position(regions, c));
    const double wa = triangleArea(p, position(regions, b), position(regions, c)) / whole;
    const double wb = triangleArea(position(regions, a), p, position(regions, c)) / whole;
    const double inside = std::min({wa, wb, 1.0 - wa - wb});
    if (whole > 0.0 && inside > best_inside) {
      best = {{a, b, c}, {wa, wb, 1.0 - wa - wb}};
      best_inside = inside;
    }
  }
  return best;
}

}  // namespace

double depthAt(const project::Regions& regions, const std::vector<double>& depth, std::size_t polygon, double x,
               double y, bool parallel) {
  const Place place = placeIn(regions, polygon, x, y);
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double w = depth[place.vertex[k]];
    if (!parallel && w == 0.0) {
      return 0.0;  // at the eye, as all of the polygon
    }
    sum += place.weight[k] * (parallel ? w : 1.0 / w);
  }
  return parallel ? sum : 1.0 / sum;
}

double valueAt(const project::Regions& regions, const std::vector<double>& value, const std::vector<double>& depth,
               std::size_t polygon, double x, double y, bool parallel) {
  const Place place = placeIn(regions, polygon, x, y);
  double sum = 0.0;
  double total = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double weight = parallel ? place.weight[k] : place.weight[k] / depth[place.vertex[k]];
    sum += weight * value[place.vertex[k]];
    total += weight;
  }
  return sum / total;
}

mesh::Field pointField(std::vector<double> values) {
  mesh::Field field;
  field.values = std::move(values);
  return field;
}

mesh::Field linearField(const mesh::Mesh& mesh, const Vec3& gradient, double offset) {
  mesh::Field field;
  for (const Vec3& p : mesh.points) {
    field.values.push_back(glm::dot(gradient, p) + offset);
  }
  return field;
}

mesh::Field cellField(std::vector<double> values) {
  mesh::Field field;
  field.association = mesh::Association::cells;
  field.values = std::move(values);
  return field;
}

}  // namespace spillikin::tests
