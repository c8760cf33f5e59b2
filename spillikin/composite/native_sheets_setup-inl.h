// Whole cells to sheets (see native_sheets.h), the faces of a cell as the lanes of vectors, in double precision.
// Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_SHEETS_SETUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_SHEETS_SETUP_INL_H
#undef SPILLIKIN_NATIVE_SHEETS_SETUP_INL_H
#else
#define SPILLIKIN_NATIVE_SHEETS_SETUP_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "spillikin/composite/native_centres.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_edge_on-inl.h"
#include "spillikin/composite/native_forms-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_linear-inl.h"
#include "spillikin/composite/native_piece_share-inl.h"
#include "spillikin/composite/native_sheets.h"
#include "spillikin/composite/native_sheets_crossing-inl.h"
#include "spillikin/composite/native_vec3d-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DU = hn::Rebind<std::uint32_t, DD>;
using DL = hn::RebindToUnsigned<DD>;
using VU = hn::Vec<DU>;

// How steep a sheet may be, as a share of what is edge-on: where float leaves half of the certificate's tolerance
// unknown. A neighbour that is painted ray by ray has not the same bits; few rays if any meet such a sheet.
constexpr float steep_share = 0.01F;

// How far a quadrilateral's fourth corner may be from the plane of the others, as a share of the terms that add up to
// that, to be in it as good as: some hundred times what the rounding of the corners makes of it.
constexpr double same_plane = 1e-11;

constexpr std::size_t faces_most = 8;

// What is the same for all cells of a tile.
struct SheetFrame {
  const FacetTable* tables = facetTables();
  bool parallel;
  double z0;
  double least_pivot;  // as a share of what a form reaches over the tile: beyond, nearness would leave its limit
  double steepest;     // slope of nearness (as a share of the cell's, if relative)
  bool relative;
  double least_fold;  // of nearness over the tile: less is lost in float's rounding
  explicit SheetFrame(const TileView& view)
      : parallel(view.screen->parallel()),
        z0(view.screen->depths().z0),
        least_pivot(1.0 / (nearness_limit * view.nearness_scale)),
        steepest(double{view.steepest} / tile_size),
        relative(view.relative),
        least_fold(0.01 * (view.relative ? overlap_tolerance : double{view.overlap_at})) {}
};

// The corners of cell i out of their records.
HWY_INLINE void placeCorners(const TileView& view, const SheetFrame& frame, std::size_t i, SheetBatch& batch) {
  const DD d;
  const DH dh;
  const DU du;
  const VD x0 = hn::Set(d, static_cast<double>(view.x0));
  const VD y0 = hn::Set(d, static_cast<double>(view.y0));
  for (std::size_t k = 0; k < SheetBatch::corners; k += hn::Lanes(d)) {
    VD x, y, w, rest;
    hn::LoadInterleaved4(d, batch.record[i] + 4 * k, x, y, w, rest);
    const auto packed = hn::BitCast(DL(), rest);
    const auto value = hn::BitCast(dh, hn::TruncateTo(du, packed));
    const VD weight = frame.parallel ? hn::Set(d, 1.0) : w;
    x = hn::NegMulAdd(x0, weight, x);
    y = hn::NegMulAdd(y0, weight, y);
    hn::Store(x, d, batch.at[i][0] + k);
    hn::Store(y, d, batch.at[i][1] + k);
    hn::Store(frame.parallel ? hn::Sub(w, hn::Set(d, frame.z0)) : w, d, batch.at[i][2] + k);
    hn::Store(hn::PromoteTo(d, value), d, batch.at[i][3] + k);
    const auto depth = hn::DemoteTo(dh, w);
    const auto per_weight = frame.parallel ? hn::Set(dh, 1.0F) : hn::Div(hn::Set(dh, 1.0F), depth);
    const std::size_t at = SheetBatch::corners * i + k;
    hn::Store(hn::Mul(hn::DemoteTo(dh, x), per_weight), dh, batch.ranged[SheetBatch::x] + at);
    hn::Store(hn::Mul(hn::DemoteTo(dh, y), per_weight), dh, batch.ranged[SheetBatch::y] + at);
    hn::Store(depth, dh, batch.ranged[SheetBatch::depth] + at);
    hn::Store(value, dh, batch.ranged[SheetBatch::scalar] + at);
    hn::Store(hn::BitCast(DI(), hn::TruncateTo(du, hn::ShiftRight<32>(packed))), DI(), batch.piece + at);
  }
}

