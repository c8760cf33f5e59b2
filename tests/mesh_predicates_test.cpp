// Orientation against rational arithmetic, where rounding would decide wrongly.
#include "spillikin/mesh/predicates.h"

#include <CGAL/Exact_rational.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace spillikin::mesh {
namespace {

using Rational = CGAL::Exact_rational;
using Row = std::array<Rational, 3>;

Row row(const Vec3& p, const Vec3& q) {
  return {Rational(p.x) - Rational(q.x), Rational(p.y) - Rational(q.y), Rational(p.z) - Rational(q.z)};
}

int signOfDeterminant(const Row& u, const Row& v, const Row& w) {
  const Rational det =
      u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
  return static_cast<int>(CGAL::sign(det));
}

int truth(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return signOfDeterminant(row(b, a), row(c, a), row(d, a));
}
int truthDirection(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& v) {
  return signOfDeterminant(row(b, a), row(c, a), row(v, Vec3(0.0)));
}

TEST(Orient3d, SignIsThatOfTheDeterminant) {
  const Vec3 o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  EXPECT_EQ(orient3d(o, x, y, z), 1);
  EXPECT_EQ(orient3d(o, y, x, z), -1);
  EXPECT_EQ(orient3d(o, x, y, Vec3(3, 4, 0)), 0);
  EXPECT_EQ(orientDirection(o, x, y, z), 1);
  EXPECT_EQ(orientDirection(x, o, y, z), -1);
  EXPECT_EQ(orientDirection(o, x, y, Vec3(1, 1, 0)), 0);
  EXPECT_EQ(orientViewpoint(o, x, y, Viewpoint(0, 0, 5, 1)), 1);
  EXPECT_EQ(orientViewpoint(o, x, y, Viewpoint(0, 0, -5, 0)), -1);
}

TEST(Orient3d, NearlyCoplanarPointsFarAwayAsRationalsSay) {
  const std::uint64_t seed = 20;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto any = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  std::array<int, 3> seen{};
  for (int i = 0; i < 20000; ++i) {
    const Vec3 centre = 1e6 * any();
    const Vec3 a = centre + any(), b = centre + any(), c = centre + any();
    // In the plane but for rounding, or 1e-9 off.
    Vec3 d = a + uniform(random) * (b - a) + uniform(random) * (c - a);
    if (i % 2 == 0) d += 1e-9 * any();
    const int sign = orient3d(a, b, c, d);
    ASSERT_EQ(sign, truth(a, b, c, d)) << i;
    ASSERT_EQ(orient3d(b, a, c, d), -sign);
    ASSERT_EQ(orient3d(b, c, a, d), sign);
    ++seen[static_cast<std::size_t>(sign + 1)];
    const Vec3 v = d - a;
    ASSERT_EQ(orientDirection(a, b, c, v), truthDirection(a, b, c, v)) << i;
  }
  EXPECT_GT(seen[0], 1000);
  EXPECT_GT(seen[2], 1000);
}

TEST(Orient3d, EdgesAndVolumesAsRationalsSay) {
  const std::uint64_t seed = 21;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<int> small(-2, 2);
  const auto point = [&] { return Vec3(small(random), small(random), small(random)); };
  const Vec3 none(0.0);
  int zeros = 0;
  for (int n = 0; n < 3000; ++n) {
    // Small integers, and next to them what a sum with 1 would lose.
    const Vec3 a = point() + 1e-17 * point(), b = point() + 1e-17 * point(), c = point(), u = point(), v = point();
    const int edge = signOfDeterminant(row(b, a), row(u, none), row(v, none));
    ASSERT_EQ(orientEdge(a, b, u, v), edge);
    const int volume = truthDirection(a, b, c, v);
    const double value = directionVolume(a, b, c, v);
    ASSERT_EQ(value > 0.0 ? 1 : value < 0.0 ? -1 : 0, volume);
    zeros += edge == 0 ? 1 : 0;
  }
  EXPECT_GT(zeros, 100);
  EXPECT_LT(zeros, 2900);
}

TEST(Orient3d, CoplanarLatticePointsAreZero) {
  std::mt19937_64 random(21);
  std::uniform_int_distribution<int> whole(-1000, 1000);
  const auto any = [&] { return Vec3(whole(random), whole(random), whole(random)); };
  for (int i = 0; i < 20000; ++i) {
    const Vec3 a = any(), u = any(), v = any();
    const double scale = std::ldexp(1.0, whole(random) / 10);
    const Vec3 shift = 0.1 * any();  // the same rounded numbers in all four points only where they are exact
    const double s = whole(random), t = whole(random);
    const Vec3 b = a + u, c = a + v, d = a + s * u + t * v;
    ASSERT_EQ(orient3d(scale * a, scale * b, scale * c, scale * d), 0);
    ASSERT_EQ(orient3d(a + shift, b + shift, c + shift, d + shift), truth(a + shift, b + shift, c + shift, d + shift));
    ASSERT_EQ(orientDirection(a, b, c, s * u + t * v), 0);
  }
}

TEST(Orient3d, AxisAlignedPlanesAndDirections) {
  for (const double h : {1.0, 0.1, 1e-200, 1e200}) {
    const Vec3 a(h, h, h), b(2 * h, h, h), c(h, 2 * h, h);
    EXPECT_EQ(orientDirection(a, b, c, Vec3(1, 0, 0)), 0);
    EXPECT_EQ(orientDirection(a, b, c, Vec3(0, 0, 1e-3)), 1);
    EXPECT_EQ(orient3d(a, b, c, Vec3(-7, 3, h)), 0);
    EXPECT_EQ(orient3d(a, b, c, Vec3(-7, 3, std::nextafter(h, 0.0))), -1);
  }
}

TEST(Orient3d, TinyAndHugeCoordinatesNeitherVanishNorOverflow) {
  std::mt19937_64 random(22);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::uniform_int_distribution<int> exponent(-1000, 1000);
  for (int i = 0; i < 5000; ++i) {
    const auto coordinate = [&](int e) { return std::ldexp(uniform(random), e); };
    const int common = exponent(random);
    const auto any = [&] {
      const int e = i % 2 == 0 ? common : exponent(random);
      return Vec3(coordinate(e), coordinate(i % 3 == 0 ? exponent(random) : e), coordinate(e));
    };
    const Vec3 a = any(), b = any(), c = any(), d = any();
    ASSERT_EQ(orient3d(a, b, c, d), truth(a, b, c, d)) << i;
    ASSERT_EQ(orientDirection(a, b, c, d), truthDirection(a, b, c, d)) << i;
  }
}

// Sign of the fifth point's height above the linear function through the first four, by Cramer's rule.
int truthLift(const std::array<Vec3, 5>& p, const std::array<Rational, 5>& h) {
  const auto volume = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) -> Rational {
    const Row u = row(p[b], p[a]), v = row(p[c], p[a]), w = row(p[d], p[a]);
    return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
  };
  const Rational plane =
      volume(4, 1, 2, 3) * h[0] + volume(0, 4, 2, 3) * h[1] + volume(0, 1, 4, 3) * h[2] + volume(0, 1, 2, 4) * h[3];
  return static_cast<int>(CGAL::sign(Rational(volume(0, 1, 2, 3) * h[4] - plane)));
}

