// How the cells of a batch are shaded, a vector of cells at a time. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_KINDS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_KINDS_INL_H
#undef SPILLIKIN_NATIVE_KINDS_INL_H
#else
#define SPILLIKIN_NATIVE_KINDS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_fit-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_looks-inl.h"
#include "spillikin/composite/native_part-inl.h"
#include "spillikin/composite/native_small-inl.h"
#include "spillikin/composite/native_tiny-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// By how much the scalar changes along a ray in the cells from i on, at most: steepness (see CellBatch) is what the
// scalar at any depth is above the apex, times middle over that depth.
HWY_INLINE VF changeAlongRays(const CellBatch& batch, std::size_t i) {
  const DF d;
  const auto load = [&](const float* values) HWY_ATTR { return hn::Load(d, values + i); };
  const VF chord = load(batch.chord), apex = load(batch.apex);
  if (batch.parallel) return hn::Mul(hn::Abs(apex), chord);
  const VF steep = hn::Max(hn::Abs(hn::Sub(load(batch.lo), apex)), hn::Abs(hn::Sub(load(batch.hi), apex)));
  const VF half_per_middle = load(batch.half_per_middle);
  // The front's depth over the middle's; 0 where the eye's plane runs through the cell.
  const VF front = hn::NegMulAdd(load(batch.thickness), half_per_middle, hn::Set(d, 1.0F));
  const VF per_middle = hn::Add(half_per_middle, half_per_middle);
  return hn::Div(hn::Mul(hn::Mul(steep, chord), per_middle), hn::Max(front, hn::Set(d, 1e-30F)));
}

HWY_INLINE hn::Vec<DIF> kindNumber(Kind kind) {
  return hn::Set(DIF(), static_cast<std::int32_t>(kind));
}

// What lines, parabolas, series and an uneven field together may leave out of a colour: less than half a display step.
constexpr float all_left_out = 1.8e-3F;

// Of cells that a short series does for: tiny and small ones, where `exact` has how all others are shaded.
HWY_INLINE hn::Vec<DIF> thinKinds(const TileView& view, Looks looks, VF length, VF change, hn::Vec<DIF> exact,
                                  std::size_t i, CellBatch& batch) {
  const DF d;
  const DIF di;
  const Fits fits = setColors(*view.screen, looks, i, batch);
  // A parabola runs steeper than the colour that it stands for, by up to half of the bend.
  looks.steepest = hn::MulAdd(hn::IfThenElseZero(fits.parabola, looks.bend), hn::Set(d, 0.5F), looks.steepest);
  const Middle middle(batch, i);
  const Smallness smallness = smallnessOf(view, looks, length, change, middle, i, batch);
  const VF nearness = hn::Load(d, batch.middle_nearness + i);
  const VF least = hn::MulAdd(hn::Set(d, view.solid_slope - 1.0F), nearness, hn::Set(d, view.solid_at));
  hn::Store(least, d, batch.least + i);
  const auto more = [&](std::int32_t than) HWY_ATTR { return hn::Gt(looks.bends, hn::Set(di, than)); };
  // Of a field that is not quite linear over the cell.
  const VF of_field = hn::Mul(hn::Load(d, batch.uneven + i), hn::MulAdd(hn::Abs(smallness.extinction_slope),
                                                                        hn::Set(d, opacity_of_depth), looks.steepest));
  const VF besides = hn::Add(fits.left_out, of_field);
  // In a tetrahedron the field is linear, however steep extinction (0 times what may have no end).
  const auto little = [&](VF left_out) HWY_ATTR {
    return hn::RebindMask(di, hn::Not(hn::Gt(hn::Add(left_out, besides), hn::Set(d, all_left_out))));
  };
  const Tininess tininess = setTiny(looks, smallness, middle, i, batch);
  const auto small = hn::And(hn::RebindMask(di, smallness.small), little(smallness.left_out));
  const auto tiny = hn::And(hn::AndNot(more(1), hn::RebindMask(di, tininess.tiny)), little(tininess.left_out));
  if (!hn::AllFalse(di, hn::AndNot(tiny, small))) setSmall(smallness, middle, i, batch);
  const auto line = hn::Or(hn::Not(more(0)), hn::RebindMask(di, fits.line));
  const auto parabola = hn::RebindMask(di, fits.parabola);
  const auto byFit = [&](Kind straight, Kind curved, Kind before_bent) HWY_ATTR {
    const auto bent = hn::Add(hn::Min(looks.bends, hn::Set(di, few_bends + 1)), kindNumber(before_bent));
    return hn::IfThenElse(line, kindNumber(straight), hn::IfThenElse(parabola, kindNumber(curved), bent));
  };
  const auto kind = hn::IfThenElse(small, byFit(Kind::small, Kind::small_curved, Kind::small), exact);
  return hn::IfThenElse(tiny, byFit(Kind::tiny, Kind::tiny_curved, Kind::tiny_curved), kind);
}

