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
#include "spillikin/composite/native_crossing-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

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
template <class V>
struct SegmentOf {
  V mean, half;
  V length;

  // With the scalar kept within bounds.
  HWY_INLINE SegmentOf within(VF lo, VF hi) const {
    const VF by_two = hn::Set(DF(), 0.5F);
    const V front = wide::Clamp(wide::Sub(mean, half), lo, hi), back = wide::Clamp(wide::Add(mean, half), lo, hi);
    return {wide::Mul(wide::Add(front, back), by_two), wide::Mul(wide::Sub(back, front), by_two), length};
  }
};
using Segment = SegmentOf<VF>;

template <bool Parallel>
class Rays {
 public:
  HWY_INLINE Rays(const TileView& view, const CellBatch& batch, std::size_t i, float anchor)
      : apex_(hn::Set(DF(), Parallel ? -batch.apex[i] : batch.apex[i] - anchor)),
        middle_(hn::Set(DF(), batch.middle_nearness[i])),
        half_per_middle_(hn::Set(DF(), batch.half_per_middle[i])),
        z0_(hn::Set(DF(), view.z0)) {}

  // Lanes outside of the cell get no length, no change and a harmless scalar, whatever near and far are there.
  template <class V, class M>
  HWY_INLINE SegmentOf<V> operator()(const Crossed<V>& ray, const M& inside, const V& unit) const {
    const V &near = ray.near, &far = ray.far, &at = ray.at;
    const V extent = wide::Sub(near, far);
    const V to_front = wide::Sub(middle_, near);
    if constexpr (Parallel) {
      const V half_depth = wide::Mul(extent, half_per_middle_);
      const V mean = wide::MulAdd(apex_, wide::Add(to_front, half_depth), at);
      return {wide::IfThenElseZero(inside, mean), wide::IfThenElseZero(inside, wide::Mul(apex_, half_depth)),
              wide::IfThenElseZero(inside, wide::Mul(extent, unit))};
    } else {
      const V u_near = wide::Add(near, z0_);
      const V u_far = wide::Add(far, z0_);
      const V both = reciprocal(wide::Mul(u_near, u_far));
      const V depth = wide::Mul(extent, both);
      const V steep = wide::Sub(at, apex_);
      const V half_depth = wide::Mul(depth, half_per_middle_);
      const V to_middle = wide::MulAdd(wide::Mul(to_front, u_far), both, half_depth);
      return {wide::IfThenElseZero(inside, wide::MulAdd(steep, to_middle, at)),
              wide::IfThenElseZero(inside, wide::Mul(steep, half_depth)),
              wide::IfThenElseZero(inside, wide::Mul(depth, unit))};
    }
  }

 private:
  VF apex_, middle_, half_per_middle_, z0_;
};

template <Care care>
class Shader;

// As a number of bends.
inline constexpr int any_bends = -1;

// The scalar along fragments, from low to high whichever way the ray runs, and what of it lies beyond a bend of the
// colour.
template <class V>
struct Reach {
  V half, lo, hi, per_change;
  HWY_INLINE Reach(const V& mean, const V& half_change) {
    const DF d;
    // One along which the scalar stays the same counts as one that changes by this much.
    half = wide::Max(wide::Abs(half_change), hn::Set(d, 1.25e-7F));
    lo = wide::Sub(mean, half);
    hi = wide::Add(mean, half);
    per_change = wide::ApproximateReciprocal(wide::Add(half, half));
  }
  // The share of a fragment beyond a bend that its high end is so far above.
  HWY_INLINE V share(const V& above) const {
    const DF d;
    return wide::Min(wide::Max(wide::Mul(above, per_change), hn::Zero(d)), hn::Set(d, 1.0F));
  }
};

// The pieces of the transfer function that a cell shows, where it shows many: its fragments lie in few of them.
class PieceRun {
 public:
  // The first and how many joints follow; ends are wanted relative to an anchor.
  HWY_INLINE PieceRun(const Piece* first, std::int32_t joints, float anchor)
      : pieces_(first), joints_(joints), anchor_(anchor) {}

