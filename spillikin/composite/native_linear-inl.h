// Whole cells over which the field is as good as linear in space: they are shaded as tetrahedra are. A plane through
// the scalars at the corners is fitted; on faces' triangles and along rays the scalar is linear between corners, so
// that it is nowhere farther from the plane than at one of them. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_LINEAR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_LINEAR_INL_H
#undef SPILLIKIN_NATIVE_LINEAR_INL_H
#else
#define SPILLIKIN_NATIVE_LINEAR_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_kinds-inl.h"
#include "spillikin/composite/native_sheets.h"
#include "spillikin/composite/native_vec3d-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// One coordinate (or the scalar) of the corners of a vector of cells.
struct EightCorners {
  VD at[8];
  // What the four edges each way gain together, by which way.
  HWY_INLINE VD along0() const { return sum({1, 2, 5, 6}, {0, 3, 4, 7}); }
  HWY_INLINE VD along1() const { return sum({2, 3, 6, 7}, {0, 1, 4, 5}); }
  HWY_INLINE VD along2() const { return sum({4, 5, 6, 7}, {0, 1, 2, 3}); }

 private:
  using Four = std::array<std::size_t, 4>;
  HWY_INLINE VD sum(const Four& plus, const Four& minus) const {
    VD total = hn::Sub(at[plus[0]], at[minus[0]]);
    for (std::size_t k = 1; k < 4; ++k)
      total = hn::Add(total, hn::Sub(at[plus[k]], at[minus[k]]));
    return total;
  }
};

// The plane of the cells from i on, and how far their corners are from it.
HWY_INLINE void fitPlane(const TileView& view, std::size_t i, SheetBatch& batch) {
  const DD d;
  const DH dh;
  const hn::Rebind<std::uint32_t, DD> du;
  const hn::RebindToUnsigned<DD> dl;
  CellBatch& field = batch.field;
  EightCorners x, y, w, s;
  for (std::size_t k = 0; k < 8; ++k) {
    VD rest;
    hn::LoadInterleaved4(d, batch.corner[k] + 4 * i, x.at[k], y.at[k], w.at[k], rest);
    s.at[k] = hn::PromoteTo(d, hn::BitCast(dh, hn::TruncateTo(du, hn::BitCast(dl, rest))));
  }
  const Vec3D e0{x.along0(), y.along0(), w.along0()};
  const Vec3D e1{x.along1(), y.along1(), w.along1()};
  const Vec3D e2{x.along2(), y.along2(), w.along2()};
  const Vec3D n0 = cross(e1, e2), n1 = cross(e2, e0), n2 = cross(e0, e1);
  const VD inverse = hn::Div(hn::Set(d, 1.0), dot(e0, n0));
  const VD s0 = hn::Mul(s.along0(), inverse), s1 = hn::Mul(s.along1(), inverse), s2 = hn::Mul(s.along2(), inverse);
  const auto mix = [&](VD a, VD b, VD c) HWY_ATTR { return hn::MulAdd(s0, a, hn::MulAdd(s1, b, hn::Mul(s2, c))); };
  const Vec3D g{mix(n0.x, n1.x, n2.x), mix(n0.y, n1.y, n2.y), mix(n0.z, n1.z, n2.z)};
  const auto above = [&](std::size_t k) HWY_ATTR { return hn::Sub(s.at[k], dot(g, {x.at[k], y.at[k], w.at[k]})); };
  VD lo = above(0), hi = lo;
  for (std::size_t k = 1; k < 8; ++k) {
    const VD r = above(k);
    lo = hn::Min(lo, r);
    hi = hn::Max(hi, r);
  }
  const VD half = hn::Set(d, 0.5);
  // Nothing of a cell without volume, of which numbers may have no end.
  const auto known = hn::Lt(hn::Add(hn::Abs(g.x), hn::Add(hn::Abs(g.y), hn::Abs(g.z))), hn::Set(d, 1e30));
  const VD off = hn::IfThenElse(known, hn::Mul(half, hn::Sub(hi, lo)), hn::Set(d, 1.0));
  hn::Store(hn::DemoteTo(dh, off), dh, field.uneven + i);

  // Relative to the tile's corner from here on.
  const VD x0 = hn::Set(d, static_cast<double>(view.x0)), y0 = hn::Set(d, static_cast<double>(view.y0));
  const VD moved = hn::MulAdd(g.x, x0, hn::Mul(g.y, y0));
  const VD level = hn::Mul(half, hn::Add(lo, hi));
  const VD near = hn::PromoteTo(d, hn::Load(dh, batch.lo[SheetBatch::depth] + i));
  const VD far = hn::PromoteTo(d, hn::Load(dh, batch.hi[SheetBatch::depth] + i));
  const VD middle = hn::Mul(half, hn::Add(near, far));
  const auto store = [&](VD v, float* to) HWY_ATTR { hn::Store(hn::DemoteTo(dh, v), dh, to + i); };
  const VD z0 = hn::Set(d, view.screen->depths().z0);
  if (field.parallel) {
    store(g.x, field.at[0]);
    store(g.y, field.at[1]);
    store(hn::MulAdd(g.z, middle, hn::Add(level, moved)), field.at[2]);
    store(hn::Neg(g.z), field.apex);
    store(hn::Sub(z0, middle), field.middle_nearness);
    store(half, field.half_per_middle);
  } else {
    const VD per_middle = hn::Div(hn::Set(d, 1.0), middle);
    store(hn::Mul(g.x, middle), field.at[0]);
    store(hn::Mul(g.y, middle), field.at[1]);
    store(hn::MulAdd(hn::Add(g.z, moved), middle, level), field.at[2]);
    store(level, field.apex);
    store(hn::Sub(per_middle, z0), field.middle_nearness);
    store(hn::Mul(per_middle, half), field.half_per_middle);
  }
  store(hn::Sub(far, near), field.thickness);
  store(hn::Sub(far, near), field.chord);
}

