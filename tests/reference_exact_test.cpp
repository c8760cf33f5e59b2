// Signs of edges and lines against rational arithmetic, and the rule for lines through edges and vertices.
#include <CGAL/Gmpq.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
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

// What a step of the line along a vector moves a point by in the plane of the shear.
Gmpq shearedStep(const Line& line, const Vec3& step, int axis) {
  return Gmpq(step[axis]) - Gmpq(step[line.k]) * Gmpq(line.d[axis]) / Gmpq(line.d[line.k]);
}

// The sign for an infinitely small positive e, by the definition.
int trueSide(const Line& line, const Vec3& p, const Vec3& q, Gmpq& value) {
  const Gmpq xp = sheared(line, p, line.i), yp = sheared(line, p, line.j), xq = sheared(line, q, line.i),
             yq = sheared(line, q, line.j);
  value = xp * yq - xq * yp;
  if (sign(value) != 0) return sign(value);
  for (const Vec3& step : {line.first, line.second}) {
    // (x_p - e u)(y_q - e v) - (x_q - e u)(y_p - e v) = value + e (v (x_q - x_p) - u (y_q - y_p)).
    const Gmpq u = shearedStep(line, step, line.i), v = shearedStep(line, step, line.j);
    const Gmpq moved = v * (xq - xp) - u * (yq - yp);
    if (sign(moved) != 0) return sign(moved);
  }
  return 0;
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
    const Vec3 from = point(), p = point(), q = point();
    Vec3 first = point(), second = point();
    const bool own = n % 2 == 0 && glm::dot(d, glm::cross(first, second)) != 0.0;
    const Line line = own ? Line(from, d, first, second) : Line(from, d);
    expectTrueSide(line, p, q);
    Gmpq value;
    zeros += trueSide(line, p, q, value) != 0 && sign(value) == 0 ? 1 : 0;
  }
  EXPECT_GT(zeros, 300);
}

}  // namespace
}  // namespace spillikin::tests
