#include "spillikin/sort/triangle_order.h"

#include <algorithm>
#include <cmath>

#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

// Corners that coincide, as those of neighbours do, need no arithmetic.
int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return d == a || d == b || d == c ? 0 : mesh::orient3d(a, b, c, d);
}

// A difference that double holds exactly, as between coordinates that were once floats.
bool exactDifference(double a, double b, double& d) {
  d = a - b;
  const double bb = a - d;
  return (a - (d + bb)) + (bb - b) == 0.0;
}

// The sign of p q - r s: rounding keeps order, and where the rounded products are equal their errors decide.
int sign2(double p, double q, double r, double s) {
  const double left = p * q, right = r * s;
  if (left != right) return left > right ? 1 : -1;
  const double l = std::fma(p, q, -left), r_error = std::fma(r, s, -right);
  return l > r_error ? 1 : l < r_error ? -1 : 0;
}

// Coordinates whose products neither overflow nor lose their errors to underflow.
bool moderate(double a) {
  return a == 0.0 || (std::abs(a) > 1e-100 && std::abs(a) < 1e100);
}

// mesh::orientViewpoint, with a shortcut for parallel views along an axis: there whole sheets of points lie behind one
// another, and the two-dimensional determinant is exact at once.
int orientViewpoint(const Vec3& a, const Vec3& b, const Vec3& c, const Viewpoint& v) {
  if (c == a || c == b) return 0;
  if (v.w == 0.0) {
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      if (v[i] != 0.0 || v[j] != 0.0) continue;
      double bi, bj, ci, cj;
      const bool exact = exactDifference(b[i], a[i], bi) && exactDifference(b[j], a[j], bj) &&
                         exactDifference(c[i], a[i], ci) && exactDifference(c[j], a[j], cj) && moderate(bi) &&
                         moderate(bj) && moderate(ci) && moderate(cj);
      if (!exact) break;
      return sign2(bi, cj, bj, ci) * (v[k] > 0.0 ? 1 : -1);
    }
  }
  return mesh::orientViewpoint(a, b, c, v);
}

double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// An edge of a, taken around it, has a itself on the side sign_a; does it leave b on the other?
bool edgeSeparates(const Triangle& a, int sign_a, const Triangle& b, const Viewpoint& v) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &p = a[i], &q = a[(i + 1) % 3];
    bool apart = true;
    for (std::size_t k = 0; k < 3 && apart; ++k)
      apart = orientViewpoint(p, q, b[k], v) * sign_a <= 0;
    if (apart) return true;
  }
  return false;
}

// Does one open half-space bounded by a plane through the eye certainly hold both?
bool inOneHalfSpace(const Triangle& a, const Triangle& b, const Viewpoint& v) {
  if (v.w == 0.0) return true;
  const Vec3 eye(v);
  const Vec3 axis = (a[0] - eye) + (a[1] - eye) + (a[2] - eye);
  const double length = dot(axis, axis);
  constexpr double margin = 1e-12;  // of the squared length: far above the rounding of a dot product
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 p = a[k] - eye, q = b[k] - eye;
    if (!(dot(p, axis) > 0.0 && dot(p, axis) * dot(p, axis) > margin * length * dot(p, p))) return false;
    if (!(dot(q, axis) > 0.0 && dot(q, axis) * dot(q, axis) > margin * length * dot(q, q))) return false;
  }
  return true;
}

bool cornersSeparate(const Triangle& a, const Triangle& b, const Viewpoint& v) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      int low = 0, high = 0;  // the side of a must be one, that of b the other
      for (std::size_t k = 0; k < 3; ++k) {
        const int s = k == i ? 0 : orientViewpoint(a[i], b[j], a[k], v);
        const int t = k == j ? 0 : orientViewpoint(a[i], b[j], b[k], v);
        if (s < 0 || t > 0) low = 1;
        if (s > 0 || t < 0) high = 1;
      }
      if (low + high == 1) return true;
    }
  }
  return false;
}

bool within(const Triangle& a, int sign_a, const Vec3& p, const Viewpoint& v) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (orientViewpoint(a[i], a[(i + 1) % 3], p, v) * sign_a < 0) return false;
  }
  return true;
}

// The nearer of two edges whose projections cross inside, 0 when they do not or when they meet: the tetrahedron of
// their ends has the orientation of the crossing when the first is nearer.
int nearerEdge(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s, const Viewpoint& v) {
  const int pq_r = orientViewpoint(p, q, r, v), pq_s = orientViewpoint(p, q, s, v);
  if (pq_r * pq_s >= 0) return 0;
  if (orientViewpoint(r, s, p, v) * orientViewpoint(r, s, q, v) >= 0) return 0;
  return orient3d(p, q, r, s) * pq_s;
}

