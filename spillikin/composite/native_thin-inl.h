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

#include <algorithm>
#include <cmath>

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

// For m <= simple_depth: relative error below 3e-7.
HWY_INLINE VF thinAlpha(VF m) {
  constexpr float c[] = {1.0F, -1.0F / 2, 1.0F / 6, -1.0F / 24, 1.0F / 120};
  return hn::Mul(m, polynomial(m, c));
}

// For m <= simple_depth, |d| <= 2 m: absolute error below 1e-5.
HWY_INLINE VF thinSkew(VF m, VF d) {
  constexpr float c[] = {1.0F / 6, -1.0F / 12, 1.0F / 40};
  return hn::Mul(hn::NegMulAdd(m, m, d), polynomial(m, c));
}

// For m <= 1, |d| <= 2 m: relative error of alpha below 3e-7, absolute error of the skew below 1e-4.
HWY_INLINE VF mediumAlpha(VF m) {
  constexpr float c[] = {1.0F,        -1.0F / 2,   1.0F / 6,      -1.0F / 24,   1.0F / 120,
                         -1.0F / 720, 1.0F / 5040, -1.0F / 40320, 1.0F / 362880};
  return hn::Mul(m, polynomial(m, c));
}

HWY_INLINE VF mediumSkew(VF m, VF d) {
  constexpr float k1[] = {1.0F / 6, -1.0F / 12, 1.0F / 40, -1.0F / 180, 1.0F / 1008, -1.0F / 6720};
  constexpr float k2[] = {1.0F / 30 / 4, -1.0F / 60 / 4, 1.0F / 210 / 4, -1.0F / 1008 / 4};
  constexpr float k3[] = {1.0F / 140 / 24, -1.0F / 280 / 24, 1.0F / 1008 / 24};
  constexpr float k4 = 1.0F / 630 / 192;
  const VF high = hn::MulAdd(d, hn::Set(DF(), k4), polynomial(m, k3));
  const VF low = hn::MulAdd(d, high, polynomial(m, k2));
  return hn::MulAdd(hn::NegMulAdd(m, m, d), polynomial(m, k1), hn::Mul(hn::Mul(d, d), low));
}

// Beyond this optical depth nothing is seen.
constexpr float opaque_depth = 12.0F;

// Any optical depth: cut into equal parts of at most 1, past opaque_depth not at all. `front` is the scalar at the
// front, relative to where the extinction is `extinction`. A multiple of the work for thick segments, which are few:
// there is no light behind them.
HWY_INLINE Glow anyDepth(VF front, VF change, VF length, VF extinction, VF slope) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF half = hn::Set(d, 0.5F);
  const VF one = hn::Set(d, 1.0F);
  const VF limit = hn::Set(d, opaque_depth);
  VF x = hn::Max(hn::Mul(length, hn::MulAdd(slope, front, extinction)), zero);
  VF growth = hn::Mul(hn::Mul(length, slope), change);
  VF m = hn::Max(hn::MulAdd(growth, half, x), zero);
  if (HWY_UNLIKELY(!hn::AllTrue(d, hn::Le(m, limit)))) {
    // The share of the length after which the depth is reached: x f + growth f^2 / 2 = limit.
    const VF root = hn::Sqrt(hn::Max(hn::MulAdd(hn::Mul(limit, hn::Set(d, 2.0F)), growth, hn::Mul(x, x)), zero));
    const VF f = hn::Min(hn::Div(hn::Mul(limit, hn::Set(d, 2.0F)), hn::Add(x, root)), one);
    const auto thick = hn::Gt(m, limit);
    change = hn::IfThenElse(thick, hn::Mul(change, f), change);
    x = hn::IfThenElse(thick, hn::Mul(x, f), x);
    growth = hn::IfThenElse(thick, hn::Mul(growth, hn::Mul(f, f)), growth);
    m = hn::IfThenElse(thick, limit, m);
  }
  const float deepest = hn::GetLane(hn::MaxOfLanes(d, m));
  if (HWY_LIKELY(deepest <= 1.0F)) {
    const VF alpha = mediumAlpha(m);
    const VF c = hn::Mul(change, half);
    return Glow{alpha, hn::MulAdd(hn::Add(front, c), alpha, hn::Mul(c, mediumSkew(m, growth)))};
  }
  // Parts of equal length: one may hold twice its share of the depth, where the extinction starts at 0.
  const float parts = std::ceil(2.0F * deepest);
  const VF share = hn::Set(d, 1.0F / parts);
  const VF part_change = hn::Mul(change, share);
  const VF part_growth = hn::Mul(growth, hn::Mul(share, share));
  const VF c = hn::Mul(part_change, half);
  VF part_m = hn::MulAdd(part_growth, half, hn::Mul(x, share));
  VF mean = hn::Add(front, c);
  VF light = one;
  VF alpha = zero;
  VF tint = zero;
  for (float k = 0.0F; k < parts; ++k) {
    const VF depth = hn::Max(part_m, zero);
    const VF a = mediumAlpha(depth);
    const VF t = hn::MulAdd(mean, a, hn::Mul(c, mediumSkew(depth, part_growth)));
    alpha = hn::MulAdd(light, a, alpha);
    tint = hn::MulAdd(light, t, tint);
    light = hn::NegMulAdd(light, a, light);
    part_m = hn::Add(part_m, part_growth);
    mean = hn::Add(mean, part_change);
  }
  return Glow{alpha, tint};
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
