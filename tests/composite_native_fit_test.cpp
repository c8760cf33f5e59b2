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
