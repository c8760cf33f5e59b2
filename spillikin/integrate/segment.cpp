#include "spillikin/integrate/segment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "spillikin/integrate/pieces.h"
#include "spillikin/integrate/special_functions.h"

namespace spillikin::integrate {

namespace {

constexpr double sqrt_pi = 1.7724538509055160273;

// Below this optical depth 1 - Psi and Psi - zeta are summed as series, because Psi and zeta near 1 cancel; above it
// the closed form loses no more than a factor of ten of the rounding. Both agree there to 1e-14.
constexpr double thin_depth = 0.5;

// Beyond this extinction times length the weights are 1 / x to double precision, and squares must not overflow.
constexpr double opaque_end = 1e150;

// Behind this optical depth less than 1e-19 of the light is left: nothing that a double beside it can hold.
constexpr double black = 44.0;

// 1 / (n + 1): a division for each term would cost more than the rest of the series.
constexpr std::array<double, 64> per_next = [] {
  std::array<double, 64> table{};
  for (std::size_t n = 0; n < table.size(); ++n)
    table[n] = 1.0 / static_cast<double>(n + 1);
  return table;
}();

// exp(-(x s + d s^2 / 2)) = sum c_n s^n with (n + 1) c_{n+1} = -x c_n - d c_{n-1}. Term by term, 1 - Psi is the sum of
// -c_n / (n + 1), Psi - zeta the sum of -c_n n / (n + 1).
Weights thinWeights(double x, double y) {
  const double d = y - x;
  Weights w;
  double before = 1.0;
  double c = -x;
  for (std::size_t n = 1; n < per_next.size(); ++n) {
    const double share = c * per_next[n];
    w.front -= share;
    w.back -= static_cast<double>(n) * share;
    const double next = (-x * c - d * before) * per_next[n];
    // Two terms in a row must be small: one of them alone may vanish.
    if (std::abs(c) + std::abs(next) <= 1e-18 * w.front) break;
    before = c;
    c = next;
  }
  w.alpha = -std::expm1(-0.5 * (x + y));
  return w;
}

// What one end gives to Psi: sqrt(pi)/2 erfcx(u) / a for growing extinction, F(v) / a for falling, where u or v = x /
// (2 a) and a = sqrt(|d| / 2). Where x is not small beside a, the same is scaled(x / 2a) / x, which also holds for a ->
// 0.
double growingEnd(double x, double a) {
  const double u = x / (2.0 * a);
  return u < 1.0 ? 0.5 * sqrt_pi * erfcx(u) / a : scaledErfcx(u) / x;
}

double fallingEnd(double x, double a) {
  const double v = x / (2.0 * a);
  return v < 1.0 ? dawson(v) / a : scaledDawson(v) / x;
}

}  // namespace

Weights weights(double x, double y) {
  x = std::min(x, opaque_end);
  y = std::min(y, opaque_end);
  const double depth = 0.5 * (x + y);
  if (depth < thin_depth) return thinWeights(x, y);
  const double zeta = std::exp(-depth);
  const double d = y - x;
  double psi;
  if (d == 0.0) {
    psi = -std::expm1(-x) / x;
  } else if (d > 0.0) {
    const double a = std::sqrt(0.5 * d);
    psi = growingEnd(x, a) - zeta * growingEnd(y, a);
  } else {
    const double a = std::sqrt(-0.5 * d);
    psi = fallingEnd(x, a) - zeta * fallingEnd(y, a);
  }
  return {1.0 - psi, psi - zeta, 1.0 - zeta};
}

Radiance integrate(const TransferFunction& tf, double front, double back, double length) {
  // The depth is summed rather than the transparency multiplied, so that the opacity of many thin pieces keeps its
  // relative accuracy.
  Radiance sum;
  double depth = 0.0;
  forEachPiece(tf, front, back, length, [&](const Optical& a, const Optical& b, double part) {
    const double x = a.extinction * part;
    const double y = b.extinction * part;
    const Weights w = weights(x, y);
    const double light = std::exp(-depth);
    for (std::size_t k = 0; k < 3; ++k)
      sum.color[k] += light * (w.front * a.color[k] + w.back * b.color[k]);
    depth += 0.5 * (x + y);
    return depth < black;
  });
  sum.alpha = -std::expm1(-depth);
  return sum;
}

}  // namespace spillikin::integrate
