// Signs of edges and lines against rational arithmetic, and the rule for lines through edges and vertices.
#include <CGAL/Gmpq.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "spillikin/reference/exact.h"

namespace spillikin::tests {
namespace {

using CGAL::Gmpq;
using reference::Line;

Gmpq sheared(const Line& line, const Vec3& p, int axis) {
  return (Gmpq(p[axis]) - Gmpq(line.o[axis])) -
         (Gmpq(p[line.k]) - Gmpq(line.o[line.k])) * Gmpq(line.d[axis]) / Gmpq(line.d[line.k]);
}

int sign(const Gmpq& q) {
  return q > 0 ? 1 : q < 0 ? -1 : 0;
}

// The sign for an infinitely small positive e, by the definition.
int trueSide(const Line& line, const Vec3& p, const Vec3& q, Gmpq& value) {
  const Gmpq xp = sheared(line, p, line.i), yp = sheared(line, p, line.j), xq = sheared(line, q, line.i),
             yq = sheared(line, q, line.j);
  value = xp * yq - xq * yp;
  if (sign(value) != 0) return sign(value);
  if (sign(yq - yp) != 0) return -sign(yq - yp);
  return sign(xq - xp);
}

void expectTrueSide(const Line& line, const Vec3& p, const Vec3& q) {
  Gmpq truth;
  double value = 0.0, reversed = 0.0;
  const int side = trueSide(line, p, q, truth);
  ASSERT_EQ(reference::perturbedSide(line, p, q, value), side);
  ASSERT_EQ(reference::perturbedSide(line, q, p, reversed), -side);
  ASSERT_EQ(reversed, -value);
  const double expected = CGAL::to_double(truth);
  ASSERT_NEAR(value, expected, 1e-15 * std::abs(expected));
}

TEST(ReferenceExact, SidesAreThoseOfRationalArithmetic) {
  const std::uint64_t seed = 99;
  SCOPED_TRACE(fmt::format("seed {}", seed));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto point = [&](double scale) { return Vec3(uniform(random), uniform(random), uniform(random)) * scale; };
  for (int n = 0; n < 2000; ++n) {
    const double scale = std::pow(10.0, 8.0 * uniform(random));
    const Line line(point(scale), point(1.0));
    const Vec3 p = point(scale);
    expectTrueSide(line, p, point(scale));
    // Nearly and exactly through the line: points on it, rounded, and edges that they end.
    const Vec3 on = line.o + (scale * uniform(random)) * line.d;
    expectTrueSide(line, on, p);
    expectTrueSide(line, on, line.o + (scale * uniform(random)) * line.d);
    expectTrueSide(line, line.o, p);
    expectTrueSide(line, p, p + line.d);
  }
}

TEST(ReferenceExact, SmallIntegersAreFullOfZeros) {
  const std::uint64_t seed = 7;
  SCOPED_TRACE(fmt::format("seed {}", seed));
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<int> small(-2, 2);
  const auto point = [&] { return Vec3(small(random), small(random), small(random)); };
  int zeros = 0;
  for (int n = 0; n < 5000; ++n) {
    Vec3 d = point();
    if (d == Vec3(0.0)) d = Vec3(0, 0, -1);
    const Line line(point(), d);
    const Vec3 p = point(), q = point();
    expectTrueSide(line, p, q);
    Gmpq value;
    zeros += trueSide(line, p, q, value) != 0 && sign(value) == 0 ? 1 : 0;
  }
  EXPECT_GT(zeros, 300);
}

}  // namespace
}  // namespace spillikin::tests
