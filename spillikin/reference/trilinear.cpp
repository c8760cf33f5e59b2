#include "spillikin/reference/trilinear.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace spillikin::reference {
namespace {

double largest(const Vec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

// Columns are the derivatives along the three parameters.
glm::dmat3 derivative(const Trilinear<Vec3>& map, const Vec3& at) {
  const auto& f = map.corner;
  const auto mix = [](const Vec3& a, const Vec3& b, double u) { return a + u * (b - a); };
  const auto bilinear = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double u, double v) {
    return mix(mix(a, b, u), mix(c, d, u), v);
  };
  return {bilinear(f[1] - f[0], f[3] - f[2], f[5] - f[4], f[7] - f[6], at.y, at.z),
          bilinear(f[2] - f[0], f[3] - f[1], f[6] - f[4], f[7] - f[5], at.x, at.z),
          bilinear(f[4] - f[0], f[5] - f[1], f[6] - f[2], f[7] - f[3], at.x, at.y)};
}

// Solves m x = b by Cramer's rule; false when m is singular to the last bits.
bool solve(const glm::dmat3& m, const Vec3& b, Vec3& x) {
  const Vec3 n = glm::cross(m[1], m[2]);
  const double determinant = glm::dot(m[0], n);
  if (!(std::abs(determinant) > 1e-300)) return false;
  x = Vec3(glm::dot(b, n), glm::dot(m[0], glm::cross(b, m[2])), glm::dot(m[0], glm::cross(m[1], b))) / determinant;
  return std::isfinite(x.x) && std::isfinite(x.y) && std::isfinite(x.z);
}

struct Box {
  Vec3 lo, size;
};

// The map on a box, as a map of the unit cube.
Trilinear<Vec3> restrict(const Trilinear<Vec3>& map, const Box& box) {
  Trilinear<Vec3> out;
  for (std::size_t n = 0; n < 8; ++n) {
    const Vec3 corner((n & 1U) != 0 ? 1.0 : 0.0, (n & 2U) != 0 ? 1.0 : 0.0, (n & 4U) != 0 ? 1.0 : 0.0);
    out.corner[n] = map(box.lo + box.size * corner);
  }
  return out;
}

bool excludes(const Trilinear<Vec3>& map, double tolerance) {
  Vec3 lo = map.corner[0], hi = map.corner[0];
  for (const Vec3& value : map.corner) {
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = std::min(lo[axis], value[axis]);
      hi[axis] = std::max(hi[axis], value[axis]);
    }
  }
  return lo.x > tolerance || lo.y > tolerance || lo.z > tolerance || hi.x < -tolerance || hi.y < -tolerance ||
         hi.z < -tolerance;
}

// Whether the map is one to one on the cube: its derivative, preconditioned by the one in the middle, stays within 1
// of the identity in the row-sum norm. Each column is bilinear, so that the four corners bound it.
bool oneToOne(const Trilinear<Vec3>& map) {
  const glm::dmat3 middle = derivative(map, Vec3(0.5));
  if (!(std::abs(glm::determinant(middle)) > 1e-300)) return false;
  const glm::dmat3 inverse = glm::inverse(middle);
  Vec3 row(0.0);
  for (int column = 0; column < 3; ++column) {
    const std::size_t bit = std::size_t{1} << column;
    Vec3 most(0.0);
    for (std::size_t n = 0; n < 8; ++n) {
      if ((n & bit) != 0) continue;
      Vec3 off = inverse * (map.corner[n | bit] - map.corner[n]);
      off[column] -= 1.0;
      for (int axis = 0; axis < 3; ++axis)
        most[axis] = std::max(most[axis], std::abs(off[axis]));
    }
    row += most;
  }
  return largest(row) < 1.0 - 1e-9;
}

// How far the image reaches along each parameter.
Vec3 extents(const Trilinear<Vec3>& map) {
  Vec3 out(0.0);
  for (int column = 0; column < 3; ++column) {
    const std::size_t bit = std::size_t{1} << column;
    for (std::size_t n = 0; n < 8; ++n) {
      if ((n & bit) == 0) out[column] = std::max(out[column], largest(map.corner[n | bit] - map.corner[n]));
    }
  }
  return out;
}

bool inside(const Vec3& at, double by) {
  return at.x >= -by && at.y >= -by && at.z >= -by && at.x <= 1.0 + by && at.y <= 1.0 + by && at.z <= 1.0 + by;
}

// Two Newton iterations that end this near to each other have found one root, in parameters.
constexpr double same_root = 1e-9;

void add(const Vec3& root, const Trilinear<Vec3>& map, double tolerance, std::vector<Vec3>& roots) {
  const auto same = [&](const Vec3& other) {
    return largest(root - other) < same_root || largest(map(0.5 * (root + other))) <= tolerance;
  };
  if (std::none_of(roots.begin(), roots.end(), same)) roots.push_back(root);
}

}  // namespace

bool newton(const Trilinear<Vec3>& map, double tolerance, Vec3& at) {
  constexpr int most_steps = 30;
  constexpr double step_bits = 1e-14, too_far = 4.0;
  Vec3 value = map(at);
  for (int n = 0; n < most_steps; ++n) {
    Vec3 step;
    if (largest(value) == 0.0) return true;
    if (!solve(derivative(map, at), value, step)) return largest(value) <= tolerance;
    at -= step;
    if (!inside(at, too_far)) return false;
    value = map(at);
    if (largest(step) < step_bits) return true;
  }
  return largest(value) <= tolerance;
}

bool findRoots(const Trilinear<Vec3>& map, double tolerance, std::vector<Vec3>& roots) {
  constexpr std::size_t most_boxes = 20000, most_waiting = 256;
  roots.clear();
  std::array<Box, most_waiting> waiting;
  std::size_t count = 0;
  waiting[count++] = {Vec3(0.0), Vec3(1.0)};
  for (std::size_t boxes = 0; count > 0; ++boxes) {
    if (boxes == most_boxes || count + 2 > most_waiting) return false;
    const Box box = waiting[--count];
    const Trilinear<Vec3> part = restrict(map, box);
    if (excludes(part, tolerance)) continue;
    if (oneToOne(part)) {
      Vec3 at(0.5);
      if (newton(part, tolerance, at)) {
        if (!inside(at, slack)) continue;
        add(box.lo + box.size * at, map, tolerance, roots);
        continue;
      }
    }
    const Vec3 extent = extents(part);
    if (largest(extent) <= tolerance) {
      add(box.lo + 0.5 * box.size, map, tolerance, roots);
      continue;
    }
    const int axis = extent.x >= extent.y ? (extent.x >= extent.z ? 0 : 2) : (extent.y >= extent.z ? 1 : 2);
    Box half = box;
    half.size[axis] *= 0.5;
    waiting[count++] = half;
    half.lo[axis] += half.size[axis];
    waiting[count++] = half;
  }
  return true;
}

}  // namespace spillikin::reference
