// Small cells: what a ray finds inside is a short series about the cell's middle, which takes half of the operations.
//
// With m the middle's nearness to the eye (1 / its depth), n and f the nearness of a fragment's ends, let s = (n + f) /
// m - 2 and e = (n - f) / m; neither is more than the cell's depth as a share of its distance. Then
//   depth        (n - f) (1 - s + (3 s^2 + e^2) / 4) / m^2
//   half way     (-s / 2 + (s^2 + e^2) / 4) / m behind the middle
// to the third order. A parallel view takes the first terms alone, which are exact there. Of what the light's fading by
// the optical depth d and extinction's growth by its slope do to a fragment's colour (Moreland and Angel 2004), the
// first terms are left, h (2 h slope / extinction - d) / 6 as a shift of the scalar with h half of its change. That,
// and e^2 / 4 of the scalar half way, are numbers of the cell times (n - f)^2. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_SMALL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_SMALL_INL_H
#undef SPILLIKIN_NATIVE_SMALL_INL_H
#else
#define SPILLIKIN_NATIVE_SMALL_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_crossing-inl.h"
#include "spillikin/composite/native_fit-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_looks-inl.h"
#include "spillikin/composite/native_shade-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// What the series may leave out of a colour: a fifth of a display step if every fragment erred at its worst and to the
// same side.
constexpr float small_left_out = 8e-4F;
// An optical depth m that is off by a share of it moves the opacity by that times m exp(-m), at most this.
constexpr float opacity_of_depth = 0.37F;
// A cell's depth as a share of its distance, at most: of depths, its cube is left out.
constexpr float small_relative_depth = 0.05F;

// What is known of a vector of cells as small ones: the depth as a share of the distance, the scalar's shift (see
// above), extinction's slope as a share of what it is amid the range, what the series leave out of a colour at most,
// and which cells are thin enough for short series and small.
struct Smallness {
  VF relative, shift, extinction_slope, left_out;
  hn::Mask<DF> thin, small;
};

// The middle's depth, and the scalar's change with depth in units of it (see CellBatch) in the middle of a cell's box.
struct Middle {
  VF depth, steep;
  HWY_INLINE Middle(const CellBatch& batch, std::size_t i) {
    const DF d;
    const DIF di;
    const auto load = [&](const float* values) HWY_ATTR { return hn::Load(d, values + i); };
    const auto amidst = [&](const std::int32_t* first, const std::int32_t* last) HWY_ATTR {
      const VF both = hn::ConvertTo(d, hn::Add(hn::Load(di, first + i), hn::Load(di, last + i)));
      return hn::MulAdd(both, hn::Set(d, 2.0F), hn::Set(d, 2.0F));
    };
    const VF at = hn::MulAdd(load(batch.at[0]), amidst(batch.block_x0, batch.block_x1),
                             hn::MulAdd(load(batch.at[1]), amidst(batch.block_y0, batch.block_y1), load(batch.at[2])));
    depth = hn::Mul(hn::Set(d, 0.5F), reciprocal(load(batch.half_per_middle)));
    steep = batch.parallel ? hn::Neg(load(batch.apex)) : hn::Sub(at, load(batch.apex));
  }
};

