// Which of two triangles hides the other from a viewpoint, exactly.
#pragma once

#include <array>
#include <span>

#include "spillikin/base/view.h"

namespace spillikin::sort {

using Triangle = std::array<Vec3, 3>;

// Whether a ray passes through the insides of both as seen from the viewpoint: the cones over them (prisms in a
// parallel view) share a volume. `sign_a`, `sign_b` are the nonzero mesh::orientViewpoint of each. Two convex cones
// share no volume only if a plane through the viewpoint separates them, and then one through an edge of either does, or
// (where no half-space holds both) one through a corner of each. Signs of exact predicates only.
bool projectionsOverlap(const Triangle& a, int sign_a, const Triangle& b, int sign_b, const Viewpoint& viewpoint);

// For triangles whose projections overlap and that do not cross: 1 when a is nearer, -1 when b is, 0 where they
// coincide. Planes first (tests 4 and 5 of Newell, Newell and Sancha 1972), then corners within the other's projection
// and crossings of projected edges (Stein et al. 1994).
int nearer(const Triangle& a, int sign_a, const Triangle& b, int sign_b, const Viewpoint& viewpoint);

// Whether an edge of one passes through the inside of the other, at neither's border (exact).
bool cross(const Triangle& a, const Triangle& b);

// Whether what two convex polygons share as seen from the viewpoint is wider than `tolerance` (world units at their own
// distance), in double. A polygon that is itself seen thinner than that shares nothing.
bool seenTogether(std::span<const Vec3> a, std::span<const Vec3> b, const Viewpoint& viewpoint, double tolerance);
// Whether a polygon is seen wider than that.
bool seen(std::span<const Vec3> a, const Viewpoint& viewpoint, double tolerance);

// The width below which nothing is ordered: where faces are seen edge-on, their rounded corners overlap by such slivers
// in either order. A fraction of the polygon's extent, and the rounding of its coordinates.
double sliver(std::span<const Vec3> polygon);

}  // namespace spillikin::sort
