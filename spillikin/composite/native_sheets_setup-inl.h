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
#include <bit>
#include <cmath>
#include <cstring>

#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_sheets.h"
#include "spillikin/composite/native_vec3d-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DU = hn::Rebind<std::uint32_t, DD>;
using DL = hn::RebindToUnsigned<DD>;
using VU = hn::Vec<DU>;

// How steep a sheet may be, as a share of what a tetrahedron's face may: where float leaves half of the certificate's
// tolerance unknown. A neighbour that is painted ray by ray has not the same bits.
constexpr float steep_share = 0.01F;

constexpr std::size_t faces_most = 8;
constexpr std::size_t corners_most = 8;

// A cell's corners, from which a vector of faces takes one each.
class CornerSet {
 public:
  // From the records as Screen has them; relative to the tile's corner and, in a parallel view, to the middle depth.
  HWY_INLINE CornerSet(const TileView& view, const double* records) {
    const DD d;
    const DH dh;
    const DU du;
    const VD x0 = hn::Set(d, static_cast<double>(view.x0));
    const VD y0 = hn::Set(d, static_cast<double>(view.y0));
    const bool parallel = view.screen->parallel();
    for (std::size_t i = 0; i < corners_most; i += hn::Lanes(d)) {
      VD x, y, w, rest;
      hn::LoadInterleaved4(d, records + 4 * i, x, y, w, rest);
      const auto packed = hn::BitCast(DL(), rest);
      const auto value = hn::BitCast(dh, hn::TruncateTo(du, packed));
      const VD weight = parallel ? hn::Set(d, 1.0) : w;
      x = hn::NegMulAdd(x0, weight, x);
      y = hn::NegMulAdd(y0, weight, y);
      addExtent(hn::DemoteTo(dh, x), hn::DemoteTo(dh, y), hn::DemoteTo(dh, w), parallel, i == 0);
      addRange(value, hn::BitCast(DI(), hn::TruncateTo(du, hn::ShiftRight<32>(packed))), i == 0);
      set(0, i, x);
      set(1, i, y);
      set(2, i, parallel ? hn::Sub(w, hn::Set(d, view.screen->depths().z0)) : w);
      set(3, i, hn::PromoteTo(d, value));
    }
  }

  using Index = hn::Vec<DL>;
  HWY_INLINE Vec3D point(Index i) const { return {get(0, i), get(1, i), get(2, i)}; }
  HWY_INLINE VD value(Index i) const { return get(3, i); }

  // Of all corners: places in pixels, depths, scalars and the pieces they lie in.
  float x_lo() const { return hn::GetLane(hn::MinOfLanes(DH(), x_lo_)); }
  float x_hi() const { return hn::GetLane(hn::MaxOfLanes(DH(), x_hi_)); }
  float y_lo() const { return hn::GetLane(hn::MinOfLanes(DH(), y_lo_)); }
  float y_hi() const { return hn::GetLane(hn::MaxOfLanes(DH(), y_hi_)); }
  float w_lo() const { return hn::GetLane(hn::MinOfLanes(DH(), w_lo_)); }
  float w_hi() const { return hn::GetLane(hn::MaxOfLanes(DH(), w_hi_)); }
  float lo() const { return hn::GetLane(hn::MinOfLanes(DH(), lo_)); }
  float hi() const { return hn::GetLane(hn::MaxOfLanes(DH(), hi_)); }
  std::int32_t first() const { return hn::GetLane(hn::MinOfLanes(DI(), first_)); }
  std::int32_t last() const { return hn::GetLane(hn::MaxOfLanes(DI(), last_)); }

 private:
  static constexpr bool in_register = hn::MaxLanes(DD()) == corners_most;

  HWY_INLINE void set(std::size_t k, std::size_t i, VD v) { hn::Store(v, DD(), at_[k] + i); }
  HWY_INLINE VD get(std::size_t k, Index i) const {
    const DD d;
    if constexpr (in_register) {
      return hn::TableLookupLanes(hn::Load(d, at_[k]), hn::IndicesFromVec(d, i));
    } else {
      return hn::GatherIndex(d, at_[k], hn::BitCast(hn::RebindToSigned<DD>(), i));
    }
  }
  HWY_INLINE void addExtent(hn::Vec<DH> x, hn::Vec<DH> y, hn::Vec<DH> w, bool parallel, bool begin) {
    const DH dh;
    if (!parallel) {
      const auto inverse = hn::Div(hn::Set(dh, 1.0F), w);
      x = hn::Mul(x, inverse);
      y = hn::Mul(y, inverse);
    }
    x_lo_ = begin ? x : hn::Min(x_lo_, x);
    x_hi_ = begin ? x : hn::Max(x_hi_, x);
    y_lo_ = begin ? y : hn::Min(y_lo_, y);
    y_hi_ = begin ? y : hn::Max(y_hi_, y);
    w_lo_ = begin ? w : hn::Min(w_lo_, w);
    w_hi_ = begin ? w : hn::Max(w_hi_, w);
  }
  HWY_INLINE void addRange(hn::Vec<DH> value, hn::Vec<DI> piece, bool begin) {
    lo_ = begin ? value : hn::Min(lo_, value);
    hi_ = begin ? value : hn::Max(hi_, value);
    first_ = begin ? piece : hn::Min(first_, piece);
    last_ = begin ? piece : hn::Max(last_, piece);
  }