// Whether the series leave out little enough of the cells from i on. `length` is a cell's along a ray and `change` the
// scalar's, at most.
HWY_INLINE Smallness smallnessOf(const TileView& view, const Looks& looks, VF length, VF change, const Middle& middle,
                                 std::size_t i, const CellBatch& batch) {
  const DF d;
  const auto set = [](float v) HWY_ATTR { return hn::Set(DF(), v); };
  const auto load = [&](const float* values) HWY_ATTR { return hn::Load(d, values + i); };
  const VF amid = hn::Max(hn::Mul(set(0.5F), hn::Add(looks.at_lo, looks.at_hi)), set(1e-30F));
  const VF per_amid = reciprocal(amid), per_middle = load(batch.half_per_middle);
  const VF depth_per_nearness = batch.parallel ? set(1.0F) : hn::Mul(middle.depth, middle.depth);
  const VF relative = batch.parallel ? hn::Zero(d) : hn::Mul(load(batch.thickness), hn::Add(per_middle, per_middle));
  const VF of_square = batch.parallel ? hn::Zero(d) : hn::Mul(hn::Mul(depth_per_nearness, set(0.25F)), middle.steep);
  // Half of a fragment's change in the scalar, over its extent in nearness.
  const VF half = hn::Mul(hn::Mul(middle.steep, per_middle), depth_per_nearness);
  const VF fading = hn::Mul(hn::Mul(depth_per_nearness, set(view.longest)), amid);  // d over the extent
  const VF slope = hn::Mul(looks.extinction_slope, per_amid);
  const VF growing = hn::Mul(hn::Add(half, half), slope);
  const VF shift = hn::MulAdd(hn::Mul(half, set(1.0F / 6)), hn::Sub(growing, fading), of_square);

  const VF spread = hn::Mul(hn::Abs(hn::Sub(looks.at_hi, looks.at_lo)), per_amid);
  const VF growth = hn::Mul(change, hn::Abs(slope));
  const VF depth = hn::Mul(hn::Max(looks.at_lo, looks.at_hi), length);
  // Of a colour on a line, what comes of the series' cubes, of taking the middle's extinction for a fragment's, and of
  // the fading's own square; of a bend, its tilt and bow where part of a fragment lies beyond it.
  const VF mixed = hn::Mul(depth, hn::Add(spread, relative));
  const VF line =
      hn::MulAdd(relative, relative, hn::Mul(hn::MulAdd(set(2.0F), mixed, hn::Mul(growth, spread)), set(1.0F / 24)));
  const VF tilts = hn::Mul(hn::Add(growth, depth), set(0.01F));
  const VF bows = hn::Mul(hn::Mul(depth, hn::MulAdd(set(3.0F), growth, depth)), set(1.0F / 384));
  const VF bends = hn::Mul(looks.bend, hn::Add(tilts, bows));
  const VF left_out = hn::Mul(change, hn::MulAdd(looks.steepest, line, bends));
  const auto near_enough = hn::And(hn::Le(left_out, set(small_left_out)), hn::Le(relative, set(small_relative_depth)));
  const auto thin = hn::And(hn::Lt(depth, set(thin_depth)), hn::Le(spread, set(1.0F)));
  return {relative, shift, slope, left_out, thin, hn::And(thin, near_enough)};
}

// Sets the series of the cells from i on, as SmallShading takes them: for those that are not small the numbers mean
// nothing.
HWY_INLINE void setSmall(const Smallness& small, const Middle& middle, std::size_t i, CellBatch& batch) {
  const DF d;
  const auto set = [](float v) HWY_ATTR { return hn::Set(DF(), v); };
  const auto store = [&](VF v, float* to) HWY_ATTR { hn::Store(v, d, to + i); };
  const VF nearness = hn::Load(d, batch.middle_nearness + i);
  const VF twice = hn::Add(nearness, nearness);  // what s counts from
  store(small.shift, batch.shift);
  if (batch.parallel) {
    store(nearness, batch.turn[0]);
    store(set(-0.5F), batch.turn[1]);
    store(set(1.0F), batch.depth[0]);
    for (auto& none : {batch.turn[2], batch.depth[1], batch.depth[2], batch.depth_square})
      store(hn::Zero(d), none);
    return;
  }
  const VF depth = middle.depth;
  const VF half = hn::Mul(set(0.5F), depth);
  const VF square = hn::Mul(half, half);
  store(hn::Mul(twice, hn::MulAdd(twice, square, half)), batch.turn[0]);
  store(hn::Neg(hn::MulAdd(hn::Add(twice, twice), square, half)), batch.turn[1]);
  store(square, batch.turn[2]);
  const VF per_nearness = hn::Mul(depth, depth);
  const VF cube = hn::Mul(per_nearness, depth);
  const VF fourth = hn::Mul(per_nearness, square);
  const VF thrice = hn::Mul(set(3.0F), fourth);
  store(hn::MulAdd(twice, hn::MulAdd(twice, thrice, cube), per_nearness), batch.depth[0]);
  store(hn::Neg(hn::MulAdd(hn::Add(twice, twice), thrice, cube)), batch.depth[1]);
  store(thrice, batch.depth[2]);
  store(fourth, batch.depth_square);
}