  // Calls begin(piece) with that of the lowest lane inside of the cell, and bend(piece, end) for it and those that
  // follow, up to that before the highest lane's.
  template <class V, class M, class Begin, class Bend>
  HWY_INLINE void operator()(const Reach<V>& reach, const M& inside, const Begin& begin, const Bend& bend) const {
    const auto all = [&](const auto& where) HWY_ATTR { return wide::AllFalse(wide::AndNot(where, inside)); };
    const auto beyond = [&](std::int32_t k) HWY_ATTR { return all(wide::Ge(reach.lo, hn::Set(DF(), end(k)))); };
    // Those of the next vectors are likely to be the same.
    std::int32_t k = lowest_;
    while (k > 0 && !beyond(k - 1))
      --k;
    while (k < joints_ && beyond(k))
      ++k;
    lowest_ = k;
    begin(pieces_[k]);
    for (; k < joints_ && !all(wide::Le(reach.hi, hn::Set(DF(), end(k)))); ++k)
      bend(pieces_[k], end(k));
  }

 private:
  HWY_INLINE float end(std::int32_t k) const { return pieces_[k].end - anchor_; }

  const Piece* pieces_;
  std::int32_t joints_;
  float anchor_;
  mutable std::int32_t lowest_ = 0;
};

// What a bend of the colour at b adds to a fragment: the ramp max(s - b, 0), weighted with the light that comes from
// each of its points. With v the share of the fragment above b, the ramp's mean is v times that over the share, its
// part in the skew that a scalar linear along the fragment has is v^2 (3 - 2 v), and its second Legendre coefficient is
// half of the scalar's change times v^2 (1 - v)^2; that of the light is alpha (m^2 - 3 d) / 60. All of that is v times
// a polynomial of v whose coefficients are the fragment's, but for how far its high end is above b.
template <class V>
class Ramps {
 public:
  Reach<V> reach;
  // Without the light's bow.
  HWY_INLINE Ramps(const SegmentOf<V>& s, const V& opacity, const V& tilt)
      : reach(s.mean, s.half),
        opacity_(opacity),
        once_(wide::NegMulAdd(opacity, reach.half, wide::Mul(tilt, hn::Set(DF(), 3.0F)))),
        twice_(wide::Mul(tilt, hn::Set(DF(), -2.0F))) {}
  // With it; the fragment's optical depth, and how that grows.
  HWY_INLINE Ramps(const SegmentOf<V>& s, const V& opacity, const V& tilt, const V& depth, const V& growth)
      : Ramps(s, opacity, tilt) {
    const DF d;
    bow_ = wide::Mul(wide::Mul(wide::Mul(opacity, reach.half), hn::Set(d, 1.0F / 12)),
                     wide::NegMulAdd(hn::Set(d, 3.0F), growth, wide::Mul(depth, depth)));
    once_ = wide::Add(once_, bow_);
    twice_ = wide::NegMulAdd(hn::Set(d, 2.0F), bow_, twice_);
  }

  template <bool bowed>
  HWY_INLINE V weight(VF at) const {
    const V above = wide::Sub(reach.hi, at);
    const V share = reach.share(above);
    const V second = bowed ? wide::MulAdd(bow_, share, twice_) : twice_;
    const V first = wide::MulAdd(second, share, once_);
    return wide::Mul(share, wide::MulAdd(first, share, wide::Mul(opacity_, above)));
  }

 private:
  V opacity_, once_, twice_, bow_;
};

// A fragment along which extinction is linear in the scalar, and colour too, but for bends: `joints` of them, or
// any_bends; with the bow of the light, or without.
template <class Series, int joints, bool bowed = true>
class StraightShader {
 public:
  explicit HWY_INLINE StraightShader(const Look& look)
      : low_(look.pieces + look.first),
        line_(*low_),
        anchor_(low_->anchor),
        run_(low_, look.last - look.first, anchor_) {}
  // What scalars are to be given relative to.
  float anchor() const { return anchor_; }

