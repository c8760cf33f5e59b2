// Exact orientation tests: the sign is that of the exact value for the given doubles, whatever the rounding.
#pragma once

#include <array>

#include "spillikin/base/view.h"

namespace spillikin::mesh {

// Sign (-1, 0, 1) of det[b - a, c - a, d - a]: positive when the triangle a, b, c turns counterclockwise seen from d,
// that is, d lies on the side its right-hand normal points to. A floating-point filter, then exact arithmetic (CGAL).
// Cost: some 30 flops when the filter decides, about a microsecond otherwise. Arguments must be finite.
int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// The same where the filter decides, or 2: for callers that can do without an answer.
int orient3dFiltered(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Sign of det[b - a, c - a, v]: on which side of the plane direction v leads.
int orientDirection(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& v);
// Sign of det[b - a, u, v].
int orientEdge(const Vec3& a, const Vec3& b, const Vec3& u, const Vec3& v);
// det[b - a, c - a, v] itself, exact but for the rounding to a double. About a microsecond.
double directionVolume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& v);

// Of five points, the first four a tetrahedron of positive volume: the sign of the fifth's height above the linear
// function that has the heights of the first four. With the squares of the points' lengths for heights (the second
// form), 1 means that the fifth lies outside the circumsphere of the others, 0 on it, -1 inside. Cost: some 100 flops
// when the filter decides, a few microseconds otherwise.
int aboveLift(const std::array<Vec3, 5>& points, const std::array<double, 5>& heights);
int aboveLift(const std::array<Vec3, 5>& points);

// orient3d and orientDirection by the homogeneous viewpoint: w == 1 a point, w == 0 a direction.
inline int orientViewpoint(const Vec3& a, const Vec3& b, const Vec3& c, const Viewpoint& v) {
  return v.w == 0.0 ? orientDirection(a, b, c, Vec3(v)) : orient3d(a, b, c, Vec3(v));
}

}  // namespace spillikin::mesh