// The least and the largest of each eight values, for all cells of the batch.
template <class D, class T>
HWY_INLINE void rangesOf(D d, const T* values, T* lo, T* hi) {
  alignas(64) T half_lo[2 * SheetBatch::size], half_hi[2 * SheetBatch::size];
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < 2 * SheetBatch::size; i += lanes) {
    hn::Vec<D> v0, v1, v2, v3;
    hn::LoadInterleaved4(d, values + 4 * i, v0, v1, v2, v3);
    hn::Store(hn::Min(hn::Min(v0, v1), hn::Min(v2, v3)), d, half_lo + i);
    hn::Store(hn::Max(hn::Max(v0, v1), hn::Max(v2, v3)), d, half_hi + i);
  }
  for (std::size_t i = 0; i < SheetBatch::size; i += lanes) {
    hn::Vec<D> a, b;
    hn::LoadInterleaved2(d, half_lo + 2 * i, a, b);
    hn::Store(hn::Min(a, b), d, lo + i);
    hn::LoadInterleaved2(d, half_hi + 2 * i, a, b);
    hn::Store(hn::Max(a, b), d, hi + i);
  }
}

// The blocks of pixels with a centre in [lo, hi], half-open, with a margin for float's rounding of the projection.
HWY_INLINE void rangeBlocks(const float* lo, const float* hi, int pixels, std::int32_t* first, std::int32_t* past) {
  constexpr float margin = 0.01F;
  const hn::CappedTag<float, SheetBatch::size> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto end = hn::Set(d, static_cast<float>(pixels));
  for (std::size_t i = 0; i < SheetBatch::size; i += hn::Lanes(d)) {
    // A corner behind the eye may lie anywhere; its cell is handed back.
    const auto a = hn::Ceil(hn::Max(hn::Sub(hn::Load(d, lo + i), hn::Set(d, 0.5F + margin)), hn::Zero(d)));
    const auto b =
        hn::Floor(hn::Min(hn::Sub(hn::Load(d, hi + i), hn::Set(d, 0.5F - margin)), hn::Sub(end, hn::Set(d, 1.0F))));
    const auto none = hn::Gt(a, b);
    const auto low = hn::IfThenElseZero(hn::Not(none), hn::Min(a, end));
    const auto high = hn::IfThenElse(none, hn::Set(d, -4.0F), hn::Max(b, hn::Zero(d)));
    hn::Store(hn::ShiftRight<2>(hn::ConvertTo(di, low)), di, first + i);
    hn::Store(hn::Add(hn::ShiftRight<2>(hn::ConvertTo(di, high)), hn::Set(di, 1)), di, past + i);
  }
}

HWY_INLINE void setRanges(const TileView& view, SheetBatch& batch) {
  const hn::CappedTag<float, SheetBatch::size> d;
  for (std::size_t k = 0; k < SheetBatch::ranged_count; ++k)
    rangesOf(d, batch.ranged[k], batch.lo[k], batch.hi[k]);
  rangesOf(hn::RebindToSigned<decltype(d)>(), batch.piece, batch.first_piece, batch.last_piece);
  rangeBlocks(batch.lo[SheetBatch::x], batch.hi[SheetBatch::x], view.width, batch.block_x0, batch.block_x1);
  rangeBlocks(batch.lo[SheetBatch::y], batch.hi[SheetBatch::y], view.height, batch.block_y0, batch.block_y1);
}

// A cell's corners, from which a vector of faces takes one each.
class CornerSet {
 public:
  explicit HWY_INLINE CornerSet(const double (&at)[4][SheetBatch::corners]) : at_(at) {}
  using Index = hn::Vec<DL>;
  HWY_INLINE Vec3D point(Index i) const { return {get(0, i), get(1, i), get(2, i)}; }
  HWY_INLINE VD value(Index i) const { return get(3, i); }

 private:
  HWY_INLINE VD get(std::size_t k, Index i) const {
    const DD d;
    if constexpr (hn::MaxLanes(DD()) == SheetBatch::corners) {
      return hn::TableLookupLanes(hn::Load(d, at_[k]), hn::IndicesFromVec(d, i));
    } else {
      return hn::GatherIndex(d, at_[k], hn::BitCast(hn::RebindToSigned<DD>(), i));
    }
  }
  const double (&at_)[4][SheetBatch::corners];
};

