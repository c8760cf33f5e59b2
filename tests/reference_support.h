// What the tests of the ground truth share: meshes of one call, closed-form chords, transfer functions.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/reference/rays.h"
#include "spillikin/reference/reference.h"
#include "support/meshes.h"

namespace spillikin::tests {

struct Scene {
  explicit Scene(const mesh::Source& source, const std::string& field_name = "")
      : mesh(mesh::build(source)), field(mesh::selectField(source, mesh, field_name)), caster(mesh, field) {}
  mesh::Mesh mesh;
  mesh::Field field;
  reference::RayCaster caster;
};

inline integrate::TransferFunction constantMedium(double extinction, double gray = 1.0) {
  return integrate::TransferFunction({{0.0, {gray, gray, gray}, extinction}});
}

// Grey rises from 0 to 1 and extinction from 0.2 to `most` over [lo, hi].
inline integrate::TransferFunction ramp(double lo, double hi, double most) {
  return integrate::TransferFunction({{lo, {0.0, 0.3, 1.0}, 0.2}, {hi, {1.0, 0.6, 0.0}, most}});
}

// World length of the part of a ray inside the box [lo, hi] and in front of the eye (perspective).
inline double boxChord(const reference::Ray& ray, const Vec3& lo, const Vec3& hi, bool eye) {
  double enter = eye ? 0.0 : -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double o = ray.origin[axis], d = ray.direction[axis];
    if (d == 0.0) {
      if (o < lo[axis] || o > hi[axis]) return 0.0;
      continue;
    }
    const double a = (lo[axis] - o) / d, b = (hi[axis] - o) / d;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  const Vec3& d = ray.direction;
  return std::max(0.0, leave - enter) * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

inline double totalLength(const std::vector<reference::Interval>& intervals) {
  double sum = 0.0;
  for (const reference::Interval& i : intervals)
    sum += i.leave - i.enter;
  return sum;
}

inline View lookAt(const Vec3& eye, const Vec3& target, int width, int height) {
  View view;
  view.eye = eye;
  view.target = target;
  view.width = width;
  view.height = height;
  return view;
}

}  // namespace spillikin::tests