std::array<Rational, 5> squares(const std::array<Vec3, 5>& p) {
  std::array<Rational, 5> h;
  for (std::size_t i = 0; i < 5; ++i) {
    const Rational x = p[i].x, y = p[i].y, z = p[i].z;
    h[i] = x * x + y * y + z * z;
  }
  return h;
}

TEST(AboveLift, OutsideOnAndInsideTheSphere) {
  std::array<Vec3, 5> p{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 1, 1)};
  EXPECT_EQ(aboveLift(p), 0);
  p[4] = Vec3(1, 1, std::nextafter(1.0, 2.0));
  EXPECT_EQ(aboveLift(p), 1);
  p[4] = Vec3(1, 1, std::nextafter(1.0, 0.0));
  EXPECT_EQ(aboveLift(p), -1);
  EXPECT_EQ(aboveLift(p, {0, 1, 1, 1, 4}), 1);
  EXPECT_EQ(aboveLift(p, {0, 1, 1, 1, 1}), -1);
}

TEST(AboveLift, AsRationalsSay) {
  const std::uint64_t seed = 23;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::array<int, 3> seen{};
  for (int i = 0; i < 4000; ++i) {
    // Lattice points lie on common spheres and planes often; scaled, moved and nudged they nearly do.
    std::array<Vec3, 5> p;
    const double scale = i % 3 == 0 ? 1.0 : std::ldexp(1.0 + uniform(random), static_cast<int>(random() % 400) - 200);
    const Vec3 shift = i % 5 == 0 ? Vec3(0.0) : 1e3 * scale * Vec3(uniform(random), uniform(random), uniform(random));
    for (Vec3& q : p) {
      q = scale * Vec3(static_cast<double>(random() % 3), static_cast<double>(random() % 3),
                       static_cast<double>(random() % 3)) +
          shift;
      if (i % 7 == 0) q.x = std::nextafter(q.x, 1e300);
    }
    const int turn = orient3d(p[0], p[1], p[2], p[3]);
    if (turn == 0) continue;
    if (turn < 0) std::swap(p[0], p[1]);
    const int sign = aboveLift(p);
    ASSERT_EQ(sign, truthLift(p, squares(p))) << i;
    ++seen[static_cast<std::size_t>(sign + 1)];
    std::array<double, 5> h{};
    std::array<Rational, 5> exact;
    for (std::size_t k = 0; k < 5; ++k) {
      h[k] = i % 2 == 0 ? static_cast<double>(random() % 3) : p[k].x * p[k].x + p[k].y * p[k].y + p[k].z * p[k].z;
      exact[k] = h[k];
    }
    ASSERT_EQ(aboveLift(p, h), truthLift(p, exact)) << i;
  }
  for (const int n : seen)
    EXPECT_GT(n, 100);
}

}  // namespace
}  // namespace spillikin::mesh
