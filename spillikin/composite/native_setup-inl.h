// Tetrahedra to screen planes, a vector of cells at a time, in double precision. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_SETUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_SETUP_INL_H
#undef SPILLIKIN_NATIVE_SETUP_INL_H
#else
#define SPILLIKIN_NATIVE_SETUP_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_blocks-inl.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_edge_on-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_kinds-inl.h"
#include "spillikin/composite/native_part-inl.h"
#include "spillikin/composite/native_vec3d-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Ids of the corners of each cell in ascending order, and whether that turned the cell over.
HWY_INLINE void sortCorners(const Screen& screen, std::span<const Entry> cells, CellBatch& batch) {
  const mesh::Id* corners = screen.mesh().cell_vertex.data();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    std::memcpy(batch.id + 4 * i, corners + std::size_t{4} * cells[i].index(), 4 * sizeof(mesh::Id));
  }
  for (std::size_t i = cells.size(); i < batch_cells; ++i)
    std::memcpy(batch.id + 4 * i, batch.id, 4 * sizeof(mesh::Id));
  const hn::CappedTag<std::uint32_t, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  using V = hn::Vec<decltype(d)>;
  for (std::size_t i = 0; i < batch_cells; i += hn::Lanes(d)) {
    V v0, v1, v2, v3;
    hn::LoadInterleaved4(d, batch.id + 4 * i, v0, v1, v2, v3);
    V odd = hn::Zero(d);
    const auto order = [&](V& a, V& b) HWY_ATTR {
      odd = hn::Xor(odd, hn::VecFromMask(d, hn::Gt(a, b)));
      const V lo = hn::Min(a, b);
      b = hn::Max(a, b);
      a = lo;
    };
    order(v0, v1);
    order(v2, v3);
    order(v0, v2);
    order(v1, v3);
    order(v1, v2);
    hn::Store(v0, d, batch.sorted[0] + i);
    hn::Store(v1, d, batch.sorted[1] + i);
    hn::Store(v2, d, batch.sorted[2] + i);
    hn::Store(v3, d, batch.sorted[3] + i);
    hn::Store(hn::BitCast(di, odd), di, batch.odd + i);
  }
}

// One corner of a vector of cells, relative to the tile's corner and (in a parallel view) to the middle depth.
struct Corner {
  Vec3D p;
  VD w;
  hn::Vec<DH> value;
  hn::Vec<DI> piece;
};

HWY_INLINE Corner loadCorner(const TileView& view, const double* records) {
  const DD d;
  const DH dh;
  const hn::RebindToUnsigned<DD> du;
  const hn::Rebind<std::uint32_t, DD> du32;
  const DI di;
  VD x, y, w, rest;
  hn::LoadInterleaved4(d, records, x, y, w, rest);
  const auto packed = hn::BitCast(du, rest);
  Corner c;
  c.value = hn::BitCast(dh, hn::TruncateTo(du32, packed));
  c.piece = hn::BitCast(di, hn::TruncateTo(du32, hn::ShiftRight<32>(packed)));
  c.w = w;
  const VD x0 = hn::Set(d, static_cast<double>(view.x0));
  const VD y0 = hn::Set(d, static_cast<double>(view.y0));
  if (view.screen->parallel()) {
    c.p = {hn::Sub(x, x0), hn::Sub(y, y0), hn::Sub(w, hn::Set(d, view.screen->depths().z0))};
  } else {
    c.p = {hn::NegMulAdd(x0, w, x), hn::NegMulAdd(y0, w, y), w};
  }
  return c;
}

HWY_INLINE void storeHalf(const VD& v, float* out) {
  const DH dh;
  hn::Store(hn::DemoteTo(dh, v), dh, out);
}

// Of a face, where its canonical side is the positive one, and twice its area on the screen: in perspective, that times
// the depths of its corners.
struct FaceSide {
  MD positive;
  VD area;
};