  template <class V, class At>
  HWY_INLINE void blend(const SegmentOf<V>& s, const At& first, Pixels& pixels) const {
    const DF d;
    const V depth = wide::Mul(s.length, wide::MulAdd(line_.extinction_slope, s.mean, line_.extinction));
    const V growth = wide::Mul(wide::Mul(s.length, twice_slope_), s.half);
    const V alpha = Series::alpha(depth);
    const V skew = wide::Mul(s.half, Series::skew(depth, depth, growth, hn::Set(d, 1.0F)));
    const V light = wide::load(pixels.light.data(), first);
    const V a = wide::Mul(light, alpha);
    const V tilt = wide::Mul(light, skew);
    wide::store(wide::Sub(light, a), pixels.light.data(), first);
    const auto load = [&](const auto& channel) HWY_ATTR { return wide::load(channel.data(), first); };
    V red = load(pixels.red), green = load(pixels.green), blue = load(pixels.blue);
    const auto addLine = [&](const PieceV& piece, const V& mean) HWY_ATTR {
      const V tint = wide::MulAdd(mean, a, tilt);
      red = wide::MulAdd(piece.red, a, wide::MulAdd(piece.red_slope, tint, red));
      green = wide::MulAdd(piece.green, a, wide::MulAdd(piece.green_slope, tint, green));
      blue = wide::MulAdd(piece.blue, a, wide::MulAdd(piece.blue_slope, tint, blue));
    };
    if constexpr (joints == 0) {
      addLine(line_, s.mean);
    } else {
      const auto ramps = bowed ? Ramps<V>(s, a, tilt, depth, growth) : Ramps<V>(s, a, tilt);
      const auto addBend = [&](const Piece& p, float end) HWY_ATTR {
        const V weight = ramps.template weight<bowed>(hn::Set(d, end));
        red = wide::MulAdd(hn::Set(d, p.kink[0]), weight, red);
        green = wide::MulAdd(hn::Set(d, p.kink[1]), weight, green);
        blue = wide::MulAdd(hn::Set(d, p.kink[2]), weight, blue);
      };
      if constexpr (joints > 0) {
        addLine(line_, s.mean);
        for (int k = 0; k < joints; ++k)
          addBend(low_[k], low_[k].end - anchor_);
      } else {
        const auto begin = [&](const Piece& p)
                               HWY_ATTR { addLine(PieceV(p), wide::Add(s.mean, hn::Set(d, anchor_ - p.anchor))); };
        run_(ramps.reach, wide::Gt(s.length, hn::Zero(d)), begin, addBend);
      }
    }
    wide::store(red, pixels.red.data(), first);
    wide::store(green, pixels.green.data(), first);
    wide::store(blue, pixels.blue.data(), first);
  }

 private:
  const Piece* low_;
  PieceV line_;
  VF twice_slope_ = wide::Add(line_.extinction_slope, line_.extinction_slope);
  float anchor_;
  PieceRun run_;
};

template <>
class Shader<Care::none> : public StraightShader<ShortSeries, 0> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

template <>
class Shader<Care::bend> : public StraightShader<ShortSeries, 1, false> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

template <>
class Shader<Care::bends> : public StraightShader<ShortSeries, any_bends> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

template <>
class Shader<Care::long_bends> : public StraightShader<ForwardSeries, any_bends> {
 public:
  explicit HWY_INLINE Shader(const Look& look) : StraightShader(look) {}
};

// A segment from its low end to its high one, whichever way the ray runs.
template <class V>
struct Rising {
  V lo, hi;
  V twice_rate;  // twice the length for each unit of the scalar
  V sign;        // -1 where the scalar falls along the ray
  decltype(wide::Ge(V(), V())) up;
  explicit HWY_INLINE Rising(const SegmentOf<V>& s) {
    const DF d;
    // One along which the scalar stays the same counts as one that rises by this much.
    const V half = wide::Max(wide::Abs(s.half), hn::Set(d, 1.25e-7F));
    lo = wide::Sub(s.mean, half);
    hi = wide::Add(s.mean, half);
    // From the ends as rounded: the lengths of the parts must add up. (Lanes outside of the cell may lie anywhere.)
    const V change = wide::Max(wide::Sub(hi, lo), hn::Set(d, 6e-8F));
    twice_rate = wide::Mul(wide::Add(s.length, s.length), reciprocal(change));
    up = wide::Ge(s.half, hn::Zero(d));
    // From the comparison, not from the sign bit: a change of -0 rises.
    sign = wide::IfThenElse(up, hn::Set(d, 1.0F), hn::Set(d, -1.0F));
  }
};

