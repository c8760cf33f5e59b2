// The closed form of one linear segment against quadrature, limits and identities.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "spillikin/integrate/segment.h"
#include "tests/support/quadrature.h"

namespace spillikin::integrate {
namespace {

struct Truth {
  long double front, back, alpha;
};

// The weights as the positive integrals that they are; no difference of nearly equal numbers.
Truth quadrature(long double x, long double y) {
  const long double d = y - x;
  // What lies behind an optical depth of 100 is 1e-43 of the rest: nothing, which the quadrature need not resolve.
  const auto light = [&](long double s) {
    const long double through = s * (x + d * s / 2);
    return through > 100 ? 0.0L : (x * (1 - s) + y * s) * std::exp(-through);
  };
  return {test::layered([&](long double s) { return (1 - s) * light(s); }, 1e-12L),
          test::layered([&](long double s) { return s * light(s); }, 1e-12L), -std::expm1(-(x + y) / 2)};
}

double relative(double value, long double truth) {
  if (truth == 0.0L) return std::abs(value);
  return static_cast<double>(std::fabs((static_cast<long double>(value) - truth) / truth));
}

void compare(double x, double y, double tolerance) {
  const Weights w = weights(x, y);
  const Truth t = quadrature(x, y);
  EXPECT_LT(relative(w.front, t.front), tolerance) << "front of x " << x << ", y " << y << ": " << w.front;
  EXPECT_LT(relative(w.back, t.back), tolerance) << "back of x " << x << ", y " << y << ": " << w.back;
  EXPECT_LT(relative(w.alpha, t.alpha), tolerance) << "alpha of x " << x << ", y " << y << ": " << w.alpha;
}

constexpr double bound = 2e-14;  // relative; seen is 2e-15

TEST(Weights, ReachQuadratureForAnyDepthAndDifference) {
  for (double depth = 1e-7; depth < 1.1e3; depth *= std::pow(10.0, 0.25)) {
    for (int exponent = -15; exponent <= 0; ++exponent) {
      for (const double sign : {-1.0, 1.0}) {
        const double difference = sign * std::pow(10.0, exponent);  // (y - x) / (y + x)
        compare(depth * (1.0 - difference), depth * (1.0 + difference), bound);
      }
    }
  }
}

TEST(Weights, ReachQuadratureAtTheEndsOfTheRange) {
  for (const double x : {0.0, 1e-300, 1e-12, 1e-3, 1.0, 44.0, 1e3, 1e6}) {
    for (const double y : {0.0, 1e-300, 1e-12, 1e-3, 1.0, 44.0, 1e3, 1e6}) {
      if (x + y > 0.0) compare(x, y, bound);
    }
  }
}

TEST(Weights, ReachQuadratureAtRandom) {
  constexpr unsigned seed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> exponent(-7.0, 6.0);
  for (int i = 0; i < 1000; ++i) {
    const double x = std::pow(10.0, exponent(random));
    compare(x, std::pow(10.0, exponent(random)), bound);
  }
}

TEST(Weights, DoNotJumpWhereTheBranchChanges) {
  for (double x = 0.0; x <= 1.0; x += 1.0 / 64.0) {
    const double y = 1.0 - x;  // depth 1/2: the border of the series
    const double less = y > 0.5 ? std::nextafter(y, 0.0) : y;
    const double nudged = y > 0.5 ? x : std::nextafter(x, 0.0);
    const Weights above = weights(x, y);
    const Weights below = weights(nudged, less);
    EXPECT_NEAR(above.front, below.front, 1e-14) << x;
    EXPECT_NEAR(above.back, below.back, 1e-14) << x;
    EXPECT_NEAR(above.alpha, below.alpha, 1e-15) << x;
  }
}

TEST(Weights, OfEqualEndsAreThoseOfAConstant) {
  for (double x = 1e-8; x < 1e7; x *= 7.0) {
    const Weights w = weights(x, x);
    const Weights near = weights(x, std::nextafter(x, 1e9));
    EXPECT_LT(relative(w.front, 1.0L + std::expm1(-static_cast<long double>(x)) / x), x < 1e-2 ? 1e-8 : 1e-12);
    EXPECT_NEAR(near.front, w.front, 1e-14 * w.front);
    EXPECT_NEAR(near.back, w.back, 1e-14 * w.back);
  }
}

TEST(Weights, OfNothingAreNothing) {
  const Weights w = weights(0.0, 0.0);
  EXPECT_EQ(w.front, 0.0);
  EXPECT_EQ(w.back, 0.0);
  EXPECT_EQ(w.alpha, 0.0);
}

TEST(Weights, StayFiniteBeyondEveryRange) {
  for (const double x : {0.0, 1.0, 1e200, std::numeric_limits<double>::infinity()}) {
    for (const double y : {1e200, std::numeric_limits<double>::max(), std::numeric_limits<double>::infinity()}) {
      for (const Weights w : {weights(x, y), weights(y, x)}) {
        EXPECT_TRUE(w.front >= 0.0 && w.front <= 1.0) << x << " " << y;
        EXPECT_TRUE(w.back >= 0.0 && w.back <= 1.0) << x << " " << y;
        EXPECT_EQ(w.alpha, 1.0);
      }
    }
  }
}

// A segment of constant colour glows with alpha times the colour: front + back = alpha.
TEST(Weights, AddUpToAlpha) {
  for (double x = 1e-9; x < 1e7; x *= 3.7) {
    for (double y = 1e-9; y < 1e7; y *= 5.3) {
      const Weights w = weights(x, y);
      EXPECT_NEAR(w.front + w.back, w.alpha, 1e-14 * w.alpha) << x << " " << y;
    }
  }
}

TEST(Weights, GrowWithTheThickness) {
  for (const double slope : {0.0, 0.1, 1.0, 10.0, 1e6}) {
    Weights before;
    for (double length = 1e-6; length < 1e6; length *= 1.1) {
      const Weights w = weights(length, slope * length);
      EXPECT_GE(w.alpha, before.alpha);
      EXPECT_GE(w.front, before.front * (1.0 - 1e-14));
      before = w;
    }
  }
}

}  // namespace
}  // namespace spillikin::integrate