// The plane of face `k` through corner `a` with normal `n`.
HWY_INLINE FaceSide setFace(const TileView& view, const Vec3D& n, const Vec3D& a, std::size_t k, std::size_t i,
                            CellBatch& batch) {
  const DD d;
  const Depths& depths = view.screen->depths();
  const VD size = hn::Set(d, static_cast<double>(tile_size));
  const VD level = dot(n, a);
  // Nearness on the plane = (n.x x + n.y y + constant) / pivot (- z0 in perspective).
  const VD constant = depths.parallel ? hn::Neg(level) : n.z;
  const VD pivot = hn::Add(depths.parallel ? n.z : level, hn::Zero(d));  // -0 becomes 0
  const VD reach = hn::MulAdd(hn::Add(hn::Abs(n.x), hn::Abs(n.y)), size, hn::Abs(constant));
  // A plane is kept so far from edge-on that the nearness on it stays below the limit anywhere in the tile.
  const VD least = hn::MulAdd(reach, hn::Set(d, 1.0 / (nearness_limit * view.nearness_scale)), hn::Set(d, 1e-300));
  const MD positive = hn::Ge(pivot, hn::Zero(d));
  const VD magnitude = hn::Max(hn::Abs(pivot), least);
  const VD inverse = hn::Div(hn::Set(d, 1.0), hn::IfThenElse(positive, magnitude, hn::Neg(magnitude)));
  const DH dh;
  const auto x = hn::DemoteTo(dh, hn::Mul(n.x, inverse));
  const auto y = hn::DemoteTo(dh, hn::Mul(n.y, inverse));
  hn::Store(x, dh, batch.face[k][0] + i);
  hn::Store(y, dh, batch.face[k][1] + i);
  const auto slope = hn::Mul(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Set(dh, static_cast<float>(tile_size)));
  hn::Store(k == 0 ? slope : hn::Max(slope, hn::Load(dh, batch.slope + i)), dh, batch.slope + i);
  const VD z = hn::Mul(constant, inverse);
  storeHalf(depths.parallel ? z : hn::Sub(z, hn::Set(d, depths.z0)), batch.face[k][2] + i);
  return {positive, hn::Abs(pivot)};
}

// The most nearness between the ends of a fragment, for its planes' rounding too: over the cell's outline the extent
// rises to one ray as a pyramid does from its base, so that it is three times its mean there.
HWY_INLINE VD longestExtent(VD volume, VD outline, std::size_t i, const CellBatch& batch) {
  const DD d;
  const VD slope = hn::PromoteTo(d, hn::Load(DH(), batch.slope + i));
  const VD rounding = hn::Mul(slope, hn::Set(d, static_cast<double>(float_rounding)));
  return hn::Add(hn::Div(hn::Abs(volume), hn::Max(outline, hn::Set(d, 1e-300))), rounding);
}

// Pixels to blocks: those with a centre in [lo, hi], with a margin for float's rounding of the projection.
HWY_INLINE void setBlocks(hn::Vec<DH> lo, hn::Vec<DH> hi, int pixels, std::int32_t* first, std::int32_t* last) {
  constexpr float margin = 0.01F;
  const DH dh;
  const DI di;
  const auto end = hn::Set(dh, static_cast<float>(pixels) - 1.0F);
  const auto a = hn::Ceil(hn::Max(hn::Sub(lo, hn::Set(dh, 0.5F + margin)), hn::Zero(dh)));
  const auto b = hn::Floor(hn::Min(hn::Sub(hi, hn::Set(dh, 0.5F - margin)), end));
  // An empty range must stay empty in blocks.
  const auto empty = hn::Gt(a, b);
  const auto low = hn::IfThenElse(empty, hn::Set(dh, 4.0F), hn::Min(a, end));
  const auto high = hn::IfThenElse(empty, hn::Zero(dh), hn::Max(b, hn::Zero(dh)));
  hn::Store(hn::ShiftRight<2>(wholeNumber(dh, low)), di, first);
  hn::Store(hn::ShiftRight<2>(wholeNumber(dh, high)), di, last);
}