  alignas(64) double at_[4][corners_most];
  hn::Vec<DH> x_lo_, x_hi_, y_lo_, y_hi_, w_lo_, w_hi_, lo_, hi_;
  hn::Vec<DI> first_, last_;
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

// What is known of the faces beyond their coefficients, a bit each: left through their first and second triangles,
// seen too nearly edge-on, with a scalar that rounding moves.
struct FaceBits {
  unsigned leaves1 = 0, leaves2 = 0, edge_on = 0;
  // The second triangles as planes, for those quadrilaterals that are no one sheet.
  alignas(64) float plane[3][faces_most];
  alignas(64) float rate[3][faces_most];
  alignas(64) float steep[faces_most];  // the scalar's rate on the steeper triangle, at most, over the tile
};

HWY_INLINE VD overTile(const Vec3D& form) {
  return hn::MulAdd(hn::Add(hn::Abs(form.x), hn::Abs(form.y)), hn::Set(DD(), static_cast<double>(tile_size)),
                    hn::Abs(form.z));
}

// 1 / v, with v kept so far from 0 that a form no larger than `reach` times it stays within nearness_limit.
HWY_INLINE VD inverseWithin(const TileView& view, VD v, VD reach) {
  const DD d;
  const VD least = hn::MulAdd(reach, hn::Set(d, 1.0 / (nearness_limit * view.nearness_scale)), hn::Set(d, 1e-300));
  const VD magnitude = hn::Max(hn::Abs(v), least);
  return hn::Div(hn::Set(d, 1.0), hn::CopySign(magnitude, v));
}

HWY_INLINE void storeForm(const Vec3D& form, std::size_t i, float* x, float* y, float* z) {
  const DH dh;
  hn::Store(hn::DemoteTo(dh, form.x), dh, x + i);
  hn::Store(hn::DemoteTo(dh, form.y), dh, y + i);
  hn::Store(hn::DemoteTo(dh, form.z), dh, z + i);
}

// The sheets of the faces from i on.
HWY_INLINE void setFaces(const TileView& view, const CornerSet& corners, const FacetTable& table, FacetCode code,
                         std::size_t i, SheetCell& cell, FaceBits& bits) {
  const DD d;
  const DH dh;
  const bool parallel = view.screen->parallel();
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
  const VD pivot1 = parallel ? n.z : level;
  const VD pivot2 = dot(diagonal, hf);
  Vec3D plane{n.x, n.y, parallel ? hn::Neg(level) : n.z};
  const VD inverse1 = inverseWithin(view, pivot1, overTile(plane));
  const VD inverse2 = inverseWithin(view, pivot2, overTile(diagonal));
  // 1 above the fourth corner (over its depth, in perspective); nothing on a triangle.
  const VD quad = hn::PromoteTo(
      d, hn::BitCast(DI(), hn::And(hn::Shr(hn::Set(DU(), table.quads), hn::Iota(DU(), static_cast<std::uint32_t>(i))),
                                   hn::Set(DU(), 1))));
  const Vec3D side{hn::Mul(diagonal.x, inverse2), hn::Mul(diagonal.y, inverse2), hn::Mul(diagonal.z, inverse2)};
  const VD fold = hn::Mul(quad, hn::Neg(hn::Mul(dot(n, f - a), inverse1)));
  plane = {hn::Mul(plane.x, inverse1), hn::Mul(plane.y, inverse1), hn::Mul(plane.z, inverse1)};
  if (!parallel) plane.z = hn::Sub(plane.z, hn::Set(d, view.screen->depths().z0));

  const VD value = corners.value(at.a);
  const VD to_b = hn::Mul(hn::Sub(corners.value(at.b), value), inverse1);
  const VD to_c = hn::Mul(hn::Sub(corners.value(at.c), value), inverse1);
  const Vec3D third = cross(ha, hb);
  const auto mix = [&](VD u, VD v) HWY_ATTR { return hn::MulSub(to_c, u, hn::Mul(to_b, v)); };
  const Vec3D rate{mix(third.x, diagonal.x), mix(third.y, diagonal.y), mix(third.z, diagonal.z)};
  const VD bend = hn::Mul(quad, hn::Sub(hn::Sub(corners.value(at.d), value), dot(rate, hf)));

  const auto along = [&](const Vec3D& form, VD by) HWY_ATTR {
    return Vec3D{hn::MulAdd(side.x, by, form.x), hn::MulAdd(side.y, by, form.y), hn::MulAdd(side.z, by, form.z)};
  };
  const Vec3D plane2 = along(plane, fold);
  const Vec3D rate2 = along(rate, bend);
  storeForm(plane, i, cell.plane[0], cell.plane[1], cell.plane[2]);
  storeForm(side, i, cell.side[0], cell.side[1], cell.side[2]);
  storeForm(rate, i, cell.rate[0], cell.rate[1], cell.rate[2]);
  storeForm(plane2, i, bits.plane[0], bits.plane[1], bits.plane[2]);
  storeForm(rate2, i, bits.rate[0], bits.rate[1], bits.rate[2]);
  hn::Store(hn::DemoteTo(dh, fold), dh, cell.fold + i);
  hn::Store(hn::DemoteTo(dh, value), dh, cell.base + i);
  hn::Store(hn::DemoteTo(dh, bend), dh, cell.bend + i);
  hn::Store(hn::DemoteTo(dh, hn::Max(overTile(rate), overTile(rate2))), dh, bits.steep + i);

  const auto slope = [&](const Vec3D& form) HWY_ATTR { return hn::Add(hn::Abs(form.x), hn::Abs(form.y)); };
  // Of the cell's own nearness, where that is what float keeps a share of.
  const double scale = view.relative ? 2.0 / (corners.w_lo() + corners.w_hi()) : 1.0;
  const VD steepest = hn::Set(d, double{steep_share * view.steepest} / tile_size * scale);
  const MD level_enough = hn::Le(hn::Max(slope(plane), slope(plane2)), steepest);
  const MD turned = hn::Eq(hn::PromoteTo(d, hn::BitCast(DI(), at.backward)), hn::Set(d, 1.0));
  bits.leaves1 |= laneBits(hn::Xor(hn::Gt(pivot1, hn::Zero(d)), turned)) << i;
  bits.leaves2 |= laneBits(hn::Xor(hn::Gt(pivot2, hn::Zero(d)), turned)) << i;
  bits.edge_on |= laneBits(hn::Not(level_enough)) << i;
}

// Face f's triangles as a sheet each.
HWY_INLINE void splitFace(SheetCell& cell, const FaceBits& bits, unsigned f) {
  const unsigned g = SheetCell::second + f;
  for (std::size_t k = 0; k < 3; ++k) {
    cell.plane[k][g] = bits.plane[k][f];
    cell.rate[k][g] = bits.rate[k][f];
    cell.side[k][f] = cell.side[k][g] = 0.0F;
  }
  cell.base[g] = cell.base[f];
  cell.fold[f] = cell.bend[f] = cell.fold[g] = cell.bend[g] = 0.0F;
}

// By which sheets the cell is entered and left.
HWY_INLINE void sortSheets(const FacetTable& table, FacetCode code, const FaceBits& bits, SheetCell& cell) {
  cell.entered_count = cell.left_count = cell.gap_count = 0;
  const unsigned split = (bits.leaves1 ^ bits.leaves2) & table.quads;
  const unsigned gaps = split & code >> inward_shift;
  const auto list = [](unsigned faces, unsigned first, std::uint8_t* out, unsigned& count) {
    for (; faces != 0; faces &= faces - 1)
      out[count++] = static_cast<std::uint8_t>(first + static_cast<unsigned>(std::countr_zero(faces)));
  };
  const unsigned whole = table.faces & ~gaps;
  list(whole & ~bits.leaves1, 0, cell.entered, cell.entered_count);
  list(whole & bits.leaves1, 0, cell.left, cell.left_count);
  if (HWY_LIKELY(split == 0)) return;
  for (unsigned rest = split; rest != 0; rest &= rest - 1)
    splitFace(cell, bits, static_cast<unsigned>(std::countr_zero(rest)));
  list(split & ~gaps & ~bits.leaves2, SheetCell::second, cell.entered, cell.entered_count);
  list(split & ~gaps & bits.leaves2, SheetCell::second, cell.left, cell.left_count);
  for (unsigned rest = gaps; rest != 0; rest &= rest - 1) {
    const auto f = static_cast<std::uint8_t>(std::countr_zero(rest));
    const auto g = static_cast<std::uint8_t>(f + SheetCell::second);
    cell.gap[cell.gap_count++] = (bits.leaves1 >> f & 1U) != 0 ? SheetCell::Gap{f, g} : SheetCell::Gap{g, f};
  }
}

// The blocks of pixels that the cell may cover, with a margin for float's rounding of the projection.
HWY_INLINE Box blocksOf(const TileView& view, const CornerSet& corners) {
  constexpr float margin = 0.01F;
  const auto begin = [](float lo, int end) {
    return static_cast<int>(std::ceil(std::clamp(lo - 0.5F - margin, 0.0F, static_cast<float>(end)))) / 4;
  };
  const auto end = [](float hi, int most) {
    return (static_cast<int>(std::floor(std::clamp(hi - 0.5F + margin, -1.0F, static_cast<float>(most - 1)))) + 4) / 4;
  };
  return {begin(corners.x_lo(), view.width), begin(corners.y_lo(), view.height), end(corners.x_hi(), view.width),
          end(corners.y_hi(), view.height)};
}

HWY_INLINE void setCell(const TileView& view, const double* records, mesh::CellType type, FacetCode code,
                        SheetCell& cell) {
  cell.care = Care::edge_on;
  if (code == not_of_planes) return;
  const CornerSet corners(view, records);
  const bool parallel = view.screen->parallel();
  if (!parallel && !(corners.w_lo() > 0.0F)) return;
  cell.blocks = blocksOf(view, corners);
  const FacetTable& table = facetTable(type);
  FaceBits bits;
  for (std::size_t i = 0; i < faces_most; i += hn::Lanes(DD()))
    setFaces(view, corners, table, code, i, cell, bits);
  if ((bits.edge_on & table.faces) != 0) return;
  sortSheets(table, code, bits, cell);
  if (cell.entered_count == 0 || cell.left_count == 0) return;
  cell.look = {view.screen->pieces().data(), corners.first(), corners.last(), corners.lo(), corners.hi()};
  const DH dh;
  auto steep = hn::Load(dh, bits.steep);
  for (std::size_t i = hn::Lanes(dh); i < faces_most; i += hn::Lanes(dh))
    steep = hn::Max(steep, hn::Load(dh, bits.steep + i));
  // The rounding of a rate, as a scalar.
  constexpr float float_rounding = 4e-7F;
  const float depth = parallel ? 1.0F : corners.w_hi();
  const bool steady =
      hn::GetLane(hn::MaxOfLanes(dh, steep)) * depth * float_rounding <= 0.02F * (cell.look.hi - cell.look.lo);
  cell.care = cell.look.care((corners.w_hi() - corners.w_lo()) * view.longest, steady);
}

HWY_INLINE mesh::Id cellOf(const sort::Order& order, Entry entry) {
  return entry.cut() ? order.cells[order.cuts[entry.index()].entry] : entry.index();
}

// All corners of the batch before the first is read: they are written in smaller parts than they are read in, and must
// have come to rest by then.
HWY_NOINLINE void gatherRecords(const Screen& screen, std::span<const Entry> cells, SheetBatch& batch) {
  const mesh::Mesh& mesh = screen.mesh();
  const sort::Order& order = screen.frame().order;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const mesh::Id cell = cellOf(order, cells[i]);
    const mesh::Id* corner = mesh.cell_vertex.data() + mesh.cell_vertex_offset[cell];
    const std::size_t count =
        std::min<std::size_t>(mesh.cell_vertex_offset[cell + 1] - mesh.cell_vertex_offset[cell], corners_most);
    double* records = batch.corner[i];
    for (std::size_t k = 0; k < corners_most; ++k)
      std::memcpy(records + 4 * k, screen.vertices() + corner[k < count ? k : 0], sizeof(Vertex));
    if (screen.cell_values().empty()) continue;
    for (std::size_t k = 0; k < corners_most; ++k) {
      auto* last = reinterpret_cast<char*>(records + 4 * k + 3);
      std::memcpy(last, &screen.cell_values()[cell], sizeof(float));
      std::memcpy(last + sizeof(float), &screen.cell_pieces()[cell], sizeof(std::uint32_t));
    }
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

// Fills `batch` for `cells`, at most as many as it holds; `next` will come after them.
HWY_NOINLINE void setUpSheets(const TileView& view, std::span<const Entry> cells, std::span<const Entry> next,
                              SheetBatch& batch) {
  const Screen& screen = *view.screen;
  gatherRecords(screen, cells, batch);
  prefetchCells(screen, next);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const mesh::Id cell = cellOf(screen.frame().order, cells[i]);
    setCell(view, batch.corner[i], screen.mesh().cell_type[cell], screen.facets()[cell], batch.cell[i]);
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
