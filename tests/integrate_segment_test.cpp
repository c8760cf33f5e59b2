// A segment through any transfer function: against quadrature, limits, jumps, and what must hold for every one.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "spillikin/integrate/segment.h"
#include "tests/support/quadrature.h"

namespace spillikin::integrate {
namespace {

using Exact = std::array<long double, 4>;  // colour, alpha

ControlPoint point(double value, double shade, double extinction) {
  return {value, {shade, shade, shade}, extinction};
}

// Hundreds of points, every third place a jump, extinction between nothing and `peak`.
TransferFunction randomComb(std::size_t count, double peak, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<double> values(count);
  for (double& v : values)
    v = unit(random);
  std::sort(values.begin(), values.end());
  std::vector<ControlPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto add = [&] {
      points.push_back({values[i],
                        {unit(random), unit(random), unit(random)},
                        unit(random) < 0.3 ? 0.0 : peak * std::pow(unit(random), 4.0)});
    };
    add();
    if (i % 3 == 0) add();
  }
  return TransferFunction(std::move(points));
}

// The integral in long double. It cuts at the values of all points, without regard to their order on the segment, asks
// the function itself inside each part, and halves parts that are optically thick.
class Judge {
 public:
  Judge(const TransferFunction& tf, double front, double back, double length)
      : tf_(tf), front_(front), back_(back), length_(length) {}

  Exact radiance() {
    std::vector<double> cuts = {0.0, 1.0};
    for (const ControlPoint& p : tf_.points()) {
      const double t = (p.value - front_) / (back_ - front_);
      if (t > 0.0 && t < 1.0) cuts.push_back(t);
    }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t i = 1; i < cuts.size(); ++i) {
      if (cuts[i] > cuts[i - 1]) part(cuts[i - 1], cuts[i]);
    }
    return {sum_[0], sum_[1], sum_[2], -std::expm1(-depth_)};
  }

 private:
  Optical at(long double t) const { return tf_(static_cast<double>(front_ + t * (back_ - front_))); }
  // Exact where extinction is linear, and never asked for at the ends, where it may jump.
  long double depthOf(long double a, long double b) const {
    const long double g = 0.5L - 0.5L / std::sqrt(3.0L);
    return length_ * (b - a) * (at(a + g * (b - a)).extinction + at(b - g * (b - a)).extinction) / 2;
  }
  void part(long double a, long double b) {
    const long double depth = depthOf(a, b);
    if (depth_ > 60.0L) return;
    if (depth > 3.0L) {
      part(a, (a + b) / 2);
      part((a + b) / 2, b);
      return;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      sum_[k] += std::exp(-depth_) * length_ *
                 test::kronrod(
                     [&](long double t) {
                       const Optical o = at(t);
                       return o.color[k] * static_cast<long double>(o.extinction) * std::exp(-depthOf(a, t));
                     },
                     a, b, 1e-9L, 30);
    }
    depth_ += depth;
  }

  const TransferFunction& tf_;
  long double front_, back_, length_;
  Exact sum_{};
  long double depth_ = 0.0L;
};

void expectExact(const TransferFunction& tf, double front, double back, double length, double tolerance) {
  const Radiance r = integrate(tf, front, back, length);
  const Exact truth = Judge(tf, front, back, length).radiance();
  // The weakest colour may be nearly nothing beside alpha; it is measured against alpha then.
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(r.color[k], static_cast<double>(truth[k]), tolerance * static_cast<double>(truth[3]))
        << front << " to " << back << " over " << length;
  }
  EXPECT_NEAR(r.alpha, static_cast<double>(truth[3]), tolerance * static_cast<double>(truth[3]))
      << front << " to " << back << " over " << length;
}

TEST(Segment, OfConstantExtinctionIsTheExponential) {
  const TransferFunction tf({point(0.0, 1.0, 2.0)});
  for (const double length : {1e-9, 1e-3, 1.0, 30.0}) {
    const Radiance r = integrate(tf, 0.1, 0.9, length);
    EXPECT_NEAR(r.alpha, -std::expm1(-2.0 * length), 1e-15 * r.alpha + 1e-300);
    EXPECT_NEAR(r.color[0], r.alpha, 1e-14 * r.alpha);
  }
}

TEST(Segment, OfNothingIsNothing) {
  const TransferFunction clear({point(0.0, 1.0, 0.0), point(1.0, 1.0, 0.0)});
  EXPECT_EQ(integrate(clear, 0.2, 0.8, 5.0).alpha, 0.0);
  EXPECT_EQ(integrate(preset("viridis"), 0.2, 0.8, 0.0).alpha, 0.0);
  EXPECT_EQ(integrate(TransferFunction(), 0.2, 0.8, 1.0).alpha, 0.0);
}

TEST(Segment, ReachesQuadratureInEveryLook) {
  constexpr unsigned seed = 5;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-0.2, 1.2), exponent(-7.0, 3.0);
  for (const std::string& look : presetNames()) {
    const TransferFunction tf = preset(look);
    for (int i = 0; i < 40; ++i) {
      const double length = std::pow(10.0, exponent(random));
      expectExact(tf, value(random), value(random), length, 1e-10);
    }
  }
}

TEST(Segment, ReachesQuadratureOnCombsOfHundredsOfPoints) {
  constexpr unsigned seed = 7;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const double peak : {1.0, 1e3}) {
    const TransferFunction tf = randomComb(300, peak, random);
    for (int i = 0; i < 20; ++i)
      expectExact(tf, unit(random), unit(random), unit(random), 1e-10);
  }
}

