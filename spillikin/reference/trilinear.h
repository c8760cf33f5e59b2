// Trilinear maps of the unit cube and all their roots, by certified subdivision.
#pragma once

#include <array>
#include <vector>

#include "spillikin/base/view.h"

namespace spillikin::reference {

// The map with value corner[a + 2 b + 4 c] at the cube's corner (a, b, c). Corners may coincide: a wedge is the cube
// with an edge of its bottom and of its top collapsed, a pyramid the cube with its top collapsed, and their shape
// functions come out as they should.
template <class Value>
struct Trilinear {
  std::array<Value, 8> corner;

  // s0 + u (s1 - s0) throughout, so that a constant stays exactly itself.
  Value operator()(const Vec3& at) const {
    const auto mix = [](const Value& a, const Value& b, double u) { return a + u * (b - a); };
    const Value c0 = mix(mix(corner[0], corner[1], at.x), mix(corner[2], corner[3], at.x), at.y);
    const Value c1 = mix(mix(corner[4], corner[5], at.x), mix(corner[6], corner[7], at.x), at.y);
    return mix(c0, c1, at.z);
  }
};

// Newton's method for map(at) = 0 from `at`, which is overwritten. True when it arrived: the residual is below
// `tolerance` in every component or the step below the last bits of `at`.
bool newton(const Trilinear<Vec3>& map, double tolerance, Vec3& at);

// All roots of map in the unit cube (to `slack` outside of it). A box is dropped when a component keeps its sign on it
// (the corner values of the box are the map's Bernstein coefficients there, so they bound it), settled by Newton when
// the preconditioned derivative proves that it holds at most one root, cut across its longest direction (in the
// image) otherwise, and taken as a root when its image is smaller than `tolerance` (a collapsed edge or corner).
// Clears `roots`; false when the work was cut off, which takes a fold within rounding of the root.
inline constexpr double slack = 1e-12;
bool findRoots(const Trilinear<Vec3>& map, double tolerance, std::vector<Vec3>& roots);

}  // namespace spillikin::reference