HWY_INLINE PixelBoxes setExtent(const TileView& view, const Corner (&c)[4], VD depth_lo, std::size_t i,
                                CellBatch& batch) {
  const DH dh;
  const DI di;
  hn::Vec<DH> x[4], y[4];
  for (int k = 0; k < 4; ++k) {
    x[k] = hn::DemoteTo(dh, c[k].p.x);
    y[k] = hn::DemoteTo(dh, c[k].p.y);
  }
  auto straddles = hn::MaskFromVec(hn::Zero(dh));
  if (!view.screen->parallel()) {
    straddles = hn::Le(hn::DemoteTo(dh, depth_lo), hn::Zero(dh));
    for (int k = 0; k < 4; ++k) {
      const auto inverse = hn::Div(hn::Set(dh, 1.0F), hn::DemoteTo(dh, c[k].w));
      x[k] = hn::Mul(x[k], inverse);
      y[k] = hn::Mul(y[k], inverse);
    }
  }
  const auto lowest = [&](const hn::Vec<DH>(&v)[4]) HWY_ATTR {
    return hn::IfThenElse(straddles, hn::Set(dh, -1e9F), hn::Min(hn::Min(v[0], v[1]), hn::Min(v[2], v[3])));
  };
  const auto highest = [&](const hn::Vec<DH>(&v)[4]) HWY_ATTR {
    return hn::IfThenElse(straddles, hn::Set(dh, 1e9F), hn::Max(hn::Max(v[0], v[1]), hn::Max(v[2], v[3])));
  };
  const PixelBoxes box{lowest(x), highest(x), lowest(y), highest(y), straddles};
  setBlocks(box.x0, box.x1, view.width, batch.block_x0 + i, batch.block_x1 + i);
  setBlocks(box.y0, box.y1, view.height, batch.block_y0 + i, batch.block_y1 + i);
  hn::Store(hn::BitCast(di, hn::IfThenElseZero(straddles, hn::Set(dh, 1.0F))), di, batch.straddles + i);
  return box;
}

// The scalar as a linear function of Corner::p.
struct ScalarField {
  Vec3D slope;
  VD apex;
};

HWY_INLINE ScalarField scalarField(const Corner (&c)[4], const Vec3D& n1, const Vec3D& n2, const Vec3D& n3,
                                   const VD& volume) {
  const DD d;
  const VD s0 = hn::PromoteTo(d, c[0].value);
  const VD inverse = hn::Div(hn::Set(d, 1.0), volume);
  const VD a1 = hn::Mul(hn::Sub(hn::PromoteTo(d, c[1].value), s0), inverse);
  const VD a2 = hn::Mul(hn::Sub(s0, hn::PromoteTo(d, c[2].value)), inverse);
  const VD a3 = hn::Mul(hn::Sub(hn::PromoteTo(d, c[3].value), s0), inverse);
  const auto mix = [&](VD u, VD v, VD w) HWY_ATTR { return hn::MulAdd(a1, u, hn::MulAdd(a2, v, hn::Mul(a3, w))); };
  const Vec3D g{mix(n1.x, n2.x, n3.x), mix(n1.y, n2.y, n3.y), mix(n1.z, n2.z, n3.z)};
  return {g, hn::Sub(s0, dot(g, c[0].p))};
}

// The same as a function of the ray and the depth along it (see CellBatch).
HWY_INLINE void setScalar(const ScalarField& field, const VD& middle, std::size_t i, CellBatch& batch) {
  const auto& [g, apex] = field;
  storeHalf(hn::MulAdd(g.z, middle, apex), batch.at[2] + i);
  if (batch.parallel) {
    storeHalf(g.x, batch.at[0] + i);
    storeHalf(g.y, batch.at[1] + i);
    storeHalf(hn::Neg(g.z), batch.apex + i);
  } else {
    storeHalf(hn::Mul(g.x, middle), batch.at[0] + i);
    storeHalf(hn::Mul(g.y, middle), batch.at[1] + i);
    storeHalf(apex, batch.apex + i);
  }
}

