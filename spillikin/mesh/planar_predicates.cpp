#include "spillikin/mesh/planar_predicates.h"

#include <CGAL/Exact_rational.h>
#include <CGAL/Mpzf.h>

#include <cmath>

namespace spillikin::mesh {
namespace {

// Exact sums and products of doubles.
#ifdef CGAL_HAS_MPZF
using Exact = CGAL::Mpzf;
#else
using Exact = CGAL::Exact_rational;
#endif

constexpr double epsilon = 0x1p-53;
constexpr double smallest = 0x1p-1000;  // above anything that underflow can lose

Exact exactCross(const Vec2& a0, const Vec2& a1, const Vec2& b0, const Vec2& b1) {
  return (Exact(a1.x) - Exact(a0.x)) * (Exact(b1.y) - Exact(b0.y)) -
         (Exact(a1.y) - Exact(a0.y)) * (Exact(b1.x) - Exact(b0.x));
}

int signOf(const Exact& value) {
  return static_cast<int>(CGAL::sign(value));
}

// The cross product with its sign. The bound (3 + 16 eps) eps (|l| + |r|) is that of Shewchuk's 2D orientation test
// (1997, stage A), rounded up.
SignedArea cross(const Vec2& a0, const Vec2& a1, const Vec2& b0, const Vec2& b1) {
  const double l = (a1.x - a0.x) * (b1.y - b0.y);
  const double r = (a1.y - a0.y) * (b1.x - b0.x);
  SignedArea area;
  area.value = l - r;
  area.error = 4.0 * epsilon * (std::fabs(l) + std::fabs(r)) + smallest;
  if (std::fabs(area.value) > area.error) {
    area.sign = area.value > 0.0 ? 1 : -1;
    return area;
  }
  const bool left_vanishes = a1.x == a0.x || b1.y == b0.y;
  const bool right_vanishes = a1.y == a0.y || b1.x == b0.x;
  if (!(left_vanishes && right_vanishes)) {
    area.sign = signOf(exactCross(a0, a1, b0, b1));
  }
  if (area.sign == 0) {
    area.value = area.error = 0.0;
  }
  return area;
}

}  // namespace

SignedArea signedArea(const Vec2& a, const Vec2& b, const Vec2& c) {
  return cross(a, b, a, c);
}

int crossSign(const Vec2& a0, const Vec2& a1, const Vec2& b0, const Vec2& b1) {
  return cross(a0, a1, b0, b1).sign;
}

int sideOfCrossing(const Line& e, const Line& f, const Line& g, const SignedArea& e_f0, const SignedArea& e_f1,
                   const SignedArea& g_f0, const SignedArea& g_f1) {
  if (e_f0.sign >= 0 && e_f1.sign >= 0) {
    return e_f0.sign + e_f1.sign > 0 ? 1 : 0;
  }
  if (e_f0.sign <= 0 && e_f1.sign <= 0) {
    return -1;
  }
  const double w0 = std::fabs(g_f1.value);
  const double w1 = std::fabs(g_f0.value);
  const double l = e_f0.value * w0;
  const double r = e_f1.value * w1;
  const double sum = l + r;
  const double bound = std::fabs(e_f0.value) * g_f1.error + w0 * e_f0.error + g_f1.error * e_f0.error +
                       std::fabs(e_f1.value) * g_f0.error + w1 * e_f1.error + g_f0.error * e_f1.error +
                       4.0 * epsilon * (std::fabs(l) + std::fabs(r)) + smallest;
  if (std::fabs(sum) > 2.0 * bound) {  // twice: the bound itself was rounded
    return sum > 0.0 ? 1 : -1;
  }
  // G(f0) and G(f1) have opposite signs: the sign of E(f0) G(f1) - E(f1) G(f0), turned by that of G(f1).
  const Exact exact = exactCross(e.a, e.b, e.a, f.a) * exactCross(g.a, g.b, g.a, f.b) -
                      exactCross(e.a, e.b, e.a, f.b) * exactCross(g.a, g.b, g.a, f.a);
  return g_f1.sign * signOf(exact);
}

double crossingParameter(const Line& f, const Line& g, const SignedArea& g_f0, const SignedArea& g_f1) {
  constexpr double accurate = 1e-14;  // of the segment's length
  double from = std::fabs(g_f0.value);
  double to = std::fabs(g_f1.value);
  if (g_f0.error + g_f1.error > accurate * (from + to)) {
    from = std::fabs(CGAL::to_double(exactCross(g.a, g.b, g.a, f.a)));
    to = std::fabs(CGAL::to_double(exactCross(g.a, g.b, g.a, f.b)));
  }
  return from / (from + to);
}

}  // namespace spillikin::mesh
