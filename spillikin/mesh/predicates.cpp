#include "spillikin/mesh/predicates.h"

#include <CGAL/Exact_rational.h>
#include <CGAL/Mpzf.h>

#include <array>
#include <cmath>

namespace spillikin::mesh {
namespace {

// Exact sums and products of doubles.
#ifdef CGAL_HAS_MPZF
using Exact = CGAL::Mpzf;
#else
using Exact = CGAL::Exact_rational;
#endif

template <class T>
T determinant(const std::array<T, 3>& u, const std::array<T, 3>& v, const std::array<T, 3>& w) {
  return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
}

std::array<Exact, 3> exactDifference(const Vec3& p, const Vec3& q) {
  // NOLINTNEXTLINE(clang-analyzer-cplusplus.NewDeleteLeaks): counted references of the number type
  return {Exact(p.x) - Exact(q.x), Exact(p.y) - Exact(q.y), Exact(p.z) - Exact(q.z)};
}

int signOf(const Exact& value) {
  return static_cast<int>(CGAL::sign(value));
}

// Sign of det[u, v, w], where the components carry at most one rounding of their own, or 2 when rounding hides it.
// The bound is that of Shewchuk's orientation test (Adaptive Precision Floating-Point Arithmetic, 1997, stage A).
int filteredSign(const Vec3& u, const Vec3& v, const Vec3& w) {
  const double vywz = v.y * w.z, vzwy = v.z * w.y, vzwx = v.z * w.x, vxwz = v.x * w.z, vxwy = v.x * w.y,
               vywx = v.y * w.x;
  const double det = u.x * (vywz - vzwy) + u.y * (vzwx - vxwz) + u.z * (vxwy - vywx);
  const double magnitude = std::abs(u.x) * (std::abs(vywz) + std::abs(vzwy)) +
                           std::abs(u.y) * (std::abs(vzwx) + std::abs(vxwz)) +
                           std::abs(u.z) * (std::abs(vxwy) + std::abs(vywx));
  constexpr double epsilon = 1.0 / 9007199254740992.0;  // 2^-53
  constexpr double relative = (7.0 + 56.0 * epsilon) * epsilon;
  // Products that underflow lose up to 2^-1074 each, times a factor of u: what the second term covers amply.
  const double bound = relative * magnitude + 0x1p-1000 * (std::abs(u.x) + std::abs(u.y) + std::abs(u.z));
  if (magnitude > 0x1p-900) {
    if (det > bound) return 1;
    if (-det > bound) return -1;
    return 2;
  }
  // Grids seen along an axis: every product has a factor that is exactly 0.
  const auto zero = [](double a, double b, double c) { return a == 0.0 || b == 0.0 || c == 0.0; };
  const bool vanishes = zero(u.x, v.y, w.z) && zero(u.x, v.z, w.y) && zero(u.y, v.z, w.x) && zero(u.y, v.x, w.z) &&
                        zero(u.z, v.x, w.y) && zero(u.z, v.y, w.x);
  return vanishes ? 0 : 2;
}

}  // namespace

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const int sign = filteredSign(b - a, c - a, d - a);
  if (sign != 2) return sign;
  return signOf(determinant(exactDifference(b, a), exactDifference(c, a), exactDifference(d, a)));
}

int orientDirection(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& v) {
  const int sign = filteredSign(b - a, c - a, v);
  if (sign != 2) return sign;
  return signOf(determinant(exactDifference(b, a), exactDifference(c, a), {Exact(v.x), Exact(v.y), Exact(v.z)}));
}

}  // namespace spillikin::mesh