// The depths of what of the `large` cells lies in the tile, and of all of the others; sets CellBatch::part.
HWY_NOINLINE DepthRange partOf(const TileView& view, const Corner (&c)[4], const ScalarField& field, MH large,
                               const DepthRange& whole, std::size_t i, CellBatch& batch) {
  const DD d;
  const DH dh;
  const auto half = [](VD v) HWY_ATTR { return hn::DemoteTo(DH(), v); };
  PartCorner corner[4];
  for (std::size_t k = 0; k < 4; ++k)
    corner[k] = {half(c[k].p.x), half(c[k].p.y), half(c[k].p.z), c[k].value};
  TilePart part(view, corner, batch.parallel);
  part.takeRays({half(field.slope.x), half(field.slope.y), half(field.slope.z), half(field.apex)}, i, batch);
  const MH known = hn::And(large, hn::Le(part.depth.lo, part.depth.hi));
  hn::BlendedStore(part.value.lo, known, dh, batch.part[0] + i);
  hn::BlendedStore(part.value.hi, known, dh, batch.part[1] + i);
  batch.parts = true;
  const VH largest = hn::Max(hn::Abs(part.depth.lo), hn::Abs(part.depth.hi));
  const VH rounding = hn::MulAdd(hn::Set(dh, share_rounding), half(hn::Sub(whole.hi, whole.lo)),
                                 hn::Mul(hn::Set(dh, float_rounding), largest));
  // Where nothing is known, as if the part had no bounds.
  const VH least = hn::IfThenElse(known, hn::Sub(part.depth.lo, rounding), hn::Set(dh, -no_bound));
  const VH most = hn::IfThenElse(known, hn::Add(part.depth.hi, rounding), hn::Set(dh, no_bound));
  return {hn::Max(whole.lo, hn::PromoteTo(d, least)), hn::Min(whole.hi, hn::PromoteTo(d, most))};
}

HWY_INLINE void setRange(const Corner (&c)[4], std::size_t i, CellBatch& batch) {
  const DH dh;
  const DI di;
  const VH least = hn::Min(hn::Min(c[0].value, c[1].value), hn::Min(c[2].value, c[3].value));
  const VH most = hn::Max(hn::Max(c[0].value, c[1].value), hn::Max(c[2].value, c[3].value));
  hn::Store(least, dh, batch.lo + i);
  hn::Store(most, dh, batch.hi + i);
  hn::Store(least, dh, batch.part[0] + i);
  hn::Store(most, dh, batch.part[1] + i);
  hn::Store(hn::Min(hn::Min(c[0].piece, c[1].piece), hn::Min(c[2].piece, c[3].piece)), di, batch.first_piece + i);
  hn::Store(hn::Max(hn::Max(c[0].piece, c[1].piece), hn::Max(c[2].piece, c[3].piece)), di, batch.last_piece + i);
}

// All corners of the batch before the first is read: they are written in smaller parts than they are read in, and must
// have come to rest by then.
HWY_NOINLINE void gatherCorners(const Screen& screen, std::span<const Entry> cells, CellBatch& batch) {
  const Vertex* vertices = screen.vertices();
  for (std::size_t i = 0; i < batch_cells; ++i) {
    for (std::size_t k = 0; k < 4; ++k)
      std::memcpy(batch.corner[k] + 4 * i, vertices + batch.sorted[k][i], sizeof(Vertex));
  }
  if (screen.cell_values().empty()) return;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const mesh::Id cell = cells[i].index();
    for (std::size_t k = 0; k < 4; ++k) {
      auto* last = reinterpret_cast<char*>(batch.corner[k] + 4 * i + 3);
      std::memcpy(last, &screen.cell_values()[cell], sizeof(float));
      std::memcpy(last + sizeof(float), &screen.cell_pieces()[cell], sizeof(std::uint32_t));
    }
  }
}