// The positions of the corners a, b, c, d of a vector of faces, from face i on.
struct FaceCorners {
  VU backward;
  hn::Vec<DL> a, b, c, d;
  HWY_INLINE FaceCorners(const FacetTable& table, FacetCode code, std::size_t i) {
    const DU du;
    const VU shift = hn::Mul(hn::Iota(du, static_cast<std::uint32_t>(i)), hn::Set(du, facet_bits));
    const VU order = hn::Shr(hn::Set(du, code), shift);
    backward = hn::And(order, hn::Set(du, 1));
    VU round = hn::IfThenElse(hn::Eq(backward, hn::Zero(du)), hn::LoadU(du, table.forward.data() + i),
                              hn::LoadU(du, table.backward.data() + i));
    round = hn::Shr(round, hn::ShiftLeft<1>(hn::And(order, hn::Set(du, 6))));
    const auto take = [&](VU v) HWY_ATTR { return hn::PromoteTo(DL(), hn::And(v, hn::Set(du, 7))); };
    a = take(round);
    b = take(hn::ShiftRight<4>(round));
    c = take(hn::ShiftRight<8>(round));
    d = take(hn::ShiftRight<12>(round));
  }
};

HWY_INLINE unsigned laneBits(MD mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(DD(), mask, bits);
  return bits[0];
}

// What is known of the faces beyond their coefficients, a bit each: left through their first and second triangles, with
// a fold, steep, seen too nearly edge-on, a line then on the screen rather than two, with a scalar that rounding moves.
struct FaceBits {
  unsigned leaves1 = 0, leaves2 = 0, folded = 0, steep = 0, edge_on = 0, line = 0, unsteady = 0;
};

HWY_INLINE VD overTile(const Vec3D& form) {
  return hn::MulAdd(hn::Add(hn::Abs(form.x), hn::Abs(form.y)), hn::Set(DD(), static_cast<double>(tile_size)),
                    hn::Abs(form.z));
}

// v, kept so far from 0 that a form of this reach divided by it stays within nearness_limit.
HWY_INLINE VD awayFromZero(const SheetFrame& frame, VD v, VD reach) {
  const DD d;
  constexpr double tiny = 1e-150;  // two of them can be multiplied
  const VD least = hn::MulAdd(reach, hn::Set(d, frame.least_pivot), hn::Set(d, tiny));
  return hn::CopySign(hn::Max(hn::Abs(v), least), v);
}

HWY_INLINE void storeForm(const Vec3D& form, std::size_t i, float* x, float* y, float* z) {
  const DH dh;
  hn::Store(hn::DemoteTo(dh, form.x), dh, x + i);
  hn::Store(hn::DemoteTo(dh, form.y), dh, y + i);
  hn::Store(hn::DemoteTo(dh, form.z), dh, z + i);
}

// Where a corner, as far from another one as `way` says, is in the plane of normal n through that one, as good as;
// `off` is their product.
HWY_INLINE MD inPlane(const Vec3D& n, const Vec3D& way, VD off) {
  const VD terms = hn::MulAdd(hn::Abs(n.x), hn::Abs(way.x),
                              hn::MulAdd(hn::Abs(n.y), hn::Abs(way.y), hn::Mul(hn::Abs(n.z), hn::Abs(way.z))));
  return hn::Le(hn::Abs(off), hn::Mul(terms, hn::Set(DD(), same_plane)));
}

// What a cell's faces are held to.
struct FaceLimits {
  double nearness;       // of the cell
  double steepest_rate;  // of the scalar over the tile
};