// The part of a thin segment between two values, in one piece of the transfer function. With f the light at the low end
// of the part and f' at its high end, the part's opacity times its light is |f' - f|; where the scalar falls along the
// ray, light is counted from the far end and grows. Returns f'.
template <class Series, class V>
HWY_INLINE V part(const Rising<V>& r, const PieceV& piece, VF anchor, const V& from, const V& to, const V& f,
                  V& opacity, V& tint) {
  const DF d;
  const V half = wide::Mul(wide::Sub(to, from), hn::Set(d, 0.5F));
  const V mean = wide::Sub(wide::Add(from, half), anchor);
  const V length = wide::Mul(r.twice_rate, half);
  const V depth = wide::Mul(length, wide::MulAdd(piece.extinction_slope, mean, piece.extinction));
  const V growth = wide::Mul(wide::Mul(length, piece.extinction_slope), wide::Add(half, half));
  const V signed_depth = wide::Mul(depth, r.sign);
  const V fading = wide::Mul(f, Series::alpha(signed_depth));
  const V after = wide::Sub(f, fading);
  opacity = wide::Abs(fading);  // not from f and f', whose difference has lost digits where the part is thin
  const V light = wide::IfThenElse(r.up, f, after);
  tint =
      wide::MulAdd(mean, opacity, wide::Mul(wide::Mul(light, half), Series::skew(depth, signed_depth, growth, r.sign)));
  return after;
}

