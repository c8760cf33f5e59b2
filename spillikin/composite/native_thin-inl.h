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

#include "spillikin/composite/native_wide-inl.h"
#include "spillikin/integrate/segment_simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// 1 / v to a few units in the last place.
template <class V>
HWY_INLINE V reciprocal(const V& v) {
#if HWY_ARCH_X86
  const V r = wide::ApproximateReciprocal(v);
  return wide::MulAdd(r, wide::NegMulAdd(v, r, hn::Set(DF(), 1.0F)), r);
#else
  return wide::Div(hn::Set(DF(), 1.0F), v);
#endif
}

// A whole number from 0 to 2^22: added to 2^23, it lies in a float's last bits, without what a conversion does for
// numbers that are too large.
template <class D>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> wholeNumber(D d, hn::Vec<D> v) {
  const hn::RebindToSigned<D> di;
  return hn::And(hn::BitCast(di, hn::Add(v, hn::Set(d, 8388608.0F))), hn::Set(di, (1 << 23) - 1));
}

// What a segment adds: base * alpha + slope * tint, where the colour is base + slope * value.
template <class V>
struct Glow {
  V alpha, tint;
};

template <class V, std::size_t N>
HWY_INLINE V polynomial(const V& m, const float (&c)[N]) {
  const DF d;
  V sum = wide::same<V>(hn::Set(d, c[N - 1]));
  for (std::size_t k = N - 1; k-- > 0;)
    sum = wide::MulAdd(sum, m, hn::Set(d, c[k]));
  return sum;
}

// The short series for 0 <= m <= thin_depth and |d| <= thin_growth, polynomials of least error there (interpolated at
// the Chebyshev points): alpha to 2e-5 (relative), skew to 6e-4 (and of the colour, that times half its change).
struct ShortSeries {
  template <class V>
  static HWY_INLINE V alpha(const V& m) {
    constexpr float c[] = {0.9999811118F, -0.4986362269F, 0.1518845347F};
    return wide::Mul(m, polynomial(m, c));
  }
  template <class V, class S>
  static HWY_INLINE V skew(const V& m, const V& /*signed_m*/, const V& d, const S& /*sign*/) {
    constexpr float k1[] = {0.1664817943F, -0.07737588936F};
    return wide::Mul(wide::NegMulAdd(m, m, d), polynomial(m, k1));
  }
};

// The short series for |m| <= cut_depth and |d| <= 2 |m|: alpha to 3e-6 (relative), skew to 6e-4. To be taken from the
// low end of a segment whose scalar falls along the ray, `sign` is -1 and m comes with it: ends and skew change their
// signs, but for the terms even in d.
struct ThinSeries {
  template <class V>
  static HWY_INLINE V alpha(const V& signed_m) {
    constexpr float c[] = {1.0F, -1.0F / 2, 1.0F / 6, -1.0F / 24};
    return wide::Mul(signed_m, polynomial(signed_m, c));
  }
  template <class V, class S>
  static HWY_INLINE V skew(const V& m, const V& signed_m, const V& d, const S& /*sign*/) {
    constexpr float c[] = {1.0F / 6, -1.0F / 12};
    return wide::Mul(wide::NegMulAdd(m, signed_m, d), polynomial(m, c));
  }
};

// The long series, for |m| <= deep_depth: alpha to 3e-6 (relative), skew to 5e-4.
struct DeepSeries {
  template <class V>
  static HWY_INLINE V alpha(const V& signed_m) {
    constexpr float c[] = {1.0F, -1.0F / 2, 1.0F / 6, -1.0F / 24, 1.0F / 120, -1.0F / 720, 1.0F / 5040, -1.0F / 40320};
    return wide::Mul(signed_m, polynomial(signed_m, c));
  }
  template <class V, class S>
  static HWY_INLINE V skew(const V& m, const V& signed_m, const V& d, const S& sign) {
    constexpr float k1[] = {1.0F / 6, -1.0F / 12, 1.0F / 40, -1.0F / 180, 1.0F / 1008};
    constexpr float k2[] = {1.0F / 30 / 4, -1.0F / 60 / 4, 1.0F / 210 / 4};
    constexpr float k3[] = {1.0F / 140 / 24, -1.0F / 280 / 24};
    const V high = wide::MulAdd(wide::Mul(d, sign), polynomial(m, k2), wide::Mul(wide::Mul(d, d), polynomial(m, k3)));
    return wide::MulAdd(d, high, wide::Mul(wide::NegMulAdd(m, signed_m, d), polynomial(m, k1)));
  }
};