// The sheets of the faces from i on; with the scalar's coefficients, or without.
template <bool Scalars>
HWY_INLINE void setFaces(const SheetFrame& frame, const CornerSet& corners, const FacetTable& table, FacetCode code,
                         const FaceLimits& limits, std::size_t i, SheetCell& cell, FaceBits& bits) {
  const DD d;
  const DH dh;
  const bool parallel = frame.parallel;
  const FaceCorners at(table, code, i);
  const Vec3D a = corners.point(at.a), b = corners.point(at.b), c = corners.point(at.c), f = corners.point(at.d);
  // The same on the screen, homogeneous.
  const auto flat = [&](Vec3D p) HWY_ATTR {
    if (parallel) p.z = hn::Set(d, 1.0);
    return p;
  };
  const Vec3D ha = flat(a), hb = flat(b), hc = flat(c), hf = flat(f);
  const Vec3D n = cross(b - a, c - a);
  const Vec3D diagonal = cross(ha, hc);
  const VD level = dot(a, n);
  Vec3D plane{n.x, n.y, parallel ? hn::Neg(level) : n.z};
  const VD pivot1 = awayFromZero(frame, parallel ? n.z : level, overTile(plane));
  const VD pivot2 = awayFromZero(frame, dot(diagonal, hf), overTile(diagonal));
  const VD inverse = hn::Div(hn::Set(d, 1.0), hn::Mul(pivot1, pivot2));
  const VD inverse1 = hn::Mul(inverse, pivot2);
  const VD inverse2 = hn::Mul(inverse, pivot1);
  // 1 above the fourth corner (over its depth, in perspective); nothing on a triangle.
  const VD quad = hn::PromoteTo(
      d, hn::BitCast(DI(), hn::And(hn::Shr(hn::Set(DU(), table.quads), hn::Iota(DU(), static_cast<std::uint32_t>(i))),
                                   hn::Set(DU(), 1))));
  const Vec3D side{hn::Mul(diagonal.x, inverse2), hn::Mul(diagonal.y, inverse2), hn::Mul(diagonal.z, inverse2)};
  plane = {hn::Mul(plane.x, inverse1), hn::Mul(plane.y, inverse1), hn::Mul(plane.z, inverse1)};
  if (!parallel) plane.z = hn::Sub(plane.z, hn::Set(d, frame.z0));
  // Of the cell's own nearness, where that is what float keeps a share of.
  const double scale = frame.relative ? limits.nearness : 1.0;
  const VD steepest = hn::Set(d, frame.steepest * scale);
  const auto slope = [&](VD x, VD y) HWY_ATTR { return hn::Add(hn::Abs(x), hn::Abs(y)); };
  const VD slope1 = slope(plane.x, plane.y);
  const VD off = dot(n, f - a);
  VD fold = hn::Mul(quad, hn::Neg(hn::Mul(off, inverse1)));
  VD second_pivot = pivot2;
  if (HWY_UNLIKELY(!hn::AllTrue(d, hn::Le(slope1, steepest)))) {
    const MD line = hn::AndNot(hn::Le(slope1, steepest), inPlane(n, f - a, off));
    fold = hn::IfThenZeroElse(line, fold);
    // Which way a line is left says the plane alone that the line is made of.
    second_pivot = hn::IfThenElse(line, pivot1, pivot2);
    bits.line |= laneBits(line) << i;
  }

  storeForm(plane, i, cell.plane[0], cell.plane[1], cell.plane[2]);
  storeForm(side, i, cell.side[0], cell.side[1], cell.side[2]);
  hn::Store(hn::DemoteTo(dh, fold), dh, cell.fold + i);
  const VD side_reach = overTile(side);
  if constexpr (Scalars) {
    const VD value = corners.value(at.a);
    const VD to_b = hn::Mul(hn::Sub(corners.value(at.b), value), inverse1);
    const VD to_c = hn::Mul(hn::Sub(corners.value(at.c), value), inverse1);
    const Vec3D third = cross(ha, hb);
    const auto mix = [&](VD u, VD v) HWY_ATTR { return hn::MulSub(to_c, u, hn::Mul(to_b, v)); };
    const Vec3D rate{mix(third.x, diagonal.x), mix(third.y, diagonal.y), mix(third.z, diagonal.z)};
    const VD bend = hn::Mul(quad, hn::Sub(hn::Sub(corners.value(at.d), value), dot(rate, hf)));
    storeForm(rate, i, cell.rate[0], cell.rate[1], cell.rate[2]);
    hn::Store(hn::DemoteTo(dh, value), dh, cell.base + i);
    hn::Store(hn::DemoteTo(dh, bend), dh, cell.bend + i);
    const VD fastest = hn::MulAdd(hn::Abs(bend), side_reach, overTile(rate));
    bits.unsteady |= laneBits(hn::Gt(fastest, hn::Set(d, limits.steepest_rate))) << i;
  }

  const VD folded = hn::Mul(hn::Abs(fold), side_reach);
  const VD slope2 = slope(hn::MulAdd(side.x, fold, plane.x), hn::MulAdd(side.y, fold, plane.y));
  const VD most = hn::Max(slope1, slope2);
  const MD turned = hn::Eq(hn::PromoteTo(d, hn::BitCast(DI(), at.backward)), hn::Set(d, 1.0));
  bits.leaves1 |= laneBits(hn::Xor(hn::Gt(pivot1, hn::Zero(d)), turned)) << i;
  bits.leaves2 |= laneBits(hn::Xor(hn::Gt(second_pivot, hn::Zero(d)), turned)) << i;
  bits.folded |= laneBits(hn::Gt(folded, hn::Set(d, frame.least_fold * scale))) << i;
  bits.steep |= laneBits(hn::Gt(most, hn::Mul(steepest, hn::Set(d, double{steep_share})))) << i;
  bits.edge_on |= laneBits(hn::Not(hn::Le(most, steepest))) << i;
}

