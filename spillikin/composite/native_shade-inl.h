// A vector of fragments of one cell: scalars at both ends, the absorption-emission integral, the blend. Included once
// per instruction set.

#if defined(SPILLIKIN_NATIVE_SHADE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_SHADE_INL_H
#undef SPILLIKIN_NATIVE_SHADE_INL_H
#else
#define SPILLIKIN_NATIVE_SHADE_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_centres.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// 1 / v to a few units in the last place.
HWY_INLINE VF reciprocal(VF v) {
#if HWY_ARCH_X86
  const VF r = hn::ApproximateReciprocal(v);
  return hn::MulAdd(r, hn::NegMulAdd(v, r, hn::Set(DF(), 1.0F)), r);
#else
  return hn::Div(hn::Set(DF(), 1.0F), v);
#endif
}

// One piece of the transfer function. Values are relative to its anchor.
struct PieceV {
  VF extinction, extinction_slope;
  VF red, green, blue, red_slope, green_slope, blue_slope;
  explicit HWY_INLINE PieceV(const Piece& p)
      : extinction(hn::Set(DF(), p.extinction)),
        extinction_slope(hn::Set(DF(), p.extinction_slope)),
        red(hn::Set(DF(), p.color[0])),
        green(hn::Set(DF(), p.color[1])),
        blue(hn::Set(DF(), p.color[2])),
        red_slope(hn::Set(DF(), p.color_slope[0])),
        green_slope(hn::Set(DF(), p.color_slope[1])),
        blue_slope(hn::Set(DF(), p.color_slope[2])) {}
};

// Where the rays of a vector run inside the cell: the scalar half way and half its change up to where the ray leaves,
// and the length in world units.
struct Segment {
  VF mean, half;
  VF length;
};

template <bool Parallel>
class Rays {
 public:
  HWY_INLINE Rays(const TileView& view, const CellBatch& batch, std::size_t i, float anchor)
      : x_(hn::Set(DF(), batch.at[0][i])),
        y_(hn::Set(DF(), batch.at[1][i])),
        t_(hn::Set(DF(), batch.at[2][i] - anchor)),
        apex_(hn::Set(DF(), Parallel ? -batch.apex[i] : batch.apex[i] - anchor)),
        middle_(hn::Set(DF(), batch.middle_nearness[i])),
        half_per_middle_(hn::Set(DF(), 0.5F * batch.per_middle[i])),
        z0_(hn::Set(DF(), static_cast<float>(view.screen->depths().z0))) {}

  // Lanes outside of the cell get no length and harmless values.
  HWY_INLINE Segment operator()(VF near, VF far, hn::Mask<DF> inside, VF x, VF y, VF unit) const {
    near = hn::IfThenElse(inside, near, middle_);
    far = hn::IfThenElse(inside, far, middle_);
    const VF at = hn::MulAdd(x_, x, hn::MulAdd(y_, y, t_));
    VF depth = hn::Sub(near, far);
    VF to_front = hn::Sub(middle_, near);
    VF steep = apex_;
    if constexpr (!Parallel) {
      const VF u_near = hn::Add(near, z0_);
      const VF u_far = hn::Add(far, z0_);
      const VF both = reciprocal(hn::Mul(u_near, u_far));
      to_front = hn::Mul(to_front, hn::Mul(u_far, both));
      depth = hn::Mul(depth, both);
      steep = hn::Sub(at, apex_);
    }
    const VF half_depth = hn::Mul(depth, half_per_middle_);
    return {hn::MulAdd(steep, hn::Add(to_front, half_depth), at), hn::Mul(steep, half_depth), hn::Mul(depth, unit)};
  }

 private:
  VF x_, y_, t_, apex_, middle_, half_per_middle_, z0_;
};

template <Care care>
class Shader;

