// The optical models, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/integrate/optics.h"

namespace spillikin::integrate {
namespace {

constexpr Optics all[] = {Optics::absorption_emission, Optics::emission, Optics::absorption, Optics::mip, Optics::xray};

// Colour s, extinction 2 s: both linear, on [0, 1].
TransferFunction linear() {
  return TransferFunction({{0.0, {0.0, 0.0, 0.0}, 0.0}, {1.0, {1.0, 0.5, 0.0}, 2.0}});
}

Radiance ray(Optics optics, const TransferFunction& tf, const std::vector<std::array<double, 3>>& segments) {
  Gathered gathered;
  for (const auto& [front, back, length] : segments)
    gather(optics, tf, front, back, length, gathered);
  return radiance(optics, tf, gathered);
}

TEST(Optics, AreKnownByName) {
  for (const Optics o : all)
    EXPECT_EQ(optics(name(o)), o);
  EXPECT_EQ(optics("absorption-emission"), Optics::absorption_emission);
  try {
    optics("raytracing");
    FAIL() << "an unknown model was found";
  } catch (const Error& e) {
    for (const Optics o : all)
      EXPECT_NE(std::string(e.what()).find(name(o)), std::string::npos);
  }
}

TEST(Optics, EmissionIsTheIntegralOfGlow) {
  const Radiance r = ray(Optics::emission, linear(), {{0.0, 1.0, 3.0}});
  EXPECT_NEAR(r.color[0], 3.0 * 2.0 / 3.0, 1e-15);  // length times the integral of s * 2 s
  EXPECT_NEAR(r.color[1], 1.0, 1e-15);
  EXPECT_EQ(r.alpha, 0.0);
}

// Where extinction is nearly nothing, nothing is hidden.
TEST(Optics, EmissionIsTheThinLimitOfAbsorptionAndEmission) {
  constexpr double factor = 1e-12;
  for (const char* look : {"viridis", "comb", "bands"}) {
    const TransferFunction tf = preset(look);
    const TransferFunction thin = tf.scaled(factor);
    for (const auto& [front, back] : {std::pair{0.03, 0.97}, std::pair{0.8, 0.1}}) {
      const Radiance glow = ray(Optics::emission, tf, {{front, back, 2.0}});
      const Radiance faint = integrate(thin, front, back, 2.0);
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(glow.color[k], faint.color[k] / factor, 1e-10) << look;
    }
  }
}

TEST(Optics, AbsorptionIsBlackSmokeAndXrayWhite) {
  const double alpha = 1.0 - std::exp(-3.0);  // depth: length 3 times the integral of 2 s
  const Radiance smoke = ray(Optics::absorption, linear(), {{0.0, 1.0, 3.0}});
  EXPECT_EQ(smoke.color[0], 0.0);
  EXPECT_NEAR(smoke.alpha, alpha, 1e-15);
  const Radiance film = ray(Optics::xray, linear(), {{0.0, 1.0, 3.0}});
  EXPECT_NEAR(film.color[2], alpha, 1e-15);
  EXPECT_NEAR(film.alpha, alpha, 1e-15);
}

TEST(Optics, MipShowsTheLargestScalarAndNothingWhereThereIsNone) {
  const Radiance r = ray(Optics::mip, linear(), {{0.1, 0.2, 1.0}, {0.75, 0.3, 1.0}, {0.4, 0.4, 1.0}});
  EXPECT_EQ(r.color[0], 0.75);
  EXPECT_EQ(r.alpha, 1.0);
  EXPECT_EQ(ray(Optics::mip, linear(), {}).alpha, 0.0);
}

TEST(Optics, AbsorptionEmissionIsTheCompositedSegments) {
  const TransferFunction tf = preset("bands").scaled(4.0);
  const Radiance two = over(integrate(tf, 0.1, 0.6, 1.0), integrate(tf, 0.6, 0.2, 0.5));
  const Radiance r = ray(Optics::absorption_emission, tf, {{0.1, 0.6, 1.0}, {0.6, 0.2, 0.5}});
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(r.color[k], two.color[k], 1e-15);
  EXPECT_NEAR(r.alpha, two.alpha, 1e-15);
}

TEST(Optics, DoNotDependOnTheOrderWhereTheySaySo) {
  const TransferFunction tf = preset("comb").scaled(5.0);
  const std::vector<std::array<double, 3>> segments = {{0.1, 0.6, 1.0}, {0.6, 0.2, 0.5}, {0.9, 0.95, 0.3}};
  std::vector<std::array<double, 3>> reversed(segments.rbegin(), segments.rend());
  for (const Optics o : all) {
    const Radiance a = ray(o, tf, segments);
    const Radiance b = ray(o, tf, reversed);
    const double difference =
        std::max({std::abs(a.color[0] - b.color[0]), std::abs(a.color[1] - b.color[1]), std::abs(a.alpha - b.alpha)});
    if (orderMatters(o)) {
      EXPECT_GT(difference, 1e-3) << name(o);
    } else {
      EXPECT_LT(difference, 1e-14) << name(o);
    }
  }
}

// A cut of a segment changes nothing in any model.
TEST(Optics, AreTheSumOfTheirParts) {
  const TransferFunction tf = preset("steps").scaled(2.0);
  for (const Optics o : all) {
    const Radiance whole = ray(o, tf, {{0.05, 0.93, 2.0}});
    const Radiance parts = ray(o, tf, {{0.05, 0.27, 0.5}, {0.27, 0.93, 1.5}});
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(parts.color[k], whole.color[k], 1e-14) << name(o);
    EXPECT_NEAR(parts.alpha, whole.alpha, 1e-14) << name(o);
  }
}

}  // namespace
}  // namespace spillikin::integrate