// A cell so flat that the rounding of a depth moves the scalar noticeably has it kept within its range; one with a face
// seen edge-on is handed back where float does not tell the face's sides.
HWY_NOINLINE void setKinds(const TileView& view, std::size_t count, CellBatch& batch) {
  const DF d;
  const DIF di;
  const Piece* pieces = view.screen->pieces().data();
  const auto peaks = hn::Ne(hn::Set(di, view.peaks ? 1 : 0), hn::Zero(di));
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto load = [&](const float* values) HWY_ATTR { return hn::Load(d, values + i); };
    const auto steady = steadyCells(view, i, batch);
    if (batch.parts && !view.peaks) narrowRange(view, steady, i, batch);
    VF steepest = hn::Set(d, view.steepest);
    if (view.relative) steepest = hn::Mul(hn::Add(steepest, steepest), load(batch.half_per_middle));
    const auto flat_on = hn::Le(load(batch.slope), steepest);
    const VF length = hn::Mul(load(batch.chord), hn::Set(d, view.longest));
    hn::Mask<DF> decided;
    auto kind = straightKinds(view, length, i, batch, decided);
    const auto unsteady = hn::IfThenElse(hn::RebindMask(di, decided), kindNumber(Kind::kept), kindNumber(Kind::full));
    kind = hn::IfThenElse(hn::RebindMask(di, steady), kind, unsteady);
    kind = hn::IfThenElse(peaks, kindNumber(Kind::peak), kind);
    // A peak has no range of depths to lose the rounding in.
    const auto lost = hn::And(peaks, hn::RebindMask(di, hn::Not(steady)));
    kind = hn::IfThenElse(lost, kindNumber(Kind::edge_on), kind);
    hn::Store(kind, di, reinterpret_cast<std::int32_t*>(batch.kind + i));
    unsigned others = view.peaks ? 0 : maskBits(hn::AndNot(decided, steady));
    for (; HWY_UNLIKELY(others != 0); others &= others - 1) {
      const std::size_t c = i + static_cast<std::size_t>(std::countr_zero(others));
      const Care care = batch.look(pieces, c).care(batch.chord[c] * view.longest, true);
      batch.kind[c] = kindOf(care, batch.last_piece[c] - batch.first_piece[c]);
    }
    for (unsigned bits = maskBits(hn::Not(flat_on)); HWY_UNLIKELY(bits != 0); bits &= bits - 1) {
      const std::size_t c = i + static_cast<std::size_t>(std::countr_zero(bits));
      if (!sidesTold(view, batch, c)) batch.kind[c] = Kind::edge_on;
    }
    setOrigins(*view.screen, i, batch);
  }
}

HWY_INLINE void prefetch(const Screen& screen, std::span<const Entry> cells) {
  const mesh::Id* corners = screen.mesh().cell_vertex.data();
  const std::size_t n = std::min<std::size_t>(cells.size(), batch_cells);
  for (std::size_t i = 0; i < n; ++i)
    hwy::Prefetch(corners + std::size_t{4} * cells[i].index());
}

