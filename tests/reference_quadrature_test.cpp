// The closed form of the library against the ground truth's own adaptive quadrature.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "spillikin/integrate/segment.h"
#include "spillikin/reference/quadrature.h"

namespace spillikin::tests {
namespace {

// Points in random places, some of them doubled into jumps.
integrate::TransferFunction randomLook(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<integrate::ControlPoint> points;
  double value = -0.2;
  for (int n = 0; n < 6; ++n) {
    value += 0.02 + 0.4 * uniform(random);
    const int copies = uniform(random) < 0.3 ? 2 : 1;
    for (int c = 0; c < copies; ++c) {
      points.push_back({value, {uniform(random), uniform(random), uniform(random)}, 8.0 * uniform(random)});
    }
  }
  return integrate::TransferFunction(points);
}

void expectSame(const integrate::Radiance& a, const integrate::Radiance& b, double tolerance) {
  for (std::size_t c = 0; c < 3; ++c)
    ASSERT_NEAR(a.color[c], b.color[c], tolerance);
  ASSERT_NEAR(a.alpha, b.alpha, tolerance);
}

TEST(ReferenceQuadrature, AgreesWithTheClosedForm) {
  const std::uint64_t seed = 4242;
  SCOPED_TRACE(fmt::format("seed {}", seed));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int n = 0; n < 300; ++n) {
    const integrate::TransferFunction tf = randomLook(random);
    const double front = 3.0 * uniform(random) - 0.5, back = 3.0 * uniform(random) - 0.5;
    const double length = std::pow(10.0, 5.0 * uniform(random) - 3.0);
    expectSame(reference::quadrature(tf, front, back, length), integrate::integrate(tf, front, back, length), 1e-11);
    expectSame(reference::quadrature(tf, back, front, length), integrate::integrate(tf, back, front, length), 1e-11);
    expectSame(reference::quadrature(tf, front, front, length), integrate::integrate(tf, front, front, length), 1e-11);
    // A segment that ends, or lies, exactly at a breakpoint or a jump.
    const double at = tf.points()[static_cast<std::size_t>(n) % tf.points().size()].value;
    expectSame(reference::quadrature(tf, front, at, length), integrate::integrate(tf, front, at, length), 1e-11);
    expectSame(reference::quadrature(tf, at, back, length), integrate::integrate(tf, at, back, length), 1e-11);
    expectSame(reference::quadrature(tf, at, at, length), integrate::integrate(tf, at, at, length), 1e-11);
  }
}

TEST(ReferenceQuadrature, ConstantsInClosedForm) {
  const integrate::TransferFunction tf({{0.0, {0.25, 0.5, 1.0}, 2.0}});
  for (const double length : {0.0, 1e-9, 1e-3, 1.0, 30.0}) {
    const integrate::Radiance r = reference::quadrature(tf, -1.0, 2.0, length);
    const double alpha = -std::expm1(-2.0 * length);
    EXPECT_NEAR(r.alpha, alpha, 1e-15 + 1e-12 * alpha);
    EXPECT_NEAR(r.color[1], 0.5 * alpha, 1e-15 + 1e-12 * alpha);
  }
}

}  // namespace
}  // namespace spillikin::tests
