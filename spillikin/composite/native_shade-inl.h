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

// Where the rays of a vector run inside the cell.
struct Segment {
  VF front;   // scalar where the ray enters
  VF change;  // of the scalar up to where it leaves
  VF length;  // world units
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
        per_middle_(hn::Set(DF(), batch.per_middle[i])),
        z0_(hn::Set(DF(), static_cast<float>(view.screen->depths().z0))) {}

  // Lanes outside of the cell get no length and harmless values.
  HWY_INLINE Segment operator()(VF near, VF far, hn::Mask<DF> inside, VF x, VF y, VF unit) const {
    near = hn::IfThenElse(inside, near, middle_);
    far = hn::IfThenElse(inside, far, middle_);
    const VF at = hn::MulAdd(x_, x, hn::MulAdd(y_, y, t_));
    VF depth = hn::Sub(near, far);
    if constexpr (Parallel) {
      const VF front = hn::MulAdd(apex_, hn::Sub(middle_, near), at);
      return {front, hn::Mul(apex_, depth), hn::Mul(depth, unit)};
    } else {
      const VF u_near = hn::Add(near, z0_);
      const VF u_far = hn::Add(far, z0_);
      const VF both = reciprocal(hn::Mul(u_near, u_far));
      const VF w_near = hn::Mul(u_far, both);
      depth = hn::Mul(depth, both);
      const VF steep = hn::Sub(at, apex_);
      const VF front = hn::MulAdd(steep, hn::Mul(hn::Sub(middle_, near), w_near), at);
      return {front, hn::Mul(hn::Mul(steep, depth), per_middle_), hn::Mul(depth, unit)};
    }
  }

 private:
  VF x_, y_, t_, apex_, middle_, per_middle_, z0_;
};

template <bool Parallel, Care care>
class Shader;

// A thin fragment in one piece of the transfer function: a short series for the integral.
template <bool Parallel>
class Shader<Parallel, Care::none> {
 public:
  HWY_INLINE Shader(const TileView& view, const CellBatch& batch, std::size_t i)
      : piece_(view.screen->pieces()[static_cast<std::size_t>(batch.first_piece[i])]),
        rays_(view, batch, i, view.screen->pieces()[static_cast<std::size_t>(batch.first_piece[i])].anchor) {}

  HWY_INLINE void blend(VF near, VF far, hn::Mask<DF> inside, VF x, VF y, std::size_t first, Pixels& pixels) const {
    const DF d;
    const Segment s = rays_(near, far, inside, x, y, hn::Load(d, pixels.length.data() + first));
    const VF half = hn::Mul(s.change, hn::Set(d, 0.5F));
    const VF mean = hn::Add(s.front, half);
    const VF depth = hn::Mul(s.length, hn::MulAdd(piece_.extinction_slope, mean, piece_.extinction));
    const VF growth = hn::Mul(hn::Mul(s.length, piece_.extinction_slope), s.change);
    const VF alpha = thinAlpha(depth);
    const VF tint = hn::MulAdd(mean, alpha, hn::Mul(half, thinSkew(depth, growth)));

    const VF light = hn::Load(d, pixels.light.data() + first);
    const VF a = hn::Mul(light, alpha);
    const VF t = hn::Mul(light, tint);
    const auto add = [&](auto& channel, VF base, VF slope) HWY_ATTR {
      float* p = channel.data() + first;
      hn::Store(hn::MulAdd(base, a, hn::MulAdd(slope, t, hn::Load(d, p))), d, p);
    };
    add(pixels.red, piece_.red, piece_.red_slope);
    add(pixels.green, piece_.green, piece_.green_slope);
    add(pixels.blue, piece_.blue, piece_.blue_slope);
    hn::Store(hn::Sub(light, a), d, pixels.light.data() + first);
  }

 private:
  PieceV piece_;
  Rays<Parallel> rays_;
};

// A thin fragment of a cell that reaches over several pieces: cut at their ends. The parts are met from low values to
// high, whichever way the ray runs: with the light at the front of the part f, and f' behind it, the part's opacity
// times its light is |f' - f|, and for a ray towards lower values the light is counted from the far end and grows.
template <bool Parallel>
class Shader<Parallel, Care::cut> {
 public:
  HWY_INLINE Shader(const TileView& view, const CellBatch& batch, std::size_t i)
      : pieces_(view.screen->pieces().data()),
        first_(batch.first_piece[i]),
        last_(batch.last_piece[i]),
        rays_(view, batch, i, 0.0F) {}

