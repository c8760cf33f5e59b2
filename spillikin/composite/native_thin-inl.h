// The weights of one segment of a ray in float, on which colour and extinction are linear in the scalar (Moreland and
// Angel 2004), by series. With m the optical depth, d its growth (back minus front extinction, times length):
//   alpha = 1 - exp(-m)
//   skew  = 2 Psi - 1 - exp(-m) = (weight of the back end) - (weight of the front end)
//   Psi   = integral over s in [0, 1] of exp(-m s) exp(d s (1 - s) / 2)
// so that skew = -m^2 K1 + d K1 + d^2 K2 / 4 + d^3 K3 / 24 + ..., Kn the integral of exp(-m s) (s (1 - s))^n. A segment
// with the scalar's mean v and change c glows as base * alpha + slope * (v * alpha + c / 2 * skew).
// Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_THIN_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_THIN_INL_H
#undef SPILLIKIN_NATIVE_THIN_INL_H
#else
#define SPILLIKIN_NATIVE_THIN_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "spillikin/integrate/segment_simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, 16>;
using VF = hn::Vec<DF>;

// What a segment adds: base * alpha + slope * tint, where the colour is base + slope * value.
struct Glow {
  VF alpha, tint;
};

template <std::size_t N>
HWY_INLINE VF polynomial(VF m, const float (&c)[N]) {
  const DF d;
  VF sum = hn::Set(d, c[N - 1]);
  for (std::size_t k = N - 1; k-- > 0;)
    sum = hn::MulAdd(sum, m, hn::Set(d, c[k]));
  return sum;
}

// The short series, for |m| <= thin_depth and |d| <= 2 |m|: alpha to 3e-6 (relative), skew to 1e-4 (and of the colour,
// that times half its change). To be taken from the low end of a segment whose scalar falls along the ray, `sign` is -1
// and m comes with it: ends and skew change their signs, but for the terms even in d.
struct ThinSeries {
  static HWY_INLINE VF alpha(VF signed_m) {
    constexpr float c[] = {1.0F, -1.0F / 2, 1.0F / 6, -1.0F / 24};
    return hn::Mul(signed_m, polynomial(signed_m, c));
  }
  static HWY_INLINE VF skew(VF m, VF signed_m, VF d, VF /*sign*/) {
    constexpr float c[] = {1.0F / 6, -1.0F / 12};
    return hn::Mul(hn::NegMulAdd(m, signed_m, d), polynomial(m, c));
  }
};

// The long series, for |m| <= deep_depth: alpha to 3e-6 (relative), skew to 5e-4.
struct DeepSeries {
  static HWY_INLINE VF alpha(VF signed_m) {
    constexpr float c[] = {1.0F, -1.0F / 2, 1.0F / 6, -1.0F / 24, 1.0F / 120, -1.0F / 720, 1.0F / 5040, -1.0F / 40320};
    return hn::Mul(signed_m, polynomial(signed_m, c));
  }
  static HWY_INLINE VF skew(VF m, VF signed_m, VF d, VF sign) {
    constexpr float k1[] = {1.0F / 6, -1.0F / 12, 1.0F / 40, -1.0F / 180, 1.0F / 1008};
    constexpr float k2[] = {1.0F / 30 / 4, -1.0F / 60 / 4, 1.0F / 210 / 4};
    constexpr float k3[] = {1.0F / 140 / 24, -1.0F / 280 / 24};
    const VF high = hn::MulAdd(hn::Mul(d, sign), polynomial(m, k2), hn::Mul(hn::Mul(d, d), polynomial(m, k3)));
    return hn::MulAdd(d, high, hn::Mul(hn::NegMulAdd(m, signed_m, d), polynomial(m, k1)));
  }
};

// The long series for 0 <= m <= deep_depth alone, by polynomials of least error there: alpha to 3e-6 (relative), skew
// to 6e-4. K1 and alpha interpolate at the Chebyshev points of [0, 1].
struct ForwardSeries {
  static HWY_INLINE VF alpha(VF m) {
    constexpr float c[] = {0.9999980855F, -0.4999039918F, 0.1658865668F, -0.03940637290F, 0.005547933053F};
    return hn::Mul(m, polynomial(m, c));
  }
  static HWY_INLINE VF skew(VF m, VF /*signed_m*/, VF d, VF /*sign*/) {
    constexpr float k1[] = {0.1666608772F, -0.08314716564F, 0.02404465080F, -0.003925032827F};
    constexpr float k2[] = {1.0F / 30 / 4, -1.0F / 60 / 4, 1.0F / 210 / 4};
    const VF high = hn::MulAdd(hn::Mul(d, d), hn::Set(DF(), 0.00023259F), hn::Mul(d, polynomial(m, k2)));
    return hn::MulAdd(d, high, hn::Mul(hn::NegMulAdd(m, m, d), polynomial(m, k1)));
  }
};

// Any optical depth: integrate's own evaluation, which costs twice as much thin and five times as much thick. `front`
// is the scalar at the front, relative to where the extinction is `extinction`.
HWY_INLINE Glow anyDepth(VF front, VF change, VF length, VF extinction, VF slope) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF x = hn::Max(hn::Mul(length, hn::MulAdd(slope, front, extinction)), zero);
  const VF y = hn::Max(hn::MulAdd(hn::Mul(length, slope), change, x), zero);
  const auto w = integrate::HWY_NAMESPACE::weights(d, x, y);
  return {w.alpha, hn::MulAdd(front, w.alpha, hn::Mul(change, w.back))};
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
