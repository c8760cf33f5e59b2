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

// NOLINTBEGIN(clang-analyzer-cplusplus.NewDeleteLeaks): counted references of the number type
std::array<Exact, 3> exactDifference(const Vec3& p, const Vec3& q) {
  return {Exact(p.x) - Exact(q.x), Exact(p.y) - Exact(q.y), Exact(p.z) - Exact(q.z)};
}
// NOLINTEND(clang-analyzer-cplusplus.NewDeleteLeaks)

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

// det of the 4 x 4 matrix of rows (r[i], h[i]): the height over the origin of the linear function with heights h at the
// points r, times their volume.
template <class T>
T liftedDeterminant(const std::array<std::array<T, 3>, 4>& r, const std::array<T, 4>& h) {
  return h[0] * determinant(r[1], r[2], r[3]) - h[1] * determinant(r[0], r[2], r[3]) +
         (h[2] * determinant(r[0], r[1], r[3]) - h[3] * determinant(r[0], r[1], r[2]));
}

// What rounding is measured by: every product with its magnitude.
double permanent(const Vec3& u, const Vec3& v, const Vec3& w) {
  return std::abs(u.x) * (std::abs(v.y * w.z) + std::abs(v.z * w.y)) +
         std::abs(u.y) * (std::abs(v.z * w.x) + std::abs(v.x * w.z)) +
         std::abs(u.z) * (std::abs(v.x * w.y) + std::abs(v.y * w.x));
}

std::array<double, 3> components(const Vec3& v) {
  return {v.x, v.y, v.z};
}

// The sign of what liftedDeterminant is not, or 2 when rounding hides it. The bound is that of Shewchuk's insphere
// test, stage A; heights that are a difference of doubles carry one rounding, fewer than the squares it counts with.
int filteredLift(const std::array<Vec3, 4>& r, const std::array<double, 4>& h) {
  const double value =
      liftedDeterminant<double>({components(r[0]), components(r[1]), components(r[2]), components(r[3])}, h);
  const double magnitude = std::abs(h[0]) * permanent(r[1], r[2], r[3]) + std::abs(h[1]) * permanent(r[0], r[2], r[3]) +
                           std::abs(h[2]) * permanent(r[0], r[1], r[3]) + std::abs(h[3]) * permanent(r[0], r[1], r[2]);
  constexpr double epsilon = 1.0 / 9007199254740992.0;  // 2^-53
  // Twice the published constant: his order of summation differs by one addition.
  const double bound = 2.0 * (16.0 + 224.0 * epsilon) * epsilon * magnitude;
  if (!(magnitude > 0x1p-700 && magnitude < 0x1p1000)) return 2;  // what underflowed would not be covered
  if (value > bound) return -1;
  if (-value > bound) return 1;
  return 2;
}

}  // namespace

int orient3dFiltered(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return filteredSign(b - a, c - a, d - a);
}

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const int sign = orient3dFiltered(a, b, c, d);
  if (sign != 2) return sign;
  return signOf(determinant(exactDifference(b, a), exactDifference(c, a), exactDifference(d, a)));
}

int orientDirection(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& v) {
  const int sign = filteredSign(b - a, c - a, v);
  if (sign != 2) return sign;
  return signOf(determinant(exactDifference(b, a), exactDifference(c, a), {Exact(v.x), Exact(v.y), Exact(v.z)}));
}

int orientEdge(const Vec3& a, const Vec3& b, const Vec3& u, const Vec3& v) {
  const int sign = filteredSign(b - a, u, v);
  if (sign != 2) return sign;
  return signOf(
      determinant(exactDifference(b, a), {Exact(u.x), Exact(u.y), Exact(u.z)}, {Exact(v.x), Exact(v.y), Exact(v.z)}));
}

double directionVolume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& v) {
  return CGAL::to_double(
      determinant(exactDifference(b, a), exactDifference(c, a), {Exact(v.x), Exact(v.y), Exact(v.z)}));
}

int aboveLift(const std::array<Vec3, 5>& points, const std::array<double, 5>& heights) {
  std::array<Vec3, 4> r;
  std::array<double, 4> h{};
  for (std::size_t i = 0; i < 4; ++i) {
    r[i] = points[i] - points[4];
    h[i] = heights[i] - heights[4];
  }
  const int sign = filteredLift(r, h);
  if (sign != 2) return sign;
  std::array<std::array<Exact, 3>, 4> exact;
  std::array<Exact, 4> height;
  for (std::size_t i = 0; i < 4; ++i) {
    exact[i] = exactDifference(points[i], points[4]);
    height[i] = Exact(heights[i]) - Exact(heights[4]);
  }
  return -signOf(liftedDeterminant(exact, height));
}

int aboveLift(const std::array<Vec3, 5>& points) {
  std::array<Vec3, 4> r;
  std::array<double, 4> h{};
  for (std::size_t i = 0; i < 4; ++i) {
    r[i] = points[i] - points[4];
    h[i] = r[i].x * r[i].x + r[i].y * r[i].y + r[i].z * r[i].z;
  }
  const int sign = filteredLift(r, h);
  if (sign != 2) return sign;
  std::array<std::array<Exact, 3>, 4> exact;
  std::array<Exact, 4> height;
  for (std::size_t i = 0; i < 4; ++i) {
    exact[i] = exactDifference(points[i], points[4]);
    height[i] = exact[i][0] * exact[i][0] + exact[i][1] * exact[i][1] + exact[i][2] * exact[i][2];
  }
  return -signOf(liftedDeterminant(exact, height));
}

}  // namespace spillikin::mesh