// The long series for 0 <= m <= deep_depth alone, by polynomials of least error there: alpha to 3e-6 (relative), skew
// to 6e-4. K1 and alpha interpolate at the Chebyshev points of [0, 1].
struct ForwardSeries {
  template <class V>
  static HWY_INLINE V alpha(const V& m) {
    constexpr float c[] = {0.9999980855F, -0.4999039918F, 0.1658865668F, -0.03940637290F, 0.005547933053F};
    return wide::Mul(m, polynomial(m, c));
  }
  template <class V, class S>
  static HWY_INLINE V skew(const V& m, const V& /*signed_m*/, const V& d, const S& /*sign*/) {
    constexpr float k1[] = {0.1666608772F, -0.08314716564F, 0.02404465080F, -0.003925032827F};
    constexpr float k2[] = {1.0F / 30 / 4, -1.0F / 60 / 4, 1.0F / 210 / 4};
    const V high = wide::MulAdd(wide::Mul(d, d), hn::Set(DF(), 0.00023259F), wide::Mul(d, polynomial(m, k2)));
    return wide::MulAdd(d, high, wide::Mul(wide::NegMulAdd(m, m, d), polynomial(m, k1)));
  }
};

// What integrate's formulas are made of, over one vector or two.
template <class W>
struct WideOps {
  using V = W;
  HWY_INLINE V set(float a) const { return wide::same<V>(hn::Set(DF(), a)); }
  HWY_INLINE V add(const V& a, const V& b) const { return wide::Add(a, b); }
  HWY_INLINE V sub(const V& a, const V& b) const { return wide::Sub(a, b); }
  HWY_INLINE V mul(const V& a, const V& b) const { return wide::Mul(a, b); }
  HWY_INLINE V mulAdd(const V& a, const V& b, const V& c) const { return wide::MulAdd(a, b, c); }
  HWY_INLINE V reciprocal(const V& a) const {
    return each([](VF v) HWY_ATTR { return integrate::HWY_NAMESPACE::VectorOps<DF>().reciprocal(v); }, a);
  }
  HWY_INLINE V sqrt(const V& a) const { return wide::Sqrt(a); }
  HWY_INLINE V abs(const V& a) const { return wide::Abs(a); }
  HWY_INLINE V min(const V& a, const V& b) const { return wide::Min(a, b); }
  HWY_INLINE V round(const V& a) const { return wide::Round(a); }
  HWY_INLINE V exp2i(const V& a) const {
    return each([](VF v) HWY_ATTR { return integrate::HWY_NAMESPACE::VectorOps<DF>().exp2i(v); }, a);
  }
  HWY_INLINE auto less(const V& a, const V& b) const { return wide::Lt(a, b); }
  template <class M>
  HWY_INLINE bool all(const M& m) const {
    return wide::AllTrue(m);
  }
  template <class M>
  HWY_INLINE V select(const M& m, const V& yes, const V& no) const {
    return wide::IfThenElse(m, yes, no);
  }

 private:
  template <class F>
  static HWY_INLINE V each(const F& f, const V& v) {
    if constexpr (wide::is_two<V>) {
      return {f(v.a), f(v.b)};
    } else {
      return f(v);
    }
  }
};

// Any optical depth: integrate's own evaluation, which costs twice as much thin and five times as much thick. `front`
// is the scalar at the front, relative to where the extinction is `extinction`.
template <class V>
HWY_INLINE Glow<V> anyDepth(const V& front, const V& change, const V& length, VF extinction, VF slope) {
  const DF d;
  const VF zero = hn::Zero(d);
  const V x = wide::Max(wide::Mul(length, wide::MulAdd(slope, front, extinction)), zero);
  const V y = wide::Max(wide::MulAdd(wide::Mul(length, slope), change, x), zero);
  const auto w = integrate::HWY_NAMESPACE::psi::weights(WideOps<V>(), x, y);
  return {w.alpha, wide::MulAdd(front, w.alpha, wide::Mul(change, w.back))};
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