// The kinds of the cells from i on: a small or a tiny one, or Kind::full for all that are to be shaded another way.
HWY_INLINE void setFieldKinds(const TileView& view, std::size_t i, SheetBatch& batch) {
  const DF d;
  const DIF di;
  CellBatch& field = batch.field;
  const auto copy = [i](auto as, const auto* from, auto* to)
                        HWY_ATTR { hn::Store(hn::Load(as, from + i), as, to + i); };
  copy(d, batch.lo[SheetBatch::scalar], field.lo);
  copy(d, batch.hi[SheetBatch::scalar], field.hi);
  copy(di, batch.first_piece, field.first_piece);
  copy(di, batch.last_piece, field.last_piece);
  copy(di, batch.block_x0, field.block_x0);
  copy(di, batch.block_y0, field.block_y0);
  const auto last = [&](const std::int32_t* past) HWY_ATTR { return hn::Sub(hn::Load(di, past + i), hn::Set(di, 1)); };
  hn::Store(last(batch.block_x1), di, field.block_x1 + i);
  hn::Store(last(batch.block_y1), di, field.block_y1 + i);
  const VF length = hn::Mul(hn::Load(d, field.chord + i), hn::Set(d, view.longest));
  hn::Mask<DF> decided;
  const auto kind = straightKinds(view, length, i, field, decided);
  const auto before_eye = hn::Gt(hn::Load(d, batch.lo[SheetBatch::depth] + i), hn::Zero(d));
  auto taken = hn::And(decided, steadyCells(view, i, field));
  if (!field.parallel) taken = hn::And(taken, before_eye);
  const auto small = hn::AndNot(hn::Gt(kind, kindNumber(Kind::small_bends4)), hn::RebindMask(di, taken));
  hn::Store(hn::IfThenElse(small, kind, kindNumber(Kind::full)), di, reinterpret_cast<std::int32_t*>(field.kind + i));
  setOrigins(*view.screen, i, field);
}

// Sets batch.field, with the kinds of all cells of the batch.
HWY_NOINLINE void setFields(const TileView& view, SheetBatch& batch) {
  batch.field.parallel = view.screen->parallel();
  for (std::size_t i = 0; i < SheetBatch::size; i += hn::Lanes(DD()))
    fitPlane(view, i, batch);
  for (std::size_t i = 0; i < SheetBatch::size; i += hn::Lanes(DF()))
    setFieldKinds(view, i, batch);
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