// A plane through the viewpoint and the edge from p to q, its normal not of length 1, and the height over it that
// counts as none.
struct EyePlane {
  Vec3 normal;
  double bound;
  bool firm;  // an edge seen end-on has no plane that rounding leaves in place
  EyePlane(const Vec3& p, const Vec3& q, const Viewpoint& v, double tolerance) {
    constexpr double least_sine = 1e-6;
    const Vec3 e = q - p, sight = v.w == 0.0 ? Vec3(v) : Vec3(v) - p;
    normal = Vec3(e.y * sight.z - e.z * sight.y, e.z * sight.x - e.x * sight.z, e.x * sight.y - e.y * sight.x);
    const double length = std::sqrt(dot(normal, normal));
    firm = length > least_sine * std::sqrt(dot(e, e) * dot(sight, sight));
    bound = tolerance * length;
  }
};

// Does a plane through the viewpoint and an edge of a part them?
bool apart(std::span<const Vec3> a, std::span<const Vec3> b, const Viewpoint& v, double tolerance) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    const Vec3& p = a[k];
    const EyePlane plane(p, a[(k + 1) % a.size()], v, tolerance);
    if (!plane.firm) continue;
    const auto sides = [&](std::span<const Vec3> polygon) {
      bool above = false, below = false;
      for (const Vec3& r : polygon) {
        const double h = dot(plane.normal, r - p);
        above = above || h > plane.bound;
        below = below || h < -plane.bound;
      }
      return above && below ? 0 : above ? 1 : below ? -1 : 2;
    };
    const int s = sides(a), t = sides(b);
    if (s == 2 || t == 2 || s * t < 0) return true;
  }
  return false;
}

bool passesThrough(const Vec3& p, const Vec3& q, const Triangle& t) {
  if (orient3d(t[0], t[1], t[2], p) * orient3d(t[0], t[1], t[2], q) >= 0) return false;
  const int s = mesh::orient3d(p, q, t[0], t[1]);
  return s != 0 && mesh::orient3d(p, q, t[1], t[2]) == s && mesh::orient3d(p, q, t[2], t[0]) == s;
}

}  // namespace

bool cross(const Triangle& a, const Triangle& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (passesThrough(a[k], a[(k + 1) % 3], b) || passesThrough(b[k], b[(k + 1) % 3], a)) return true;
  }
  return false;
}

bool seen(std::span<const Vec3> a, const Viewpoint& viewpoint, double tolerance) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    const Vec3& p = a[k];
    const EyePlane plane(p, a[(k + 1) % a.size()], viewpoint, tolerance);
    const auto off = [&](const Vec3& r) { return std::abs(dot(plane.normal, r - p)) > plane.bound; };
    if (plane.firm && std::none_of(a.begin(), a.end(), off)) return false;
  }
  return true;
}

bool seenTogether(std::span<const Vec3> a, std::span<const Vec3> b, const Viewpoint& viewpoint, double tolerance) {
  return !apart(a, b, viewpoint, tolerance) && !apart(b, a, viewpoint, tolerance);
}

double sliver(std::span<const Vec3> polygon) {
  constexpr double thin = 1e-9, rounding = 1e-14;
  double extent = 0.0, largest = 0.0;
  for (const Vec3& p : polygon) {
    for (int k = 0; k < 3; ++k) {
      extent = std::max(extent, std::abs(p[k] - polygon[0][k]));
      largest = std::max(largest, std::abs(p[k]));
    }
  }
  return std::max(thin * extent, rounding * largest);
}

bool projectionsOverlap(const Triangle& a, int sign_a, const Triangle& b, int sign_b, const Viewpoint& viewpoint) {
  if (edgeSeparates(a, sign_a, b, viewpoint) || edgeSeparates(b, sign_b, a, viewpoint)) return false;
  return inOneHalfSpace(a, b, viewpoint) || !cornersSeparate(a, b, viewpoint);
}

int nearer(const Triangle& a, int sign_a, const Triangle& b, int sign_b, const Viewpoint& viewpoint) {
  // Sides of the other's plane, 1 where the viewpoint is.
  int b_of_a[3], a_of_b[3];
  bool b_near = false, b_far = false, a_near = false, a_far = false;
  for (std::size_t k = 0; k < 3; ++k) {
    b_of_a[k] = orient3d(a[0], a[1], a[2], b[k]) * sign_a;
    b_near = b_near || b_of_a[k] > 0;
    b_far = b_far || b_of_a[k] < 0;
  }
  if (b_near != b_far) return b_far ? 1 : -1;
  for (std::size_t k = 0; k < 3; ++k) {
    a_of_b[k] = orient3d(b[0], b[1], b[2], a[k]) * sign_b;
    a_near = a_near || a_of_b[k] > 0;
    a_far = a_far || a_of_b[k] < 0;
  }
  if (a_near != a_far) return a_near ? 1 : -1;
  if (!b_near) return 0;  // one plane
  for (std::size_t k = 0; k < 3; ++k) {
    if (b_of_a[k] != 0 && within(a, sign_a, b[k], viewpoint)) return -b_of_a[k];
    if (a_of_b[k] != 0 && within(b, sign_b, a[k], viewpoint)) return a_of_b[k];
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const int s = nearerEdge(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3], viewpoint);
      if (s != 0) return s;
    }
  }
  return 0;
}

}  // namespace spillikin::sort