// PEERS: a hat between colour points that lie only at the ends of the range.
TEST(Segment, SeesAHatInsideIt) {
  const TransferFunction hat(
      {point(0.0, 1.0, 0.0), point(0.4, 1.0, 0.0), point(0.5, 1.0, 10.0), point(0.6, 1.0, 0.0), point(1.0, 1.0, 0.0)});
  EXPECT_NEAR(integrate(hat, 0.0, 1.0, 1.0).alpha, 1.0 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(integrate(hat, 1.0, 0.0, 1.0).alpha, 1.0 - std::exp(-1.0), 1e-15);
}

TEST(Segment, EndsOnTheSideOfAJumpItLiesOn) {
  const TransferFunction tf({point(0.0, 0.0, 1.0), point(1.0, 0.0, 1.0), point(1.0, 1.0, 3.0), point(2.0, 1.0, 3.0)});
  EXPECT_NEAR(integrate(tf, 0.0, 1.0, 1.0).alpha, 1.0 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(integrate(tf, 1.0, 0.0, 1.0).alpha, 1.0 - std::exp(-1.0), 1e-15);
  EXPECT_NEAR(integrate(tf, 1.0, 2.0, 1.0).alpha, 1.0 - std::exp(-3.0), 1e-15);
  EXPECT_NEAR(integrate(tf, 2.0, 1.0, 1.0).alpha, 1.0 - std::exp(-3.0), 1e-15);
  EXPECT_NEAR(integrate(tf, 1.0, 1.0, 1.0).alpha, 1.0 - std::exp(-3.0), 1e-15);  // the function's rule
  const Radiance across = integrate(tf, 0.0, 2.0, 2.0);
  EXPECT_NEAR(across.alpha, 1.0 - std::exp(-4.0), 1e-15);
  EXPECT_NEAR(across.color[0], std::exp(-1.0) * (1.0 - std::exp(-3.0)), 1e-15);
  const Radiance back = integrate(tf, 2.0, 0.0, 2.0);
  EXPECT_NEAR(back.color[0], 1.0 - std::exp(-3.0), 1e-15);
}

TEST(Segment, TendsToTheConstantAsItsEndsMeet) {
  const TransferFunction tf = preset("viridis").scaled(3.0);
  const Radiance flat = integrate(tf, 0.41, 0.41, 1.0);
  double before = 1.0;
  for (double d = 1e-2; d > 1e-16; d /= 10.0) {
    const Radiance r = integrate(tf, 0.41, 0.41 + d, 1.0);
    const double error = std::abs(r.color[1] - flat.color[1]);
    EXPECT_LT(error, std::max(before, 1e-15)) << d;
    EXPECT_LT(error, 3.0 * d + 1e-15) << d;
    before = error;
  }
}

// Splitting anywhere and compositing gives the whole.
TEST(Segment, IsTheSumOfItsParts) {
  constexpr unsigned seed = 23;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0), exponent(-4.0, 2.0);
  std::vector<TransferFunction> looks = {randomComb(200, 20.0, random)};
  for (const std::string& look : presetNames())
    looks.push_back(preset(look));
  for (const TransferFunction& tf : looks) {
    for (int i = 0; i < 200; ++i) {
      const double a = unit(random);
      const double b = unit(random);
      const double length = std::pow(10.0, exponent(random));
      const double t = unit(random);
      const double middle = a + t * (b - a);
      const Radiance whole = integrate(tf, a, b, length);
      const Radiance parts = over(integrate(tf, a, middle, t * length), integrate(tf, middle, b, (1.0 - t) * length));
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(parts.color[k], whole.color[k], 1e-11);
      EXPECT_NEAR(parts.alpha, whole.alpha, 1e-11);
    }
  }
}

// The furnace: where everything glows alike, colour is alpha times that glow, whatever the extinction does.
TEST(Segment, InAFurnaceGlowsWithItsOpacity) {
  constexpr unsigned seed = 29;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<ControlPoint> points = randomComb(300, 100.0, random).points();
  for (ControlPoint& p : points)
    p.color = {0.25, 0.5, 1.0};
  const TransferFunction tf(std::move(points));
  for (int i = 0; i < 500; ++i) {
    const Radiance r = integrate(tf, unit(random), unit(random), std::pow(10.0, 9.0 * unit(random) - 7.0));
    EXPECT_NEAR(r.color[0], 0.25 * r.alpha, 1e-13 * r.alpha);
    EXPECT_NEAR(r.color[2], r.alpha, 1e-13 * r.alpha);
  }
}

TEST(Segment, GrowsWithLengthAndExtinction) {
  for (const std::string& look : presetNames()) {
    const TransferFunction tf = preset(look);
    double before = -1.0;
    for (double length = 1e-6; length < 1e4; length *= 1.7) {
      const double alpha = integrate(tf, 0.05, 0.95, length).alpha;
      EXPECT_GE(alpha, before) << look;
      EXPECT_GE(integrate(tf.scaled(2.0), 0.05, 0.95, length).alpha, alpha) << look;
      before = alpha;
    }
  }
}

TEST(Segment, StaysFiniteAtTheLimitsOfDouble) {
  const TransferFunction tf = preset("bands");
  for (const double front : {-1.7e308, 0.3, 0.3 + 5e-17, 5e-324, 1.7e308}) {
    for (const double back : {-1.7e308, 0.3, 0.0, 1.7e308}) {
      for (const double length : {1e-300, 1.0, 1e300}) {
        const Radiance r = integrate(tf, front, back, length);
        EXPECT_TRUE(r.alpha >= 0.0 && r.alpha <= 1.0) << front << " " << back << " " << length;
        for (const double c : r.color)
          EXPECT_TRUE(c >= 0.0 && c <= 1.0) << front << " " << back << " " << length;
      }
    }
  }
}

}  // namespace
}  // namespace spillikin::integrate