// Face f's triangles as a sheet each.
HWY_INLINE void splitFace(SheetCell& cell, unsigned f) {
  const unsigned g = SheetCell::second + f;
  for (std::size_t k = 0; k < 3; ++k) {
    cell.plane[k][g] = cell.plane[k][f] + cell.fold[f] * cell.side[k][f];
    cell.rate[k][g] = cell.rate[k][f] + cell.bend[f] * cell.side[k][f];
  }
  for (std::size_t k = 0; k < 3; ++k)
    cell.side[k][f] = cell.side[k][g] = 0.0F;
  cell.base[g] = cell.base[f];
  cell.fold[f] = cell.bend[f] = cell.fold[g] = cell.bend[g] = 0.0F;
}

// The bits set in a byte, lowest first, filled up with the lowest.
struct BitLists {
  alignas(64) std::uint8_t bit[256][8] = {};
  constexpr BitLists() {
    for (unsigned byte = 0; byte < 256; ++byte) {
      unsigned n = 0;
      for (unsigned k = 0; k < 8; ++k) {
        if ((byte >> k & 1U) != 0) bit[byte][n++] = static_cast<std::uint8_t>(k);
      }
      for (; n < 8; ++n)
        bit[byte][n] = bit[byte][0];
    }
  }
};
constexpr BitLists bit_lists;

HWY_INLINE unsigned listFaces(unsigned faces, std::uint8_t* out) {
  std::memcpy(out, bit_lists.bit[faces], 8);
  return static_cast<unsigned>(std::popcount(faces));
}
// A list of seconds alone is still to be filled up with its first.
HWY_INLINE void addSeconds(unsigned faces, std::uint8_t* out, unsigned& count) {
  const bool alone = count == 0;
  for (; faces != 0; faces &= faces - 1)
    out[count++] = static_cast<std::uint8_t>(SheetCell::second + static_cast<unsigned>(std::countr_zero(faces)));
  if (HWY_UNLIKELY(alone)) std::fill(out + count, out + SheetCell::second, out[0]);
}

// Float's rounding of the nearness on sheet k, anywhere on the tile.
HWY_INLINE float roundingOf(const SheetCell& cell, std::size_t k) {
  return float_rounding * mostTerms(sheetForm(cell.plane, k));
}

// By which sheets the cell is entered and left.
HWY_INLINE void sortSheets(const FacetTable& table, FacetCode code, const FaceBits& bits, SheetCell& cell) {
  const unsigned split = (bits.leaves1 ^ bits.leaves2) & table.quads;
  const unsigned gaps = split & code >> inward_shift;
  const unsigned entered = table.faces & ~gaps & ~bits.leaves1;
  const unsigned left = table.faces & ~gaps & bits.leaves1;
  cell.entered_count = listFaces(entered, cell.entered);
  cell.left_count = listFaces(left, cell.left);
  cell.steep = (bits.steep & table.faces) * (1U + (1U << SheetCell::second));
  cell.folded = (bits.folded & table.faces & ~split) != 0;
  cell.gap_count = 0;
  if (HWY_LIKELY(split == 0)) return;
  for (unsigned rest = split; rest != 0; rest &= rest - 1)
    splitFace(cell, static_cast<unsigned>(std::countr_zero(rest)));
  addSeconds(split & ~gaps & ~bits.leaves2, cell.entered, cell.entered_count);
  addSeconds(split & ~gaps & bits.leaves2, cell.left, cell.left_count);
  for (unsigned rest = gaps; rest != 0; rest &= rest - 1) {
    const auto f = static_cast<std::uint8_t>(std::countr_zero(rest));
    const auto g = static_cast<std::uint8_t>(f + SheetCell::second);
    const float rounding = roundingOf(cell, f) + roundingOf(cell, g);
    cell.gap[cell.gap_count++] =
        (bits.leaves1 >> f & 1U) != 0 ? SheetCell::Gap{f, g, rounding} : SheetCell::Gap{g, f, rounding};
  }
}

// The forms of all sheets, at most where they are entered and at least where they are left, anywhere on a block: to be
// evaluated at the block's middle.
struct SheetReach {
  alignas(64) float most[SheetCell::most], least[SheetCell::most];            // of plane[2]
  alignas(64) float side_most[SheetCell::most], side_least[SheetCell::most];  // of side[2]

