#include "spillikin/integrate/segment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "spillikin/integrate/special_functions.h"

namespace spillikin::integrate {

namespace {

constexpr double sqrt_pi = 1.7724538509055160273;

// Below this optical depth 1 - Psi and Psi - zeta are summed as series, because Psi and zeta near 1 cancel; above it
// the closed form loses no more than a factor of ten of the rounding. Both agree there to 1e-14.
constexpr double thin_depth = 0.5;

// Beyond this extinction times length the weights are 1 / x to double precision, and squares must not overflow.
constexpr double opaque_end = 1e150;

// exp(-(x s + d s^2 / 2)) = sum c_n s^n with (n + 1) c_{n+1} = -x c_n - d c_{n-1}. Term by term, 1 - Psi is the sum of
// -c_n / (n + 1), Psi - zeta the sum of -c_n n / (n + 1).
Weights thinWeights(double x, double y) {
  const double d = y - x;
  Weights w;
  double before = 1.0;
  double c = -x;
  for (int n = 1; n < 64; ++n) {
    const double share = c / (n + 1.0);
    w.front -= share;
    w.back -= n * share;
    const double next = (-x * c - d * before) / (n + 1.0);
    // Two terms in a row must be small: one of them alone may vanish.
    if (std::abs(c) + std::abs(next) <= 1e-18 * w.front) break;
    before = c;
    c = next;
  }
  w.alpha = -std::expm1(-0.5 * (x + y));
  return w;
}

// Psi / 1 from one end: sqrt(pi)/2 erfcx(u) / a for growing extinction, F(v) / a for falling, where u or v = x / (2 a)
// and a = sqrt(|d| / 2). Where x is not small beside a, the same is scaled(x / 2a) / x, which also holds for a -> 0.
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

namespace {

// The function on the piece between two neighbouring points, at a value inside it; exact at both ends.
Optical between(const ControlPoint& a, const ControlPoint& b, double value) {
  const double t = (value - a.value) / (b.value - a.value);
  if (!(t < 1.0)) return {b.color, b.extinction};
  Optical o;
  for (std::size_t k = 0; k < 3; ++k)
    o.color[k] = a.color[k] + t * (b.color[k] - a.color[k]);
  o.extinction = a.extinction + t * (b.extinction - a.extinction);
  return o;
}

// Gathers pieces front to back. The depth is summed rather than the transparency multiplied, so that the opacity of
// many thin pieces keeps its relative accuracy.
class Gather {
 public:
  void add(const Optical& front, const Optical& back, double length) {
    const double x = front.extinction * length;
    const double y = back.extinction * length;
    const Weights w = weights(x, y);
    const double light = std::exp(-depth_);
    for (std::size_t k = 0; k < 3; ++k)
      color_[k] += light * (w.front * front.color[k] + w.back * back.color[k]);
    depth_ += 0.5 * (x + y);
  }
  // Nothing behind can be seen at double precision: less than 1e-19 of full scale is left.
  bool opaque() const { return depth_ > 44.0; }
  Radiance result() const { return {color_, -std::expm1(-depth_)}; }

 private:
  std::array<double, 3> color_{};
  double depth_ = 0.0;
};

}  // namespace

Radiance integrate(const TransferFunction& tf, double front, double back, double length) {
  Gather gather;
  if (!(length > 0.0)) return gather.result();
  if (front == back) {
    const Optical o = tf(front);
    gather.add(o, o, length);
    return gather.result();
  }
  const auto& p = tf.points();
  // Halving keeps the span finite for ends near the limits of double.
  const double span = 0.5 * back - 0.5 * front;
  const auto part = [&](double from, double to) { return length * ((0.5 * to - 0.5 * from) / span); };
  const bool up = back > front;
  // The points strictly between the ends, in the order they are met: next is the first beyond `front`.
  auto next = up ? std::upper_bound(p.begin(), p.end(), front, [](double v, const auto& q) { return v < q.value; })
                 : std::lower_bound(p.begin(), p.end(), front, [](const auto& q, double v) { return q.value < v; });
  double here = front;
  while (here != back && !gather.opaque()) {
    const bool outside = next == p.begin() || next == p.end();
    // The far end of the piece that `here` lies in, as seen in the direction of travel.
    const bool last = up ? next == p.end() : next == p.begin();
    const double cut = last ? back : (up ? next->value : std::prev(next)->value);
    const double there = up ? std::min(cut, back) : std::max(cut, back);
    if (outside) {
      const ControlPoint& flat = next == p.begin() ? p.front() : p.back();
      const Optical o{flat.color, flat.extinction};
      gather.add(o, o, part(here, there));
    } else {
      gather.add(between(*std::prev(next), *next, here), between(*std::prev(next), *next, there), part(here, there));
    }
    here = there;
    // Over the cut, and over both points of a jump.
    if (up) {
      while (next != p.end() && next->value <= here)
        ++next;
    } else {
      while (next != p.begin() && std::prev(next)->value >= here)
        --next;
    }
  }
  return gather.result();
}

}  // namespace spillikin::integrate