// The kinds of the cells from i on as kindOf() and Look::care() have them, where extinction is one line over the cell
// and that is enough to tell; `decided` says where. `length` is a cell's along a ray, at most.
HWY_INLINE hn::Vec<DIF> straightKinds(const TileView& view, VF length, std::size_t i, CellBatch& batch,
                                      hn::Mask<DF>& decided) {
  const DF d;
  const DIF di;
  const Looks looks(*view.screen, batch, i);
  const VF change = hn::Min(looks.range, changeAlongRays(batch, i));
  const VF depth = hn::Mul(hn::Max(looks.at_lo, looks.at_hi), length);
  const VF slope = hn::Mul(hn::Abs(looks.extinction_slope), change);
  const VF growth = hn::Mul(slope, length);
  const VF bend = hn::Mul(change, looks.bend);
  const VF least = hn::MulAdd(slope, hn::Set(d, 0.5F), hn::Min(looks.at_lo, looks.at_hi));
  const VF left_out = hn::Mul(bend, bowLeftOut(depth, growth, slope, least));
  decided = hn::And(hn::And(hn::RebindMask(d, looks.straight), hn::Lt(depth, hn::Set(d, deep_depth))),
                    hn::And(hn::Le(bend, hn::Set(d, most_bend)), hn::Le(left_out, hn::Set(d, bend_left_out))));

  const auto some = hn::Gt(looks.bends, hn::Set(di, few_bends));
  const auto counted = [&](Kind none, Kind many) HWY_ATTR {
    return hn::IfThenElse(some, kindNumber(many), hn::Add(looks.bends, kindNumber(none)));
  };
  const auto one = hn::Eq(looks.bends, hn::Set(di, 1));
  const auto none = hn::Eq(looks.bends, hn::Zero(di));
  const VF tilted = hn::Mul(bend, tiltLeftOut(depth, growth));
  const auto flat = hn::And(one, hn::RebindMask(di, hn::Le(tilted, hn::Set(d, bend_left_out))));
  auto thin = hn::IfThenElse(flat, kindNumber(Kind::bend), counted(Kind::bend, Kind::bends));
  thin = hn::IfThenElse(none, kindNumber(Kind::none), thin);
  thin = thinKinds(view, looks, length, change, thin, i, batch);
  const auto is_thin = hn::And(hn::Lt(depth, hn::Set(d, thin_depth)), hn::Lt(growth, hn::Set(d, thin_growth)));
  return hn::IfThenElse(hn::RebindMask(di, is_thin), thin, counted(Kind::long0, Kind::longs));
}

// Sets the origin that each of the cells from i on is shaded from, once their kinds are known.
HWY_INLINE void setOrigins(const Screen& screen, std::size_t i, CellBatch& batch) {
  const DF d;
  const DIF di;
  const auto kind = hn::Load(di, reinterpret_cast<const std::int32_t*>(batch.kind + i));
  const auto before = [&](Kind other) HWY_ATTR { return hn::RebindMask(d, hn::Gt(kindNumber(other), kind)); };
  const PieceNumbers of_first(screen, hn::Load(di, batch.first_piece + i));
  const VF anchor = hn::IfThenElse(before(Kind::none), hn::Load(d, batch.amid + i),
                                   hn::IfThenElseZero(before(Kind::cut), of_first(offsetof(Piece, anchor))));
  const VF at = hn::Sub(hn::Load(d, batch.at[2] + i), anchor);
  hn::Store(hn::IfThenElse(before(Kind::small_curved), hn::Load(d, batch.tiny_origin + i), at), d, batch.origin + i);
}