// Fills `batch` for `cells`, at most batch_cells of them; `next` will come after them.
HWY_NOINLINE void setUp(const TileView& view, std::span<const Entry> cells, std::span<const Entry> next,
                        CellBatch& batch) {
  const Screen& screen = *view.screen;
  const DD d;
  const DI di;
  batch.parallel = screen.parallel();
  batch.parts = false;
  batch.eye_nearness = static_cast<float>(nearness_limit * view.nearness_scale);
  sortCorners(screen, cells, batch);
  gatherCorners(screen, cells, batch);
  prefetch(screen, next);
  // As many as setKinds looks at: where there are no cells, the first stands for them.
  const std::size_t end = (cells.size() + hn::Lanes(DF()) - 1) / hn::Lanes(DF()) * hn::Lanes(DF());
  for (std::size_t i = 0; i < end; i += hn::Lanes(d)) {
    const Corner c[4] = {loadCorner(view, batch.corner[0] + 4 * i), loadCorner(view, batch.corner[1] + 4 * i),
                         loadCorner(view, batch.corner[2] + 4 * i), loadCorner(view, batch.corner[3] + 4 * i)};
    const Vec3D e1 = c[1].p - c[0].p;
    const Vec3D e2 = c[2].p - c[0].p;
    const Vec3D e3 = c[3].p - c[0].p;
    const Vec3D n0 = cross(c[2].p - c[1].p, c[3].p - c[1].p);
    const Vec3D n1 = cross(e2, e3);
    const Vec3D n2 = cross(e1, e3);
    const Vec3D n3 = cross(e1, e2);
    // Outward is along n0 and n2, against n1 and n3, the other way round where the ids' order turned the cell over.
    const MD odd =
        hn::MaskFromVec(hn::BitCast(d, hn::PromoteTo(hn::RebindToSigned<DD>(), hn::Load(di, batch.odd + i))));
    const FaceSide side0 = setFace(view, n0, c[1].p, 0, i, batch), side1 = setFace(view, n1, c[0].p, 1, i, batch);
    const FaceSide side2 = setFace(view, n2, c[0].p, 2, i, batch), side3 = setFace(view, n3, c[0].p, 3, i, batch);
    const MD leaves0 = hn::Xor(side0.positive, odd), enters1 = hn::Xor(side1.positive, odd);
    const MD leaves2 = hn::Xor(side2.positive, odd), enters3 = hn::Xor(side3.positive, odd);
    const VD code01 =
        hn::Add(hn::IfThenElseZero(leaves0, hn::Set(d, 1.0)), hn::IfThenZeroElse(enters1, hn::Set(d, 2.0)));
    const VD code23 =
        hn::Add(hn::IfThenElseZero(leaves2, hn::Set(d, 4.0)), hn::IfThenZeroElse(enters3, hn::Set(d, 8.0)));
    hn::Store(hn::DemoteTo(di, hn::Add(code01, code23)), di, batch.code + i);

    DepthRange depth{hn::Min(hn::Min(c[0].p.z, c[1].p.z), hn::Min(c[2].p.z, c[3].p.z)),
                     hn::Max(hn::Max(c[0].p.z, c[1].p.z), hn::Max(c[2].p.z, c[3].p.z))};
    const PixelBoxes box = setExtent(view, c, depth.lo, i, batch);
    setRange(c, i, batch);
    const MH large = largeCells(box, depth, i, batch);
    const VD volume = dot(n3, e3);
    const ScalarField field = scalarField(c, n1, n2, n3, volume);
    if (!hn::AllFalse(DH(), large)) depth = partOf(view, c, field, large, depth, i, batch);
    const auto areaOf = [&](std::size_t k, const FaceSide& side)
                            HWY_ATTR { return batch.parallel ? side.area : hn::Mul(side.area, c[k].w); };
    const VD outline =
        hn::Add(hn::Add(hn::IfThenZeroElse(leaves0, areaOf(0, side0)), hn::IfThenElseZero(enters1, areaOf(1, side1))),
                hn::Add(hn::IfThenZeroElse(leaves2, areaOf(2, side2)), hn::IfThenElseZero(enters3, areaOf(3, side3))));
    const VD extent = longestExtent(volume, outline, i, batch);
    const auto [depth_lo, depth_hi] = depth;
    if (batch.parallel) {
      const VD middle = hn::Mul(hn::Add(depth_lo, depth_hi), hn::Set(d, 0.5));
      setScalar(field, middle, i, batch);
      storeHalf(hn::Neg(middle), batch.middle_nearness + i);
      storeHalf(hn::Set(d, 0.5), batch.half_per_middle + i);
      const VD thickness = hn::Sub(depth_hi, depth_lo);
      storeHalf(thickness, batch.thickness + i);
      storeHalf(hn::Min(extent, thickness), batch.chord + i);
    } else {
      const VD front = hn::Max(depth_lo, hn::Zero(d));
      const VD middle = hn::Mul(hn::Add(front, depth_hi), hn::Set(d, 0.5));
      const VD per_middle = hn::Div(hn::Set(d, 1.0), middle);
      setScalar(field, middle, i, batch);
      storeHalf(hn::Sub(per_middle, hn::Set(d, screen.depths().z0)), batch.middle_nearness + i);
      storeHalf(hn::Mul(per_middle, hn::Set(d, 0.5)), batch.half_per_middle + i);
      const VD thickness = hn::Sub(depth_hi, front);
      const VD chord = hn::Min(hn::Mul(hn::Mul(extent, depth_hi), depth_hi), thickness);
      storeHalf(thickness, batch.thickness + i);
      storeHalf(hn::IfThenElse(hn::Gt(depth_lo, hn::Zero(d)), chord, thickness), batch.chord + i);
    }
  }
  for (std::size_t i = 0; i < cells.size(); i += hn::Lanes(DF()))
    setBlockBits(i, batch);
  setKinds(view, cells.size(), batch);
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