  HWY_INLINE explicit SheetReach(const SheetCell& cell) {
    const DF d;
    // Float's rounding of a form anywhere in the tile, as a share of its terms.
    const VF rounding = hn::Set(d, float_rounding), reach = hn::Set(d, block_reach),
             size = hn::Set(d, float{tile_size});
    for (std::size_t k = 0; k < SheetCell::most; k += hn::Lanes(d)) {
      const auto load = [&](const float* values) HWY_ATTR { return hn::LoadU(d, values + k); };
      const auto slopeOf = [&](const SheetCell::Coefficient(&form)[3])
                               HWY_ATTR { return hn::Add(hn::Abs(load(form[0])), hn::Abs(load(form[1]))); };
      const VF slope = slopeOf(cell.plane), side_slope = slopeOf(cell.side);
      const VF fold = load(cell.fold), t = load(cell.plane[2]), side = load(cell.side[2]);
      const VF side_terms = hn::MulAdd(size, side_slope, hn::Abs(side));
      const VF terms = hn::MulAdd(hn::Abs(fold), side_terms, hn::MulAdd(size, slope, hn::Abs(t)));
      const VF margin = hn::MulAdd(reach, slope, hn::Mul(rounding, terms));
      const VF side_margin = hn::CopySign(hn::Mul(reach, side_slope), fold);
      hn::Store(hn::Add(t, margin), d, most + k);
      hn::Store(hn::Sub(t, margin), d, least + k);
      hn::Store(hn::Add(side, side_margin), d, side_most + k);
      hn::Store(hn::Sub(side, side_margin), d, side_least + k);
    }
  }
};

// The blocks on which the last sheet entered may come before the first one left and, of a piece of the cell, something
// between them may lie within its planes. A few blocks of a whole cell are not worth the search.
template <bool Folded>
HWY_NOINLINE std::uint64_t blockBits(const SheetCell& cell, std::span<const WholeCell::Bound> bounds) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr int few = 3;
  const std::uint64_t box = boxBits(cell.blocks);
  if (box == 0 || (bounds.empty() && std::popcount(box) <= few)) return box;
  const SheetReach reach(cell);
  std::uint64_t bits = 0;
  const auto first = static_cast<std::size_t>(cell.blocks.y0) * block_columns;
  const auto past = static_cast<std::size_t>(cell.blocks.y1) * block_columns;
  for (std::size_t b = first / lanes * lanes; b < past; b += lanes) {
    const VF x = hn::Load(d, block_middles.x + b), y = hn::Load(d, block_middles.y + b);
    const auto sheet = [&](const SheetCell::Coefficient(&of)[3], const float* t, std::size_t k) HWY_ATTR {
      return formAt(Form{of[0][k], of[1][k], t[k]}, x, y);
    };
    const auto at = [&](std::size_t k, const float* t, const float* side) HWY_ATTR {
      const VF z = sheet(cell.plane, t, k);
      if constexpr (!Folded) return z;
      return hn::MulAdd(hn::Set(d, cell.fold[k]), hn::Max(sheet(cell.side, side, k), hn::Zero(d)), z);
    };
    VF near = at(cell.entered[0], reach.most, reach.side_most);
    for (unsigned k = 1; k < cell.entered_count; ++k)
      near = hn::Min(near, at(cell.entered[k], reach.most, reach.side_most));
    VF far = at(cell.left[0], reach.least, reach.side_least);
    for (unsigned k = 1; k < cell.left_count; ++k)
      far = hn::Max(far, at(cell.left[k], reach.least, reach.side_least));
    auto some = hn::Gt(near, far);
    for (const WholeCell::Bound& bound : bounds) {
      const VF z = form(bound.nearness, x, y);
      const VF margin =
          hn::Set(d, block_reach * (std::abs(bound.nearness[0]) + std::abs(bound.nearness[1])) + bound.rounding);
      some = hn::And(some, bound.entry ? hn::Lt(far, hn::Add(z, margin)) : hn::Gt(near, hn::Sub(z, margin)));
    }
    bits |= std::uint64_t{maskBits(some)} << b;
  }
  return bits & box;
}

// The depths of cell i to nearness; `lost` is how much float loses of that.
HWY_INLINE NearnessRange nearnessRange(const SheetFrame& frame, const SheetBatch& batch, std::size_t i, float& lost) {
  const double near = batch.lo[SheetBatch::depth][i], far = batch.hi[SheetBatch::depth][i];
  const auto nearness = [&](double depth) {
    return static_cast<float>(frame.parallel ? frame.z0 - depth : 1.0 / depth - frame.z0);
  };
  const double most = frame.parallel ? std::max(std::abs(near), std::abs(far)) : 1.0 / near;
  lost = float_rounding * static_cast<float>(most);
  return {nearness(far), nearness(near)};
}