  HWY_INLINE void blend(VF near, VF far, hn::Mask<DF> inside, VF x, VF y, std::size_t first, Pixels& pixels) const {
    const DF d;
    // A segment along which the scalar stays the same counts as one that rises by this much.
    constexpr float least_change = 2.5e-7F;
    const VF one = hn::Set(d, 1.0F);
    const Segment s = rays_(near, far, inside, x, y, hn::Load(d, pixels.length.data() + first));
    const VF back = hn::Add(s.front, s.change);
    const VF lo = hn::Min(s.front, back);
    const VF hi = hn::Max(hn::Max(s.front, back), hn::Add(lo, hn::Set(d, least_change)));
    const VF rate = hn::Mul(s.length, reciprocal(hn::Sub(hi, lo)));
    const auto up = hn::Ge(s.change, hn::Zero(d));
    const VF sign = hn::CopySign(one, s.change);
    VF red = hn::Zero(d), green = hn::Zero(d), blue = hn::Zero(d);
    VF f = one;
    VF from = lo;
    for (std::int32_t k = first_; k <= last_; ++k) {
      // The outermost pieces take whatever rounding has left over.
      VF to = hi;
      if (k < last_) to = hn::Max(lo, hn::Min(hi, hn::Set(d, pieces_[k].end)));
      const VF half = hn::Mul(hn::Sub(to, from), hn::Set(d, 0.5F));
      if (hn::AllTrue(d, hn::Eq(from, to))) continue;
      const PieceV piece(pieces_[k]);
      const VF mean = hn::Sub(hn::Add(from, half), hn::Set(d, pieces_[k].anchor));
      from = to;
      const VF half_length = hn::Mul(rate, half);
      const VF length = hn::Add(half_length, half_length);
      const VF depth = hn::Mul(length, hn::MulAdd(piece.extinction_slope, mean, piece.extinction));
      const VF growth = hn::Mul(hn::Mul(length, piece.extinction_slope), hn::Add(half, half));
      const VF signed_depth = hn::Mul(depth, sign);
      const VF after = hn::NegMulAdd(f, thinAlpha(signed_depth), f);
      const VF a = hn::Abs(hn::Sub(f, after));
      const VF light = hn::IfThenElse(up, f, after);
      f = after;
      const VF t = hn::MulAdd(mean, a, hn::Mul(hn::Mul(light, half), thinSkewRising(depth, signed_depth, growth)));
      red = hn::MulAdd(piece.red, a, hn::MulAdd(piece.red_slope, t, red));
      green = hn::MulAdd(piece.green, a, hn::MulAdd(piece.green_slope, t, green));
      blue = hn::MulAdd(piece.blue, a, hn::MulAdd(piece.blue_slope, t, blue));
    }
    // Counted from the far end, f has grown to 1 / (the light that comes through).
    const VF inverse = reciprocal(f);
    const VF light = hn::Load(d, pixels.light.data() + first);
    const VF scale = hn::IfThenElse(up, light, hn::Mul(light, inverse));
    const auto add = [&](auto& channel, VF value) HWY_ATTR {
      float* p = channel.data() + first;
      hn::Store(hn::MulAdd(scale, value, hn::Load(d, p)), d, p);
    };
    add(pixels.red, red);
    add(pixels.green, green);
    add(pixels.blue, blue);
    hn::Store(hn::Mul(light, hn::IfThenElse(up, f, inverse)), d, pixels.light.data() + first);
  }

 private:
  const Piece* pieces_;
  std::int32_t first_, last_;
  Rays<Parallel> rays_;
};

// Any fragment: cut where it passes from one piece of the transfer function to the next, each part at any depth.
template <bool Parallel>
class Shader<Parallel, Care::full> {
 public:
  HWY_INLINE Shader(const TileView& view, const CellBatch& batch, std::size_t i)
      : pieces_(view.screen->pieces().data()),
        first_(batch.first_piece[i]),
        last_(batch.last_piece[i]),
        lo_(hn::Set(DF(), batch.lo[i])),
        hi_(hn::Set(DF(), batch.hi[i])),
        rays_(view, batch, i, 0.0F) {}

  HWY_INLINE void blend(VF near, VF far, hn::Mask<DF> inside, VF x, VF y, std::size_t first, Pixels& pixels) const {
    const DF d;
    Segment s = rays_(near, far, inside, x, y, hn::Load(d, pixels.length.data() + first));
    const VF back = hn::Clamp(hn::Add(s.front, s.change), lo_, hi_);
    s.front = hn::Clamp(s.front, lo_, hi_);
    s.change = hn::Sub(back, s.front);
    VF red = hn::Zero(d), green = hn::Zero(d), blue = hn::Zero(d);
    VF clear = hn::Set(d, 1.0F);
    const auto up = hn::Ge(s.change, hn::Zero(d));
    const auto flat = hn::Eq(s.change, hn::Zero(d));
    const VF per_change = hn::Div(hn::Set(d, 1.0F), s.change);
    for (std::int32_t k = first_; k <= last_; ++k) {
      // The part of the segment in piece k; the outermost pieces take whatever rounding has left over.
      const VF begin = hn::Set(d, k == first_ ? -std::numeric_limits<float>::max() : pieces_[k - 1].end);
      const VF end = hn::Set(d, k == last_ ? std::numeric_limits<float>::max() : pieces_[k].end);
      const VF from = hn::Clamp(s.front, begin, end);
      const VF to = hn::Clamp(back, begin, end);
      const VF change = hn::Sub(to, from);
      const auto here = hn::And(hn::Ge(s.front, begin), hn::Lt(s.front, end));
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
  Rays<Parallel> rays_;
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