// What a bend of the colour at b adds to a fragment: the ramp max(s - b, 0), weighted with the light that comes from
// each of its points. With v the share of the fragment above b, the ramp's mean is v times that over the share, its
// part in the skew that a scalar linear along the fragment has is v^2 (3 - 2 v), and its second Legendre coefficient is
// half of the scalar's change times v^2 (1 - v)^2; that of the light is alpha (m^2 - 3 d) / 60.
struct Ramps {
  VF lo, hi;
  VF half, per_change, opacity, tilt;
  HWY_INLINE Ramps(const Segment& s, VF alpha, VF skew) : opacity(alpha), tilt(skew) {
    const DF d;
    // One along which the scalar stays the same counts as one that changes by this much.
    half = hn::Max(hn::Abs(s.half), hn::Set(d, 1.25e-7F));
    lo = hn::Sub(s.mean, half);
    hi = hn::Add(s.mean, half);
    per_change = reciprocal(hn::Max(hn::Sub(hi, lo), hn::Set(d, 6e-8F)));
  }
  HWY_INLINE VF bow(VF a, VF depth, VF growth) const {
    const DF d;
    return hn::Mul(hn::Mul(hn::Mul(a, half), hn::Set(d, 1.0F / 12)),
                   hn::NegMulAdd(hn::Set(d, 3.0F), growth, hn::Mul(depth, depth)));
  }
  template <bool bowed>
  HWY_INLINE VF weight(VF at, VF bow) const {
    const DF d;
    const VF from = hn::Max(lo, hn::Min(hi, at));
    const VF share = hn::Mul(hn::Sub(hi, from), per_change);
    const VF mean = hn::Mul(share, hn::MulAdd(hn::Set(d, 0.5F), hn::Add(hi, from), hn::Neg(at)));
    const VF lean = hn::Mul(hn::Mul(share, share), hn::NegMulAdd(hn::Set(d, 2.0F), share, hn::Set(d, 3.0F)));
    const VF w = hn::MulAdd(mean, opacity, hn::Mul(tilt, lean));
    if constexpr (!bowed) return w;
    const VF even = hn::NegMulAdd(share, share, share);
    return hn::MulAdd(bow, hn::Mul(even, even), w);
  }
};

// A fragment along which extinction is linear in the scalar, and colour too, but for bends: `joints` of them, or any
// number where that is negative; with the bow of the light, or without.
template <class Series, int joints, bool bowed = true>
class StraightShader {
 public:
  explicit HWY_INLINE StraightShader(const Look& look)
      : low_(look.pieces + look.first),
        line_(*low_),
        anchor_(low_->anchor),
        count_(joints >= 0 ? joints : look.last - look.first) {}
  // What scalars are to be given relative to.
  float anchor() const { return anchor_; }

  HWY_INLINE void blend(const Segment& s, std::size_t first, Pixels& pixels) const {
    const DF d;
    const VF depth = hn::Mul(s.length, hn::MulAdd(line_.extinction_slope, s.mean, line_.extinction));
    const VF growth = hn::Mul(hn::Mul(s.length, twice_slope_), s.half);
    const VF alpha = Series::alpha(depth);
    const VF skew = hn::Mul(s.half, Series::skew(depth, depth, growth, hn::Set(d, 1.0F)));
    const VF light = hn::Load(d, pixels.light.data() + first);
    const VF a = hn::Mul(light, alpha);
    const VF tilt = hn::Mul(light, skew);
    hn::Store(hn::Sub(light, a), d, pixels.light.data() + first);
    const auto load = [&](const auto& channel) HWY_ATTR { return hn::Load(d, channel.data() + first); };
    VF red = load(pixels.red), green = load(pixels.green), blue = load(pixels.blue);
    const auto addLine = [&](const PieceV& piece, VF mean) HWY_ATTR {
      const VF tint = hn::MulAdd(mean, a, tilt);
      red = hn::MulAdd(piece.red, a, hn::MulAdd(piece.red_slope, tint, red));
      green = hn::MulAdd(piece.green, a, hn::MulAdd(piece.green_slope, tint, green));
      blue = hn::MulAdd(piece.blue, a, hn::MulAdd(piece.blue_slope, tint, blue));
    };
    if constexpr (joints == 0) {
      addLine(line_, s.mean);
    } else {
      const Ramps ramps(s, a, tilt);
      const VF bow = bowed ? ramps.bow(a, depth, growth) : hn::Zero(d);
      const auto addBend = [&](const Piece& p) HWY_ATTR {
        const VF weight = ramps.template weight<bowed>(hn::Set(d, p.end - anchor_), bow);
        red = hn::MulAdd(hn::Set(d, p.kink[0]), weight, red);
        green = hn::MulAdd(hn::Set(d, p.kink[1]), weight, green);
        blue = hn::MulAdd(hn::Set(d, p.kink[2]), weight, blue);
      };
      if constexpr (joints > 0) {
        addLine(line_, s.mean);
        for (int k = 0; k < joints; ++k)
          addBend(low_[k]);
      } else {
        // From the piece of the lowest lane to that of the highest.
        std::int32_t k = 0;
        while (k < count_ && hn::AllTrue(d, hn::Ge(ramps.lo, hn::Set(d, low_[k].end - anchor_))))
          ++k;
        addLine(PieceV(low_[k]), hn::Add(s.mean, hn::Set(d, anchor_ - low_[k].anchor)));
        for (; k < count_ && !hn::AllTrue(d, hn::Le(ramps.hi, hn::Set(d, low_[k].end - anchor_))); ++k)
          addBend(low_[k]);
      }
    }
    hn::Store(red, d, pixels.red.data() + first);
    hn::Store(green, d, pixels.green.data() + first);
    hn::Store(blue, d, pixels.blue.data() + first);
  }