// Steep sheets that no pixel's ray meets in the cell need no more care. False where one that is a line on the screen,
// of the faces `lines`, may be met.
HWY_INLINE bool settleSteep(const NearnessRange& range, float lost, unsigned lines, SheetCell& cell) {
  std::uint32_t of_gaps = 0, untold = 0;
  for (unsigned k = 0; k < cell.gap_count; ++k)
    of_gaps |= 1U << cell.gap[k].leaves | 1U << cell.gap[k].enters;
  const auto look = [&](std::size_t k) HWY_ATTR {
    if ((cell.steep >> k & 1U) == 0) return;
    const Form plane = sheetForm(cell.plane, k), side = sheetForm(cell.side, k);
    const VF fold = hn::Set(DF(), cell.fold[k]);
    const auto nearnessAt = [&](const VF& x, const VF& y) HWY_ATTR {
      return hn::MulAdd(fold, hn::Max(formAt(side, x, y), hn::Zero(DF())), formAt(plane, x, y));
    };
    const float off = lost + float_rounding * (mostTerms(plane) + std::abs(cell.fold[k]) * mostTerms(side));
    if (!passOutside(nearnessAt, boxBits(cell.blocks), range, off)) untold |= 1U << k;
  };
  for (unsigned k = 0; k < cell.entered_count; ++k)
    look(cell.entered[k]);
  for (unsigned k = 0; k < cell.left_count; ++k)
    look(cell.left[k]);
  cell.steep &= of_gaps | untold;
  return (untold & lines) == 0;
}

// What cell i's faces make of it: false where one is seen edge-on that rays may meet or the cell is not entered or not
// left. `steady` as long as rounding does not move the scalar, if that was asked for.
template <bool Scalars>
HWY_INLINE bool setSheets(const SheetFrame& frame, const FacetTable& table, FacetCode code, std::size_t i,
                          SheetBatch& batch, bool& steady) {
  SheetCell& cell = batch.cell[i];
  const float near = batch.lo[SheetBatch::depth][i], far = batch.hi[SheetBatch::depth][i];
  // Where the rounding of a rate moves the scalar noticeably, it takes full care.
  constexpr double noticeable = 0.02;
  const double range = double{batch.hi[SheetBatch::scalar][i] - batch.lo[SheetBatch::scalar][i]};
  const FaceLimits limits{2.0 / double{near + far},
                          range * noticeable / (double{float_rounding} * (frame.parallel ? 1.0 : double{far}))};
  const CornerSet corners(batch.at[i]);
  FaceBits bits;
  for (std::size_t k = 0; k < faces_most; k += hn::Lanes(DD()))
    setFaces<Scalars>(frame, corners, table, code, limits, k, cell, bits);
  if (HWY_UNLIKELY((bits.edge_on & ~bits.line & table.faces) != 0)) return false;
  sortSheets(table, code, bits, cell);
  if (HWY_UNLIKELY(cell.steep != 0)) {
    float lost = 0.0F;
    const NearnessRange in_cell = nearnessRange(frame, batch, i, lost);
    if (!settleSteep(in_cell, lost, bits.line, cell)) return false;
  }
  steady = (bits.unsteady & ~bits.line & table.faces) == 0;
  return cell.entered_count > 0 && cell.left_count > 0;
}

// Cell i of the batch; handed back unless its care says otherwise. Where the field is linear in it, and `linear` is
// wanted, only where rays cross it is set.
HWY_INLINE void setCell(const TileView& view, const SheetFrame& frame, mesh::CellType type, FacetCode code, bool linear,
                        std::size_t i, SheetBatch& batch) {
  SheetCell& cell = batch.cell[i];
  cell.care = Care::edge_on;
  cell.linear = false;
  const float near = batch.lo[SheetBatch::depth][i];
  const float far = batch.hi[SheetBatch::depth][i];
  if (HWY_UNLIKELY(code == not_of_planes || (!frame.parallel && !(near > 0.0F)))) return;
  cell.blocks = {batch.block_x0[i], batch.block_y0[i], batch.block_x1[i], batch.block_y1[i]};
  const FacetTable& table = frame.tables[static_cast<std::size_t>(type)];
  bool steady = true;
  if (linear && batch.field.kind[i] != Kind::full) {
    if (HWY_UNLIKELY(!setSheets<false>(frame, table, code, i, batch, steady))) return;
    cell.linear = true;
    cell.care = Care::none;
    return;
  }
  if (HWY_UNLIKELY(!setSheets<true>(frame, table, code, i, batch, steady))) return;
  cell.look = {view.screen->pieces().data(), batch.first_piece[i], batch.last_piece[i], batch.lo[SheetBatch::scalar][i],
               batch.hi[SheetBatch::scalar][i]};
  cell.look.straighten(cell.line);
  cell.care = view.peaks ? Care::peak : cell.look.care((far - near) * view.longest, steady);
}

