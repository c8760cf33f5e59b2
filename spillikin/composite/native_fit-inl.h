// The colour over a small cell's range of the scalar as a polynomial. Where it bends once, a line or a parabola stands
// for it if that errs by no more than fit_left_out anywhere in the range: what a fragment's opacity is multiplied with
// errs by no more. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_FIT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_FIT_INL_H
#undef SPILLIKIN_NATIVE_FIT_INL_H
#else
#define SPILLIKIN_NATIVE_FIT_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_looks-inl.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// The ramp max(t - bend, 0) over [-1, 1] as at + slope t + curve t^2, and the most that it errs by.
struct RampFit {
  VF at, slope, curve, error;
};

// The line of least error.
HWY_INLINE RampFit lineForRamp(VF bend) {
  const DF d;
  const VF above = hn::Sub(hn::Set(d, 1.0F), bend);
  const VF half = hn::Mul(above, hn::Set(d, 0.5F));
  return {hn::Mul(half, half), half, hn::Zero(d), hn::Mul(half, hn::MulAdd(bend, hn::Set(d, 0.5F), hn::Set(d, 0.5F)))};
}

// Within 3 % of the parabola of least error (at most 0.0902 with the bend at 0.53); the error is a bound.
HWY_INLINE RampFit parabolaForRamp(VF bend) {
  const DF d;
  const VF u = hn::Abs(bend), one = hn::Set(d, 1.0F);
  const VF above = hn::Sub(one, u);
  const VF at = hn::Mul(above, polynomial(u, {0.0621F, -0.3581F, 0.0286F, -0.2371F}));
  const VF slope = hn::Mul(hn::Mul(above, above), polynomial(u, {0.5006F, -0.0321F, 0.7190F, -0.1954F}));
  const VF curve = hn::Mul(hn::NegMulAdd(u, u, one), polynomial(u, {0.4985F, -0.4686F, 0.8469F, -0.4018F}));
  // max(t + u, 0) = t + u + max(-t - u, 0)
  const auto low = hn::Lt(bend, hn::Zero(d));
  return {hn::IfThenElse(low, hn::Add(at, u), at), hn::IfThenElse(low, hn::Sub(one, slope), slope), curve,
          hn::Mul(above, polynomial(u, {0.0637F, 0.2902F, -0.3868F, 0.5873F}))};
}

// Which cells from i on a polynomial does for, and how far it may be from the colour where one does.
struct Fits {
  hn::Mask<DF> line, parabola;
  VF left_out;
};

