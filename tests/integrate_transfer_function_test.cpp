// Transfer functions: what they answer, what they refuse, and the built-in looks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/integrate/transfer_function.h"

namespace spillikin::integrate {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

ControlPoint point(double value, double shade, double extinction) {
  return {value, {shade, shade, shade}, extinction};
}

std::string refusal(std::vector<ControlPoint> points) {
  try {
    const TransferFunction tf(std::move(points));
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(TransferFunction, IsLinearBetweenPointsAndConstantOutside) {
  const TransferFunction tf({point(1.0, 0.0, 2.0), point(3.0, 1.0, 4.0)});
  EXPECT_EQ(tf(2.0).extinction, 3.0);
  EXPECT_EQ(tf(2.5).color[1], 0.75);
  EXPECT_EQ(tf(1.0).extinction, 2.0);
  EXPECT_EQ(tf(3.0).extinction, 4.0);
  EXPECT_EQ(tf(-1e300).extinction, 2.0);
  EXPECT_EQ(tf(infinity).extinction, 4.0);
}

TEST(TransferFunction, TakesTheUpperSideOfAJump) {
  const TransferFunction tf({point(0.0, 0.0, 1.0), point(1.0, 0.25, 2.0), point(1.0, 0.75, 5.0), point(2.0, 1.0, 6.0)});
  EXPECT_EQ(tf(1.0).extinction, 5.0);
  EXPECT_EQ(tf(1.0).color[0], 0.75);
  EXPECT_LT(tf(std::nextafter(1.0, 0.0)).extinction, 2.0 + 1e-12);
}

TEST(TransferFunction, OfOnePointIsConstant) {
  const TransferFunction tf({point(5.0, 0.5, 3.0)});
  for (const double v : {-7.0, 5.0, 9.0})
    EXPECT_EQ(tf(v).extinction, 3.0);
}

TEST(TransferFunction, RefusesWhatIsNoFunction) {
  EXPECT_NE(refusal({}).find("no points"), std::string::npos);
  EXPECT_NE(refusal({point(1.0, 0.0, 0.0), point(0.0, 0.0, 0.0)}).find("point 1"), std::string::npos);
  EXPECT_NE(refusal({point(std::nan(""), 0.0, 0.0)}).find("finite"), std::string::npos);
  EXPECT_NE(refusal({point(0.0, 0.0, 0.0), point(infinity, 0.0, 0.0)}).find("point 1"), std::string::npos);
  EXPECT_NE(refusal({point(1.0, 0.0, 0.0), point(1.0, 0.0, 0.0), point(1.0, 0.0, 0.0)}).find("third"),
            std::string::npos);
  EXPECT_NE(refusal({point(0.0, 1.5, 0.0)}).find("colour"), std::string::npos);
  EXPECT_NE(refusal({point(0.0, std::nan(""), 0.0)}).find("colour"), std::string::npos);
  EXPECT_NE(refusal({point(0.0, 0.5, -1.0)}).find("extinction"), std::string::npos);
  EXPECT_NE(refusal({point(0.0, 0.5, infinity)}).find("extinction"), std::string::npos);
  EXPECT_EQ(refusal({point(0.0, 0.5, 0.0)}), "");
}

TEST(TransferFunction, ScalesItsExtinctionOnly) {
  const TransferFunction tf = preset("viridis");
  EXPECT_FALSE(tf.oneColor());
  const TransferFunction twice = tf.scaled(2.0);
  EXPECT_EQ(twice(0.4).extinction, 2.0 * tf(0.4).extinction);
  EXPECT_EQ(twice(0.4).color, tf(0.4).color);
  EXPECT_THROW(tf.scaled(-1.0), Error);
  EXPECT_THROW(tf.scaled(std::nan("")), Error);
  EXPECT_THROW(tf.scaled(infinity), Error);
}

TEST(TransferFunction, KeepsJumpsWhereItIsMapped) {
  for (const std::string& look : presetNames()) {
    const TransferFunction tf = preset(look);
    const TransferFunction mapped = tf.mapped(-3.7, 11.1);
    ASSERT_EQ(mapped.points().size(), tf.points().size()) << look;
    EXPECT_EQ(mapped(-3.7).extinction, tf(0.0).extinction) << look;
    EXPECT_EQ(mapped(11.1).extinction, tf(1.0).extinction) << look;
    for (std::size_t i = 1; i < tf.points().size(); ++i) {
      EXPECT_EQ(tf.points()[i].value == tf.points()[i - 1].value,
                mapped.points()[i].value == mapped.points()[i - 1].value)
          << look << " " << i;
    }
  }
}

TEST(TransferFunction, MapsTheOneValueOfAConstantFieldToItsMiddle) {
  for (const double value : {0.0, 1.0, -273.15, 1e-300, 1e300}) {
    const TransferFunction tf = preset("viridis");
    EXPECT_NEAR(tf.mapped(value, value)(value).extinction, tf(0.5).extinction, 1e-12) << value;
  }
}

TEST(TransferFunction, FitsARangeOfFewDoubles) {
  const double lo = 1e9;
  const double hi = std::nextafter(std::nextafter(lo, 2e9), 2e9);
  const TransferFunction tf = preset("comb").mapped(lo, hi);  // 48 points on three values
  EXPECT_GE(tf.points().size(), 2U);
  EXPECT_EQ(tf(hi + 1.0).extinction, preset("comb")(1.0).extinction);
}

TEST(TransferFunction, RefusesARangeThatIsNone) {
  const TransferFunction tf = preset("viridis");
  EXPECT_THROW(tf.mapped(1.0, 0.0), Error);
  EXPECT_THROW(tf.mapped(std::nan(""), 1.0), Error);
  EXPECT_THROW(tf.mapped(0.0, infinity), Error);
}

TEST(Presets, LieOnTheUnitIntervalWithExtinctionOfAtMostOne) {
  for (const std::string& look : presetNames()) {
    const TransferFunction tf = preset(look);
    EXPECT_GE(tf.points().front().value, 0.0) << look;
    EXPECT_LE(tf.points().back().value, 1.0) << look;
    double most = 0.0;
    for (const ControlPoint& p : tf.points())
      most = std::max(most, p.extinction);
    EXPECT_EQ(most, 1.0) << look;
  }
}

TEST(Presets, AreKnownByName) {
  EXPECT_NO_THROW(preset(default_preset));
  try {
    preset("veridis");
    FAIL() << "an unknown look was found";
  } catch (const Error& e) {
    for (const std::string& look : presetNames())
      EXPECT_NE(std::string(e.what()).find(look), std::string::npos);
  }
}

// Luminance of the perceptual maps rises all the way; it is what they are for.
TEST(Presets, OfSequentialMapsGrowLighter) {
  for (const char* look : {"viridis", "plasma", "inferno", "magma", "grayscale"}) {
    const TransferFunction tf = preset(look);
    double before = -1.0;
    for (const ControlPoint& p : tf.points()) {
      const double luminance =
          0.2126 * std::pow(p.color[0], 2.2) + 0.7152 * std::pow(p.color[1], 2.2) + 0.0722 * std::pow(p.color[2], 2.2);
      EXPECT_GT(luminance, before) << look << " at " << p.value;
      before = luminance;
    }
  }
}

}  // namespace
}  // namespace spillikin::integrate