HWY_INLINE mesh::Id cellOf(const sort::Order& order, Entry entry) {
  return entry.cut() ? order.cells[order.cuts[entry.index()].entry] : entry.index();
}

// The corners of a cell as those of a hexahedron some of which are the same, by type up to the hexahedron: four bits
// each, the first one lowest.
constexpr std::array<std::uint32_t, 4> as_hexahedron{0x33332210, 0x44443210, 0x55432210, 0x76543210};

// All corners of the batch before the first is read: they are written in smaller parts than they are read in, and must
// have come to rest by then.
HWY_NOINLINE void gatherRecords(const Screen& screen, std::span<const Entry> cells, bool linear, SheetBatch& batch) {
  const mesh::Mesh& mesh = screen.mesh();
  const sort::Order& order = screen.frame().order;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const mesh::Id cell = cellOf(order, cells[i]);
    const mesh::Id* corner = mesh.cell_vertex.data() + mesh.cell_vertex_offset[cell];
    const std::size_t count =
        std::min<std::size_t>(mesh.cell_vertex_offset[cell + 1] - mesh.cell_vertex_offset[cell], SheetBatch::corners);
    double* records = batch.record[i];
    for (std::size_t k = 0; k < SheetBatch::corners; ++k)
      std::memcpy(records + 4 * k, screen.vertices() + corner[k < count ? k : 0], sizeof(Vertex));
    if (!screen.cell_values().empty()) {
      for (std::size_t k = 0; k < SheetBatch::corners; ++k) {
        auto* last = reinterpret_cast<char*>(records + 4 * k + 3);
        std::memcpy(last, &screen.cell_values()[cell], sizeof(float));
        std::memcpy(last + sizeof(float), &screen.cell_pieces()[cell], sizeof(std::uint32_t));
      }
    }
    if (!linear) continue;
    const auto type = static_cast<std::size_t>(mesh.cell_type[cell]);
    const std::uint32_t as = as_hexahedron[std::min(type, as_hexahedron.size() - 1)];
    for (std::size_t k = 0; k < SheetBatch::corners; ++k)
      std::memcpy(batch.corner[k] + 4 * i, records + 4 * (as >> (4 * k) & 7U), sizeof(Vertex));
  }
}

HWY_INLINE void prefetchCells(const Screen& screen, std::span<const Entry> cells) {
  const mesh::Mesh& mesh = screen.mesh();
  const std::size_t n = std::min<std::size_t>(cells.size(), SheetBatch::size);
  for (std::size_t i = 0; i < n; ++i) {
    if (cells[i].cut()) continue;
    hwy::Prefetch(mesh.cell_vertex.data() + mesh.cell_vertex_offset[cells[i].index()]);
  }
}

// Only the blocks that a piece may cover.
HWY_INLINE void trimBlocks(const TileView& view, const PixelBox& piece, Box& blocks) {
  const auto first = [](int pixel) { return std::max(pixel, 0) / 4; };
  const auto past = [](int pixel) { return (std::max(pixel, 0) + 3) / 4; };
  blocks = {std::max(blocks.x0, first(piece.x0 - view.x0)), std::max(blocks.y0, first(piece.y0 - view.y0)),
            std::min(blocks.x1, past(piece.x1 - view.x0)), std::min(blocks.y1, past(piece.y1 - view.y0))};
}

// Fills `batch` for `cells`, at most as many as it holds; `next` will come after them. Cells with a linear field are
// told from others where `linear`.
HWY_NOINLINE void setUpSheets(const TileView& view, std::span<const Entry> cells, std::span<const Entry> next,
                              bool linear, SheetBatch& batch) {
  const Screen& screen = *view.screen;
  const SheetFrame frame(view);
  gatherRecords(screen, cells, linear, batch);
  prefetchCells(screen, next);
  for (std::size_t i = 0; i < cells.size(); ++i)
    placeCorners(view, frame, i, batch);
  setRanges(view, batch);
  if (linear) setFields(view, batch);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const mesh::Id cell = cellOf(screen.frame().order, cells[i]);
    const bool cut = cells[i].cut();
    setCell(view, frame, screen.mesh().cell_type[cell], screen.facets()[cell], linear, i, batch);
    SheetCell& sheets = batch.cell[i];
    if (sheets.care == Care::edge_on) continue;
    // Those of a piece wait for its planes.
    if (cut) trimBlocks(view, view.pieces[cells[i].index()], sheets.blocks);
    if (!cut) sheets.block_bits = sheets.folded ? blockBits<true>(sheets, {}) : blockBits<false>(sheets, {});
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