 private:
  const Piece* low_;
  PieceV line_;
  VF twice_slope_ = hn::Add(line_.extinction_slope, line_.extinction_slope);
  float anchor_;
  std::int32_t count_;
};

template <>
class Shader<Care::none> : public StraightShader<ThinSeries, 0> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

template <>
class Shader<Care::bend> : public StraightShader<ThinSeries, 1, false> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

template <>
class Shader<Care::bends> : public StraightShader<ThinSeries, -1> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

template <>
class Shader<Care::long_bends> : public StraightShader<ForwardSeries, -1> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

// A segment from its low end to its high one, whichever way the ray runs.
struct Rising {
  VF lo, hi;
  VF twice_rate;  // twice the length for each unit of the scalar
  VF sign;        // -1 where the scalar falls along the ray
  hn::Mask<DF> up;
  explicit HWY_INLINE Rising(const Segment& s) {
    const DF d;
    // One along which the scalar stays the same counts as one that rises by this much.
    const VF half = hn::Max(hn::Abs(s.half), hn::Set(d, 1.25e-7F));
    lo = hn::Sub(s.mean, half);
    hi = hn::Add(s.mean, half);
    // From the ends as rounded: the lengths of the parts must add up. (Lanes outside of the cell may lie anywhere.)
    const VF change = hn::Max(hn::Sub(hi, lo), hn::Set(d, 6e-8F));
    twice_rate = hn::Mul(hn::Add(s.length, s.length), reciprocal(change));
    up = hn::Ge(s.half, hn::Zero(d));
    // From the comparison, not from the sign bit: a change of -0 rises.
    sign = hn::IfThenElse(up, hn::Set(d, 1.0F), hn::Set(d, -1.0F));
  }
};

// The part of a thin segment between two values, in one piece of the transfer function. With f the light at the low end
// of the part and f' at its high end, the part's opacity times its light is |f' - f|; where the scalar falls along the
// ray, light is counted from the far end and grows. Returns f'.
template <class Series>
HWY_INLINE VF part(const Rising& r, const PieceV& piece, VF anchor, VF from, VF to, VF f, VF& opacity, VF& tint) {
  const DF d;
  const VF half = hn::Mul(hn::Sub(to, from), hn::Set(d, 0.5F));
  const VF mean = hn::Sub(hn::Add(from, half), anchor);
  const VF length = hn::Mul(r.twice_rate, half);
  const VF depth = hn::Mul(length, hn::MulAdd(piece.extinction_slope, mean, piece.extinction));
  const VF growth = hn::Mul(hn::Mul(length, piece.extinction_slope), hn::Add(half, half));
  const VF signed_depth = hn::Mul(depth, r.sign);
  const VF fading = hn::Mul(f, Series::alpha(signed_depth));
  const VF after = hn::Sub(f, fading);
  opacity = hn::Abs(fading);  // not from f and f', whose difference has lost digits where the part is thin
  const VF light = hn::IfThenElse(r.up, f, after);
  tint = hn::MulAdd(mean, opacity, hn::Mul(hn::Mul(light, half), Series::skew(depth, signed_depth, growth, r.sign)));
  return after;
}

// Blends a segment whose parts have been gathered from low to high: counted from the far end, f has grown to 1 / (the
// light that comes through).
HWY_INLINE void finish(const Rising& r, VF f, VF red, VF green, VF blue, std::size_t first, Pixels& pixels) {
  const DF d;
  const VF inverse = reciprocal(f);
  const VF light = hn::Load(d, pixels.light.data() + first);
  const VF scale = hn::IfThenElse(r.up, light, hn::Mul(light, inverse));
  const auto add = [&](auto& channel, VF value) HWY_ATTR {
    float* p = channel.data() + first;
    hn::Store(hn::MulAdd(scale, value, hn::Load(d, p)), d, p);
  };
  add(pixels.red, red);
  add(pixels.green, green);
  add(pixels.blue, blue);
  hn::Store(hn::Mul(light, hn::IfThenElse(r.up, f, inverse)), d, pixels.light.data() + first);
}

