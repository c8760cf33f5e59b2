// Exact signs for a line against an edge: nonoverlapping floating-point expansions (Shewchuk 1997).
#pragma once

#include "spillikin/base/view.h"

namespace spillikin::reference {

// A line o + t d, and the axes of the shear that makes d the third axis: k is d's largest component and (i, j, k) an
// even permutation. In the plane of the shear a point p has the coordinates
//   x = (p - o)_i - (p - o)_k d_i / d_k,   y = (p - o)_j - (p - o)_k d_j / d_k.
struct Line {
  Line(const Vec3& origin, const Vec3& direction);
  // Ties are broken by moving the line along `first`, and less along `second`, both across its direction.
  Line(const Vec3& origin, const Vec3& direction, const Vec3& first, const Vec3& second);
  Vec3 o, d;
  Vec3 first{0.0}, second{0.0};  // left out, the shear's first two axes
  int i, j, k;
  double sx, sy;      // d_i / d_k, d_j / d_k, rounded
  double inverse_dd;  // 1 / d.d
  double length;      // |d|
};

// x_p y_q - x_q y_p from exact arithmetic, rounded once or twice at the end: its sign is exact and its relative error
// below 1e-15. Coordinates between 1e-90 and 1e90 (or 0) neither overflow nor lose bits. Cost: a few microseconds.
double exactEdge(const Line& line, const Vec3& p, const Vec3& q);

// The sign of the same for the line moved by e first + e^2 second, e positive and infinitely small, so that a line
// through an edge or a vertex passes every edge on one definite side. 0 only when the edge is parallel to the line (or
// has no length); the triangles of such an edge are never crossed. `value` receives exactEdge.
int perturbedSide(const Line& line, const Vec3& p, const Vec3& q, double& value);

}  // namespace spillikin::reference
