// Lines and parabolas that stand for a colour's bend, and pictures that are made of them.
#include <gtest/gtest.h>

// One instruction set, whichever this file is compiled for.
#include "spillikin/composite/native_fit-inl.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "spillikin/composite/backends.h"
#include "tests/composite_native_checks.h"
#include "tests/support/meshes.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

struct Errors {
  double most = 0.0, bound = 0.0;
};

Errors errorsOf(const RampFit& fit, double bend) {
  constexpr int steps = 2000;
  const double at = hn::GetLane(fit.at), slope = hn::GetLane(fit.slope), curve = hn::GetLane(fit.curve);
  Errors errors{0.0, hn::GetLane(fit.error)};
  for (int i = 0; i <= steps; ++i) {
    const double t = -1.0 + 2.0 * i / steps;
    errors.most = std::max(errors.most, std::abs(std::max(t - bend, 0.0) - (at + slope * t + curve * t * t)));
  }
  return errors;
}

constexpr double rounding = 1e-6;

TEST(CompositeNativeFit, LinesErrByTheirBound) {
  for (double bend = -1.0; bend <= 1.0; bend += 1.0 / 64) {
    const Errors e = errorsOf(lineForRamp(hn::Set(DF(), static_cast<float>(bend))), bend);
    EXPECT_NEAR(e.most, e.bound, 1e-3) << bend;
    EXPECT_LE(e.most, e.bound + rounding) << bend;
  }
}

TEST(CompositeNativeFit, ParabolasErrByTheirBoundAtMost) {
  for (double bend = -1.0; bend <= 1.0; bend += 1.0 / 64) {
    const VF at = hn::Set(DF(), static_cast<float>(bend));
    const Errors parabola = errorsOf(parabolaForRamp(at), bend);
    EXPECT_LE(parabola.most, parabola.bound + rounding) << bend;
    EXPECT_GE(parabola.most, 0.85 * parabola.bound - 1e-3) << bend;
    EXPECT_LE(parabola.most, errorsOf(lineForRamp(at), bend).most + 1e-3) << bend;
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

namespace spillikin::tests {
namespace {

// Two pieces whose colours meet at a bend: one line for both where that errs by little anywhere in the range, and what
// was there before where it does not.
TEST(CompositeNativeFit, LooksAreStraightenedWithinTheirBound) {
  constexpr unsigned seed = 7;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(0.0F, 1.0F);
  int straightened = 0, left = 0;
  for (int k = 0; k < 2000; ++k) {
    composite::native::Piece pieces[2];
    composite::native::Piece& low = pieces[0];
    composite::native::Piece& high = pieces[1];
    low.anchor = 0.2F;
    low.end = high.anchor = 0.5F;
    low.reach = high.reach = 1;
    for (std::size_t c = 0; c < 3; ++c) {
      low.color[c] = any(random);
      low.color_slope[c] = 2.0F * any(random) - 1.0F;
      low.kink[c] = 4.0F * any(random) - 2.0F;
      high.color[c] = low.color[c] + low.color_slope[c] * (low.end - low.anchor);
      high.color_slope[c] = low.color_slope[c] + low.kink[c];
    }
    const float range = 0.02F * any(random) + 1e-4F;
    const float lo = low.end - range * any(random);
    composite::native::Look look{pieces, 0, 1, lo, lo + range};
    composite::native::Piece line;
    look.straighten(line);
    double most = 0.0;
    const auto at = [](const composite::native::Piece& p, std::size_t c, float v) {
      return double{p.color[c]} + double{p.color_slope[c]} * (double{v} - double{p.anchor});
    };
    const bool straight = look.pieces == &line;
    ASSERT_EQ(look.first, 0);
    ASSERT_EQ(look.last, straight ? 0 : 1);
    // A line of least error, whether it was taken or not.
    for (std::size_t c = 0; c < 3; ++c) {
      const double lift = 0.5 * double{low.end - lo} * double{lo + range - low.end} / double{range};
      most = std::max(most, std::abs(double{low.kink[c]}) * lift);
      for (int i = 0; straight && i <= 64; ++i) {
        const float v = lo + range * static_cast<float>(i) / 64.0F;
        EXPECT_NEAR(at(line, c, v), at(v < low.end ? low : high, c, v), composite::native::fit_left_out + 1e-6);
      }
    }
    EXPECT_EQ(straight, most <= double{composite::native::fit_left_out}) << most;
    ++(straight ? straightened : left);
  }
  EXPECT_GT(straightened, 500);
  EXPECT_GT(left, 500);
}

// A mesh of cells of a few pixels, under colours that bend in many of them; from afar, from nearby, and parallel.
TEST(CompositeNativeFit, PicturesOfTinyCellsStayWithinHalfADisplayStep) {
  constexpr double half_step = 0.5 * step;
  constexpr unsigned seed = 11;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  Subject s(tetrahedronGrid(12, 0.15, 5), "", "viridis", 1.0);
  for (const int points : {4, 12, 30}) {
    std::vector<integrate::ControlPoint> look;
    for (int k = 0; k < points; ++k) {
      const double v = static_cast<double>(k) / (points - 1);
      const double value = s.field.lo + v * (s.field.hi - s.field.lo);
      look.push_back({value, {any(random), any(random), any(random)}, 0.3 * (0.2 + v)});
    }
    s.tf = integrate::TransferFunction(look);
    View view = viewOf(s, {1.0, 0.6, 0.8}, 28, 21, 5.0);
    for (const double scale : {0.0, 0.8}) {
      view.parallel_scale = scale;
      expectExact(s, view, sort::Algorithm::mpvo, half_step);
    }
  }
}

// Extinction that rises and falls within some cells: what is left out of the scalar shows in the depth.
TEST(CompositeNativeFit, TinyCellsOnSteepSlopesOfExtinction) {
  Subject s(tetrahedronGrid(12, 0.15, 5), "", "viridis", 1.0);
  std::vector<integrate::ControlPoint> teeth;
  constexpr int ends = 9;
  for (int k = 0; k < ends; ++k) {
    const double value = s.field.lo + (s.field.hi - s.field.lo) * k / (ends - 1);
    teeth.push_back({value, {1.0, 1.0, 1.0}, k % 2 == 0 ? 0.0 : 0.2});
  }
  s.tf = integrate::TransferFunction(teeth);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 28, 21, 5.0);
  expectExact(s, view);
  view.parallel_scale = 0.8;
  expectExact(s, view);
}

// Depths of tiny cells are of the first order, those of all cells along a ray still the chord.
TEST(CompositeNativeFit, TinyCellsAddUpToChords) {
  const Subject s = uniform(tetrahedronGrid(12, 0.15, 5), 0.1);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 28, 21, 5.0);
  expectChords(s, view, {0.0, 0.0, 0.0}, {12.0, 12.0, 12.0});
  view.parallel_scale = 0.8;
  expectChords(s, view, {0.0, 0.0, 0.0}, {12.0, 12.0, 12.0});
}

}  // namespace
}  // namespace spillikin::tests