// A thin fragment of a cell that reaches over two pieces: both parts at once, no branches.
template <>
class Shader<Care::cut> {
 public:
  explicit HWY_INLINE Shader(const Look& look)
      : low_(look.pieces[look.first]),
        high_(look.pieces[look.last]),
        cut_(hn::Set(DF(), look.pieces[look.first].end)),
        low_anchor_(hn::Set(DF(), look.pieces[look.first].anchor)),
        high_anchor_(hn::Set(DF(), look.pieces[look.last].anchor)) {}
  float anchor() const { return 0.0F; }

  HWY_INLINE void blend(const Segment& s, std::size_t first, Pixels& pixels) const {
    const DF d;
    const Rising r(s);
    const VF cut = hn::Max(r.lo, hn::Min(r.hi, cut_));
    VF a0, t0, a1, t1;
    VF f = part<ThinSeries>(r, low_, low_anchor_, r.lo, cut, hn::Set(d, 1.0F), a0, t0);
    f = part<ThinSeries>(r, high_, high_anchor_, cut, r.hi, f, a1, t1);
    const auto mix = [&](VF b0, VF s0, VF b1, VF s1) HWY_ATTR {
      return hn::MulAdd(b0, a0, hn::MulAdd(s0, t0, hn::MulAdd(b1, a1, hn::Mul(s1, t1))));
    };
    finish(r, f, mix(low_.red, low_.red_slope, high_.red, high_.red_slope),
           mix(low_.green, low_.green_slope, high_.green, high_.green_slope),
           mix(low_.blue, low_.blue_slope, high_.blue, high_.blue_slope), first, pixels);
  }

 private:
  PieceV low_, high_;
  VF cut_, low_anchor_, high_anchor_;
};

// A fragment of a cell that reaches over several pieces, or is not so thin.
template <class Series>
class PiecewiseShader {
 public:
  explicit HWY_INLINE PiecewiseShader(const Look& look) : pieces_(look.pieces), first_(look.first), last_(look.last) {}
  float anchor() const { return 0.0F; }

  HWY_INLINE void blend(const Segment& s, std::size_t first, Pixels& pixels) const {
    const DF d;
    const Rising r(s);
    VF red = hn::Zero(d), green = hn::Zero(d), blue = hn::Zero(d);
    VF f = hn::Set(d, 1.0F);
    VF from = r.lo;
    for (std::int32_t k = first_; k <= last_; ++k) {
      // The outermost pieces take whatever rounding has left over.
      VF to = r.hi;
      if (k < last_) to = hn::Max(r.lo, hn::Min(r.hi, hn::Set(d, pieces_[k].end)));
      if (hn::AllTrue(d, hn::Eq(from, to))) continue;
      const PieceV piece(pieces_[k]);
      VF a, t;
      f = part<Series>(r, piece, hn::Set(d, pieces_[k].anchor), from, to, f, a, t);
      from = to;
      red = hn::MulAdd(piece.red, a, hn::MulAdd(piece.red_slope, t, red));
      green = hn::MulAdd(piece.green, a, hn::MulAdd(piece.green_slope, t, green));
      blue = hn::MulAdd(piece.blue, a, hn::MulAdd(piece.blue_slope, t, blue));
    }
    finish(r, f, red, green, blue, first, pixels);
  }

 private:
  const Piece* pieces_;
  std::int32_t first_, last_;
};

template <>
class Shader<Care::cuts> : public PiecewiseShader<ThinSeries> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : PiecewiseShader(look) {}
};

template <>
class Shader<Care::deep> : public PiecewiseShader<DeepSeries> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : PiecewiseShader(look) {}
};

// Any fragment: cut where it passes from one piece of the transfer function to the next, each part at any depth.
template <>
class Shader<Care::full> {
 public:
  explicit HWY_INLINE Shader(const Look& look)
      : pieces_(look.pieces),
        first_(look.first),
        last_(look.last),
        lo_(hn::Set(DF(), look.lo)),
        hi_(hn::Set(DF(), look.hi)) {}
  float anchor() const { return 0.0F; }