// Sets the colours and the extinction of the cells from i on. Where they do not bend, or no polynomial does, they are
// those of the first piece.
HWY_INLINE Fits setColors(const Screen& screen, const Looks& looks, std::size_t i, CellBatch& batch) {
  const DF d;
  const DIF di;
  const PieceNumbers number(screen, hn::Load(di, batch.first_piece + i));
  const auto set = [](float v) HWY_ATTR { return hn::Set(DF(), v); };
  const VF lo = hn::Load(d, batch.lo + i);
  const VF half = hn::Mul(looks.range, set(0.5F));
  const VF amid = hn::Add(lo, half);
  VF kink[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  RampFit fit{hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  Fits fits{hn::MaskFromVec(hn::Zero(d)), hn::MaskFromVec(hn::Zero(d)), hn::Zero(d)};
  const auto one = hn::RebindMask(d, hn::Eq(looks.bends, hn::Set(di, 1)));
  if (!hn::AllFalse(d, one)) {
    for (std::size_t c = 0; c < 3; ++c)
      kink[c] = number(offsetof(Piece, kink) + c * sizeof(float));
    const VF per_half = hn::Div(set(1.0F), hn::Max(half, set(1e-30F)));
    const VF bend = hn::Clamp(hn::Mul(hn::Sub(number(offsetof(Piece, end)), amid), per_half), set(-1.0F), set(1.0F));
    const VF most = hn::Mul(hn::Max(hn::Abs(kink[0]), hn::Max(hn::Abs(kink[1]), hn::Abs(kink[2]))), half);
    const RampFit line = lineForRamp(bend), parabola = parabolaForRamp(bend);
    const auto within = [&](VF error)
                            HWY_ATTR { return hn::And(one, hn::Le(hn::Mul(error, most), set(fit_left_out))); };
    fits.line = within(line.error);
    fits.parabola = hn::AndNot(fits.line, within(parabola.error));
    const auto either = [&](VF a, VF b)
                            HWY_ATTR { return hn::IfThenElse(fits.line, a, hn::IfThenElseZero(fits.parabola, b)); };
    fits.left_out = hn::Mul(most, either(line.error, parabola.error));
    fit.at = hn::Mul(half, either(line.at, parabola.at));
    fit.slope = either(line.slope, parabola.slope);
    fit.curve = hn::Mul(per_half, hn::IfThenElseZero(fits.parabola, parabola.curve));
  }
  const VF beyond = hn::Sub(amid, number(offsetof(Piece, anchor)));
  hn::Store(amid, d, batch.amid + i);
  for (std::size_t c = 0; c < 3; ++c) {
    const VF slope = number(offsetof(Piece, color_slope) + c * sizeof(float));
    const VF color = hn::MulAdd(slope, beyond, number(offsetof(Piece, color) + c * sizeof(float)));
    hn::Store(hn::MulAdd(kink[c], fit.at, color), d, batch.color[c] + i);
    hn::Store(hn::MulAdd(kink[c], fit.slope, slope), d, batch.color_slope[c] + i);
    hn::Store(hn::Mul(kink[c], fit.curve), d, batch.color_curve[c] + i);
  }
  hn::Store(hn::Mul(set(0.5F), hn::Add(looks.at_lo, looks.at_hi)), d, batch.extinction + i);
  hn::Store(looks.extinction_slope, d, batch.extinction_slope + i);
  return fits;
}

// The colour of fragments.
template <class V>
struct Tint {
  V red, green, blue;
  HWY_INLINE void add(const V& weight, VF r, VF g, VF b) {
    red = wide::MulAdd(r, weight, red);
    green = wide::MulAdd(g, weight, green);
    blue = wide::MulAdd(b, weight, blue);
  }
};

// The pixels' colours while a fragment is added to them.
template <class V>
struct Light {
  V red, green, blue;
  template <class At>
  HWY_INLINE Light(const Pixels& pixels, const At& first)
      : red(wide::load(pixels.red.data(), first)),
        green(wide::load(pixels.green.data(), first)),
        blue(wide::load(pixels.blue.data(), first)) {}
  // Outside of the cell, the tint may be no number.
  template <class M>
  HWY_INLINE void add(const Tint<V>& tint, const V& opacity, const M& inside) {
    red = wide::IfThenElse(inside, wide::MulAdd(tint.red, opacity, red), red);
    green = wide::IfThenElse(inside, wide::MulAdd(tint.green, opacity, green), green);
    blue = wide::IfThenElse(inside, wide::MulAdd(tint.blue, opacity, blue), blue);
  }
  template <class At>
  HWY_INLINE void store(const At& first, Pixels& pixels) const {
    wide::store(red, pixels.red.data(), first);
    wide::store(green, pixels.green.data(), first);
    wide::store(blue, pixels.blue.data(), first);
  }
};

// The mean of the square over [-h, h] is h^2 / 3.
constexpr float third_per_half = 0.57735027F;

// A small cell's polynomials, spread over vectors.
template <bool curved>
class Colors {
 public:
  HWY_INLINE Colors(const CellBatch& batch, std::size_t i) {
    const auto set = [i](const auto& values) HWY_ATTR { return hn::Set(DF(), values[i]); };
    extinction_ = set(batch.extinction);
    extinction_slope_ = set(batch.extinction_slope);
    for (std::size_t c = 0; c < 3; ++c) {
      color_[c] = set(batch.color[c]);
      slope_[c] = set(batch.color_slope[c]);
      if constexpr (curved) curve_[c] = set(batch.color_curve[c]);
    }
  }

  template <class V>
  HWY_INLINE V extinction(const V& value) const {
    return wide::MulAdd(extinction_slope_, value, extinction_);
  }

  // Of a fragment with the scalar `value` half way, up to where it changes by `third` / third_per_half.
  template <class V>
  HWY_INLINE Tint<V> tint(const V& value, const V& third) const {
    const auto at = [&](std::size_t c) HWY_ATTR { return wide::MulAdd(value, slope_[c], color_[c]); };
    Tint<V> tint{at(0), at(1), at(2)};
    if constexpr (curved)
      tint.add(wide::MulAdd(value, value, wide::Mul(third, third)), curve_[0], curve_[1], curve_[2]);
    return tint;
  }

 private:
  VF extinction_, extinction_slope_, color_[3], slope_[3], curve_[3];
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