// By how much the rounding of a depth moves the scalar of the cells from i on, at most.
HWY_INLINE VF scalarRounding(const TileView& view, std::size_t i, const CellBatch& batch) {
  const DF d;
  const auto load = [&](const float* values) HWY_ATTR { return hn::Load(d, values + i); };
  VF steep = hn::Abs(load(batch.apex));
  if (!batch.parallel) {
    steep =
        hn::MulAdd(hn::Add(hn::Abs(load(batch.at[0])), hn::Abs(load(batch.at[1]))),
                   hn::Set(d, static_cast<float>(tile_size)), hn::Abs(hn::Sub(load(batch.at[2]), load(batch.apex))));
  }
  return hn::Mul(steep, hn::Set(d, view.rounding));
}

// Whether that is next to nothing.
HWY_INLINE hn::Mask<DF> steadyCells(const TileView& view, std::size_t i, const CellBatch& batch) {
  const DF d;
  const VF range = hn::Sub(hn::Load(d, batch.hi + i), hn::Load(d, batch.lo + i));
  return hn::Le(scalarRounding(view, i, batch), hn::Mul(hn::Set(d, 0.02F), range));
}

// Leaves the steady cells from i on what lies in the tile of their range, and of the pieces that they reach over.
HWY_INLINE void narrowRange(const TileView& view, hn::Mask<DF> steady, std::size_t i, CellBatch& batch) {
  const DF d;
  const DIF di;
  const VF whole_lo = hn::Load(d, batch.lo + i), whole_hi = hn::Load(d, batch.hi + i);
  const VF of_depth = scalarRounding(view, i, batch);
  const VF of_value = hn::Mul(hn::Set(d, float_rounding), hn::Add(hn::Abs(whole_lo), hn::Abs(whole_hi)));
  const VF rounding = hn::MulAdd(hn::Set(d, share_rounding), hn::Sub(whole_hi, whole_lo),
                                 hn::Add(hn::Add(of_depth, of_depth), of_value));
  const VF part_lo = hn::Sub(hn::Load(d, batch.part[0] + i), rounding);
  const VF part_hi = hn::Add(hn::Load(d, batch.part[1] + i), rounding);
  const VF lo = hn::IfThenElse(steady, hn::Clamp(part_lo, whole_lo, whole_hi), whole_lo);
  const VF hi = hn::IfThenElse(steady, hn::Clamp(part_hi, lo, whole_hi), whole_hi);
  hn::Store(lo, d, batch.lo + i);
  hn::Store(hi, d, batch.hi + i);
  auto first = hn::Load(di, batch.first_piece + i), last = hn::Load(di, batch.last_piece + i);
  const auto one = hn::Set(di, 1);
  const auto endOf = [&](hn::Vec<DIF> piece)
                         HWY_ATTR { return PieceNumbers(*view.screen, piece)(offsetof(Piece, end)); };
  for (;;) {
    const auto more = hn::Gt(last, first);
    const auto above = hn::And(more, hn::RebindMask(di, hn::Lt(endOf(first), lo)));
    const auto below =
        hn::And(hn::AndNot(above, more), hn::RebindMask(di, hn::Gt(endOf(hn::Max(hn::Sub(last, one), first)), hi)));
    if (hn::AllFalse(di, hn::Or(above, below))) break;
    first = hn::Add(first, hn::IfThenElseZero(above, one));
    last = hn::Sub(last, hn::IfThenElseZero(below, one));
  }
  hn::Store(first, di, batch.first_piece + i);
  hn::Store(last, di, batch.last_piece + i);
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
