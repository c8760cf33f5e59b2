// What is left out where the light of a bent colour is taken for a line or a parabola, against the closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "spillikin/composite/native_batch.h"
#include "spillikin/integrate/segment.h"

namespace spillikin::tests {
namespace {

using composite::native::bowLeftOut;
using composite::native::tiltLeftOut;

// A fragment along which the scalar rises from 0 to 1, or falls, with extinction on a line: of optical depth `depth`,
// that grows by `growth` towards a scalar of 1. The colour is 0 up to a scalar of `bend` and rises from there.
struct BentFragment {
  double depth, growth, bend;
  bool rises;

  double exact() const {
    const double lo = depth - 0.5 * growth, hi = depth + 0.5 * growth;
    const integrate::TransferFunction tf({{0.0, {0.0, 0.0, 0.0}, lo},
                                          {bend, {0.0, 0.0, 0.0}, lo + (hi - lo) * bend},
                                          {1.0, {1.0 - bend, 0.0, 0.0}, hi}});
    return integrate::integrate(tf, rises ? 0.0 : 1.0, rises ? 1.0 : 0.0, 1.0).color[0];
  }
  double opacity() const { return -std::expm1(-depth); }

  // As the kernels weight a ramp.
  double weight(bool bowed) const {
    const double towards_back = rises ? growth : -growth;
    const integrate::Weights w = integrate::weights(depth - 0.5 * towards_back, depth + 0.5 * towards_back);
    const double tilt = (rises ? 0.5 : -0.5) * (w.back - w.front);
    const double bow = opacity() / 24.0 * (depth * depth - 3.0 * towards_back);
    const double share = 1.0 - bend, even = share - share * share;
    const double line = 0.5 * share * share * opacity() + tilt * share * share * (3.0 - 2.0 * share);
    return bowed ? line + bow * even * even : line;
  }
};

TEST(CompositeNativeBends, WhatIsLeftOutIsBounded) {
  constexpr unsigned seed = 20261127;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  const auto uniform = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
  for (int i = 0; i < 20000; ++i) {
    BentFragment f{std::pow(uniform(0.03, 1.0), 2.0), 0.0, uniform(0.01, 0.99), uniform(0.0, 1.0) < 0.5};
    f.growth = f.depth * uniform(-2.0, 2.0);
    const auto d = static_cast<float>(f.depth), g = static_cast<float>(std::abs(f.growth));
    const double rounding = 1e-9;
    EXPECT_LE(std::abs(f.exact() - f.weight(false)), tiltLeftOut(d, g) * f.opacity() + rounding)
        << f.depth << ' ' << f.growth << ' ' << f.bend;
    EXPECT_LE(std::abs(f.exact() - f.weight(true)), bowLeftOut(d, g, g, d) * f.opacity() + rounding)
        << f.depth << ' ' << f.growth << ' ' << f.bend;
  }
}

// The bounds are of use: amid the fragments that they are for, they are not far from what is left out.
TEST(CompositeNativeBends, TheBoundsAreTight) {
  double tilt = 0.0, bow = 0.0;
  for (double bend = 0.02; bend < 1.0; bend += 0.02) {
    const BentFragment f{0.5, 0.5, bend, false};
    tilt = std::max(tilt, std::abs(f.exact() - f.weight(false)) / f.opacity());
    bow = std::max(bow, std::abs(f.exact() - f.weight(true)) / f.opacity());
  }
  EXPECT_GE(tilt, 0.5 * tiltLeftOut(0.5F, 0.5F));
  EXPECT_GE(bow, 0.5 * bowLeftOut(0.5F, 0.5F, 0.5F, 0.5F));
}

}  // namespace
}  // namespace spillikin::tests