  HWY_INLINE void blend(const Segment& s, std::size_t first, Pixels& pixels) const {
    const DF d;
    const VF front = hn::Clamp(hn::Sub(s.mean, s.half), lo_, hi_);
    const VF back = hn::Clamp(hn::Add(s.mean, s.half), lo_, hi_);
    const VF whole_change = hn::Sub(back, front);
    VF red = hn::Zero(d), green = hn::Zero(d), blue = hn::Zero(d);
    VF clear = hn::Set(d, 1.0F);
    const auto up = hn::Ge(whole_change, hn::Zero(d));
    const auto flat = hn::Eq(whole_change, hn::Zero(d));
    const VF per_change = hn::Div(hn::Set(d, 1.0F), whole_change);
    for (std::int32_t k = first_; k <= last_; ++k) {
      // The part of the segment in piece k; the outermost pieces take whatever rounding has left over.
      const VF begin = hn::Set(d, k == first_ ? -std::numeric_limits<float>::max() : pieces_[k - 1].end);
      const VF end = hn::Set(d, k == last_ ? std::numeric_limits<float>::max() : pieces_[k].end);
      const VF from = hn::Clamp(front, begin, end);
      const VF to = hn::Clamp(back, begin, end);
      const VF change = hn::Sub(to, from);
      const auto here = hn::And(hn::Ge(front, begin), hn::Lt(front, end));
      const VF share = hn::IfThenElse(flat, hn::IfThenElseZero(here, hn::Set(d, 1.0F)), hn::Mul(change, per_change));
      if (hn::AllTrue(d, hn::Eq(share, hn::Zero(d)))) continue;
      const PieceV piece(pieces_[k]);
      const VF anchor = hn::Set(d, pieces_[k].anchor);
      const Glow glow =
          anyDepth(hn::Sub(from, anchor), change, hn::Mul(share, s.length), piece.extinction, piece.extinction_slope);
      // Towards higher values this part lies behind what has been gathered, towards lower ones before it.
      const VF through = hn::Sub(hn::Set(d, 1.0F), glow.alpha);
      const VF mine = hn::IfThenElse(up, clear, hn::Set(d, 1.0F));
      const VF others = hn::IfThenElse(up, hn::Set(d, 1.0F), through);
      const VF a = hn::Mul(mine, glow.alpha);
      const VF t = hn::Mul(mine, glow.tint);
      red = hn::MulAdd(piece.red, a, hn::MulAdd(piece.red_slope, t, hn::Mul(red, others)));
      green = hn::MulAdd(piece.green, a, hn::MulAdd(piece.green_slope, t, hn::Mul(green, others)));
      blue = hn::MulAdd(piece.blue, a, hn::MulAdd(piece.blue_slope, t, hn::Mul(blue, others)));
      clear = hn::Mul(clear, through);
    }
    const VF light = hn::Load(d, pixels.light.data() + first);
    const auto add = [&](auto& channel, VF value) HWY_ATTR {
      float* p = channel.data() + first;
      hn::Store(hn::MulAdd(light, value, hn::Load(d, p)), d, p);
    };
    add(pixels.red, red);
    add(pixels.green, green);
    add(pixels.blue, blue);
    hn::Store(hn::Mul(light, clear), d, pixels.light.data() + first);
  }

 private:
  const Piece* pieces_;
  std::int32_t first_, last_;
  VF lo_, hi_;
};

// The largest scalar, gathered as red where rays meet the cell; light says where they do.
template <>
class Shader<Care::peak> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : lo_(hn::Set(DF(), look.lo)), hi_(hn::Set(DF(), look.hi)) {}
  float anchor() const { return 0.0F; }

  HWY_INLINE void blend(const Segment& s, std::size_t first, Pixels& pixels) const {
    const DF d;
    const auto some = hn::Gt(s.length, hn::Zero(d));
    const VF peak = hn::IfThenElseZero(some, hn::Clamp(hn::Add(s.mean, hn::Abs(s.half)), lo_, hi_));
    float* red = pixels.red.data() + first;
    float* light = pixels.light.data() + first;
    hn::Store(hn::Max(hn::Load(d, red), peak), d, red);
    hn::Store(hn::IfThenZeroElse(some, hn::Load(d, light)), d, light);
  }

 private:
  VF lo_, hi_;
};

// Calls f with a care as a constant, std::integral_constant<Care, care>, so that what f calls is made for it. Edge-on
// cells take full care.
template <class F>
HWY_INLINE std::size_t withCare(Care care, const F& f) {
  switch (care) {
    case Care::none:
      return f(std::integral_constant<Care, Care::none>());
    case Care::bend:
      return f(std::integral_constant<Care, Care::bend>());
    case Care::bends:
      return f(std::integral_constant<Care, Care::bends>());
    case Care::long_bends:
      return f(std::integral_constant<Care, Care::long_bends>());
    case Care::cut:
      return f(std::integral_constant<Care, Care::cut>());
    case Care::cuts:
      return f(std::integral_constant<Care, Care::cuts>());
    case Care::deep:
      return f(std::integral_constant<Care, Care::deep>());
    case Care::peak:
      return f(std::integral_constant<Care, Care::peak>());
    case Care::full:
    case Care::edge_on:
      break;
  }
  return f(std::integral_constant<Care, Care::full>());
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