// Blends a segment whose parts have been gathered from low to high: counted from the far end, f has grown to 1 / (the
// light that comes through).
template <class V, class At>
HWY_INLINE void finish(const Rising<V>& r, const V& f, const V& red, const V& green, const V& blue, const At& first,
                       Pixels& pixels) {
  const V inverse = reciprocal(f);
  const V light = wide::load(pixels.light.data(), first);
  const V scale = wide::IfThenElse(r.up, light, wide::Mul(light, inverse));
  const auto add = [&](auto& channel, const V& value) HWY_ATTR {
    wide::store(wide::MulAdd(scale, value, wide::load(channel.data(), first)), channel.data(), first);
  };
  add(pixels.red, red);
  add(pixels.green, green);
  add(pixels.blue, blue);
  wide::store(wide::Mul(light, wide::IfThenElse(r.up, f, inverse)), pixels.light.data(), first);
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

  template <class V, class At>
  HWY_INLINE void blend(const SegmentOf<V>& s, const At& first, Pixels& pixels) const {
    const DF d;
    const Rising<V> r(s);
    const V cut = wide::Max(r.lo, wide::Min(r.hi, cut_));
    V a0, t0, a1, t1;
    V f = part<ThinSeries>(r, low_, low_anchor_, r.lo, cut, wide::same<V>(hn::Set(d, 1.0F)), a0, t0);
    f = part<ThinSeries>(r, high_, high_anchor_, cut, r.hi, f, a1, t1);
    const auto mix = [&](const VF& b0, const VF& s0, const VF& b1, const VF& s1) HWY_ATTR {
      return wide::MulAdd(b0, a0, wide::MulAdd(s0, t0, wide::MulAdd(b1, a1, wide::Mul(s1, t1))));
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

  template <class V, class At>
  HWY_INLINE void blend(const SegmentOf<V>& s, const At& first, Pixels& pixels) const {
    const DF d;
    const Rising<V> r(s);
    V red = wide::same<V>(hn::Zero(d)), green = red, blue = red;
    V f = wide::same<V>(hn::Set(d, 1.0F));
    V from = r.lo;
    for (std::int32_t k = first_; k <= last_; ++k) {
      // The outermost pieces take whatever rounding has left over.
      V to = r.hi;
      if (k < last_) to = wide::Max(r.lo, wide::Min(r.hi, hn::Set(d, pieces_[k].end)));
      if (wide::AllTrue(wide::Eq(from, to))) continue;
      const PieceV piece(pieces_[k]);
      V a, t;
      f = part<Series>(r, piece, hn::Set(d, pieces_[k].anchor), from, to, f, a, t);
      from = to;
      red = wide::MulAdd(piece.red, a, wide::MulAdd(piece.red_slope, t, red));
      green = wide::MulAdd(piece.green, a, wide::MulAdd(piece.green_slope, t, green));
      blue = wide::MulAdd(piece.blue, a, wide::MulAdd(piece.blue_slope, t, blue));
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

  template <class V, class At>
  HWY_INLINE void blend(const SegmentOf<V>& s, const At& first, Pixels& pixels) const {
    const DF d;
    const V front = wide::Clamp(wide::Sub(s.mean, s.half), lo_, hi_);
    const V back = wide::Clamp(wide::Add(s.mean, s.half), lo_, hi_);
    const V whole_change = wide::Sub(back, front);
    V red = wide::same<V>(hn::Zero(d)), green = red, blue = red;
    V clear = wide::same<V>(hn::Set(d, 1.0F));
    const auto up = wide::Ge(whole_change, hn::Zero(d));
    // On a scale of [0, 1]; of less than this the inverse would have no end.
    const auto flat = wide::Lt(wide::Abs(whole_change), hn::Set(d, 1e-30F));
    const V per_change = wide::Div(hn::Set(d, 1.0F), whole_change);
    for (std::int32_t k = first_; k <= last_; ++k) {
      // The part of the segment in piece k; the outermost pieces take whatever rounding has left over.
      const VF begin = hn::Set(d, k == first_ ? -std::numeric_limits<float>::max() : pieces_[k - 1].end);
      const VF end = hn::Set(d, k == last_ ? std::numeric_limits<float>::max() : pieces_[k].end);
      const V from = wide::Clamp(front, begin, end);
      const V to = wide::Clamp(back, begin, end);
      const V change = wide::Sub(to, from);
      const auto here = wide::And(wide::Ge(front, begin), wide::Lt(front, end));
      const V share =
          wide::IfThenElse(flat, wide::IfThenElseZero(here, hn::Set(d, 1.0F)), wide::Mul(change, per_change));
      if (wide::AllTrue(wide::Eq(share, hn::Zero(d)))) continue;
      const PieceV piece(pieces_[k]);
      const VF anchor = hn::Set(d, pieces_[k].anchor);
      const Glow<V> glow = anyDepth(wide::Sub(from, anchor), change, wide::Mul(share, s.length), piece.extinction,
                                    piece.extinction_slope);
      // Towards higher values this part lies behind what has been gathered, towards lower ones before it.
      const V through = wide::Sub(hn::Set(d, 1.0F), glow.alpha);
      const V mine = wide::IfThenElse(up, clear, hn::Set(d, 1.0F));
      const V others = wide::IfThenElse(up, hn::Set(d, 1.0F), through);
      const V a = wide::Mul(mine, glow.alpha);
      const V t = wide::Mul(mine, glow.tint);
      red = wide::MulAdd(piece.red, a, wide::MulAdd(piece.red_slope, t, wide::Mul(red, others)));
      green = wide::MulAdd(piece.green, a, wide::MulAdd(piece.green_slope, t, wide::Mul(green, others)));
      blue = wide::MulAdd(piece.blue, a, wide::MulAdd(piece.blue_slope, t, wide::Mul(blue, others)));
      clear = wide::Mul(clear, through);
    }
    const V light = wide::load(pixels.light.data(), first);
    const auto add = [&](auto& channel, const V& value) HWY_ATTR {
      wide::store(wide::MulAdd(light, value, wide::load(channel.data(), first)), channel.data(), first);
    };
    add(pixels.red, red);
    add(pixels.green, green);
    add(pixels.blue, blue);
    wide::store(wide::Mul(light, clear), pixels.light.data(), first);
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

  template <class V, class At>
  HWY_INLINE void blend(const SegmentOf<V>& s, const At& first, Pixels& pixels) const {
    const DF d;
    const auto some = wide::Gt(s.length, hn::Zero(d));
    const V peak = wide::IfThenElseZero(some, wide::Clamp(wide::Add(s.mean, wide::Abs(s.half)), lo_, hi_));
    wide::store(wide::Max(wide::load(pixels.red.data(), first), peak), pixels.red.data(), first);
    wide::store(wide::IfThenZeroElse(some, wide::load(pixels.light.data(), first)), pixels.light.data(), first);
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