// Adds the bend where a piece ends: its kink, by how far the scalar is beyond on the fragment's average.
template <class V>
HWY_INLINE void addBend(const Reach<V>& reach, const Piece& piece, float end, Tint<V>& tint) {
  const DF d;
  const V above = wide::Sub(reach.hi, hn::Set(d, end));
  const V share = reach.share(above);
  tint.add(wide::Mul(share, wide::NegMulAdd(share, reach.half, above)), hn::Set(d, piece.kink[0]),
           hn::Set(d, piece.kink[1]), hn::Set(d, piece.kink[2]));
}

// A small cell's colours, which bend at the end of so many of its pieces, from the first on.
template <int bends, bool curved>
class SmallColors : public Colors<curved> {
 public:
  HWY_INLINE SmallColors(const TileView& view, const CellBatch& batch, std::size_t i)
      : Colors<curved>(batch, i), pieces_(view.screen->pieces().data() + batch.first_piece[i]) {
    for (int k = 0; k < bends; ++k)
      end_[k] = pieces_[k].end - batch.amid[i];
  }

  // Of fragments with the scalar `value` half way, which changes by `change` from there on.
  template <class V, class M>
  HWY_INLINE Tint<V> tint(const V& value, const V& change, const M& /*inside*/) const {
    Tint<V> tint = Colors<curved>::tint(value, change);
    const Reach<V> reach(value, change);
    for (int k = 0; k < bends; ++k)
      addBend(reach, pieces_[k], end_[k], tint);
    return tint;
  }

 private:
  const Piece* pieces_;
  float end_[bends];  // relative to amid
};

template <bool curved>
class SmallColors<0, curved> : public Colors<curved> {
 public:
  HWY_INLINE SmallColors(const TileView& /*view*/, const CellBatch& batch, std::size_t i) : Colors<curved>(batch, i) {}

  // The change is third_per_half of the others'.
  template <class V, class M>
  HWY_INLINE Tint<V> tint(const V& value, const V& change, const M& /*inside*/) const {
    return Colors<curved>::tint(value, change);
  }
};

// The same of any number of bends.
template <>
class SmallColors<any_bends, false> : public Colors<false> {
 public:
  HWY_INLINE SmallColors(const TileView& view, const CellBatch& batch, std::size_t i)
      : Colors<false>(batch, i),
        pieces_(view.screen->pieces().data() + batch.first_piece[i]),
        run_(pieces_, batch.last_piece[i] - batch.first_piece[i], batch.amid[i]),
        amid_(batch.amid[i]) {}

  template <class V, class M>
  HWY_INLINE Tint<V> tint(const V& value, const V& change, const M& inside) const {
    const Reach<V> reach(value, change);
    Tint<V> tint;
    const auto begin = [&](const Piece& p) HWY_ATTR {
      const DF d;
      const V from_anchor = wide::Add(value, hn::Set(d, amid_ - p.anchor));
      const auto at = [&](std::size_t c) HWY_ATTR {
        return wide::MulAdd(from_anchor, hn::Set(d, p.color_slope[c]), hn::Set(d, p.color[c]));
      };
      tint = {at(0), at(1), at(2)};
    };
    run_(reach, inside, begin, [&](const Piece& p, float end) HWY_ATTR { addBend(reach, p, end, tint); });
    return tint;
  }

 private:
  const Piece* pieces_;
  PieceRun run_;
  float amid_;
};

// Over a small cell the least extent that proves anything is one number.
class SmallCheck {
 public:
  HWY_INLINE SmallCheck(const CellBatch& batch, std::size_t i) : least_(hn::Set(DF(), batch.least[i])) {}

  template <class V, class M, class At>
  HWY_INLINE void check(const Certificate& certificate, const V& near, const V& far, const M& /*inside*/,
                        const At& first, Pixels& pixels) const {
    certificate.checkSolid(near, far, wide::Gt(wide::Sub(near, far), least_), first, pixels);
  }

 private:
  VF least_;
};

// Takes what a thin fragment of optical depth `depth` fades off the light that is left. Returns that.
template <class V, class At>
HWY_INLINE V fade(const V& depth, const At& first, Pixels& pixels) {
  const V light = wide::load(pixels.light.data(), first);
  const V faded = wide::Mul(light, ShortSeries::alpha(depth));
  wide::store(wide::Sub(light, faded), pixels.light.data(), first);
  return faded;
}

// Blends the fragments of a small cell, over so many bends of the colour, or any_bends; or over a parabola.
template <bool Parallel, int bends, bool curved = false>
class SmallShading : public SmallCheck {
 public:
  static constexpr bool short_chain = bends >= 0 && bends <= 2;
  HWY_INLINE SmallShading(const TileView& view, const CellBatch& batch, std::size_t i)
      : SmallCheck(batch, i), colors_(view, batch, i) {
    const DF d;
    apex_ = hn::Set(d, Parallel ? -batch.apex[i] : batch.apex[i] - batch.amid[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      turn_[k] = hn::Set(d, batch.turn[k][i]);
      depth_[k] = hn::Set(d, batch.depth[k][i]);
    }
    depth_square_ = hn::Set(d, batch.depth_square[i]);
    shift_ = hn::Set(d, batch.shift[i]);
    per_middle_ = hn::Set(d, batch.half_per_middle[i] * (curved ? third_per_half : 1.0F));
  }

  template <class V, class M, class At>
  HWY_INLINE void blend(const Crossed<V>& ray, const M& inside, const At& first, Pixels& pixels) const {
    const V extent = wide::Sub(ray.near, ray.far), sum = wide::Add(ray.near, ray.far);
    const V squared = wide::Mul(extent, extent);
    const V at = ray.at;
    const V steep = Parallel ? wide::same<V>(apex_) : wide::Sub(at, apex_);
    const V behind = wide::MulAdd(sum, wide::MulAdd(sum, turn_[2], turn_[1]), turn_[0]);
    const V mean = wide::MulAdd(steep, behind, at);
    V per = wide::same<V>(depth_[0]);
    if constexpr (!Parallel) {
      per = wide::MulAdd(sum, wide::MulAdd(sum, depth_[2], depth_[1]), depth_[0]);
      per = wide::MulAdd(squared, depth_square_, per);
    }
    const V length = wide::Mul(extent, per);
    const V in_world = wide::Mul(length, wide::load(pixels.length.data(), first));
    // Outside of the cell, numbers may have no end, and nothing of them must be left.
    const V depth = wide::IfThenElseZero(inside, wide::Mul(in_world, colors_.extinction(mean)));
    const V a = fade(depth, first, pixels);
    const V value = wide::MulAdd(squared, shift_, mean);
    V half = value;
    if constexpr (curved || bends != 0) half = wide::Mul(wide::Mul(steep, per_middle_), length);
    Light<V> light(pixels, first);
    light.add(colors_.tint(value, half, inside), a, inside);
    light.store(first, pixels);
  }

 private:
  SmallColors<bends, curved> colors_;
  VF apex_, turn_[3], depth_[3], depth_square_, shift_, per_middle_;
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
