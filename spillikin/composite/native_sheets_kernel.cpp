#include <algorithm>
#include <bit>
#include <limits>
#include <vector>

#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_sheets.h"

// Once for each instruction set; the best that the machine has is taken at run time.
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/composite/native_sheets_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_shade-inl.h"
#include "spillikin/composite/native_sheets_setup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DS = hn::RebindToSigned<DF>;
using VS = hn::Vec<DS>;

template <class V>
HWY_INLINE V formAt(const float* x_form, const float* y_form, const float* form, const V& x, const V& y) {
  const DF d;
  return wide::MulAdd(hn::Set(d, *x_form), x, wide::MulAdd(hn::Set(d, *y_form), y, hn::Set(d, *form)));
}

// One end of the intervals of a vector of rays, or of two: how near, on which sheet (a number's bits), and, if that is
// folded, on which side of the diagonal.
template <class V>
struct End {
  V z, sheet, side;
};

template <class V>
HWY_INLINE V sideOf(const SheetCell& cell, std::size_t k, const V& x, const V& y) {
  return wide::Max(formAt(&cell.side[0][k], &cell.side[1][k], &cell.side[2][k], x, y), hn::Zero(DF()));
}

template <bool Folded, class V>
HWY_INLINE End<V> onSheet(const SheetCell& cell, std::size_t k, const V& x, const V& y) {
  const DF d;
  const V z = formAt(&cell.plane[0][k], &cell.plane[1][k], &cell.plane[2][k], x, y);
  const V sheet = wide::same<V>(hn::BitCast(d, hn::Set(DS(), static_cast<std::int32_t>(k))));
  if constexpr (!Folded) return {z, sheet, z};
  const V side = sideOf(cell, k, x, y);
  return {wide::MulAdd(hn::Set(d, cell.fold[k]), side, z), sheet, side};
}

template <bool Folded, class V, class M>
HWY_INLINE void take(End<V>& end, const End<V>& other, const M& where) {
  end.z = wide::IfThenElse(where, other.z, end.z);
  end.sheet = wide::IfThenElse(where, other.sheet, end.sheet);
  if constexpr (Folded) end.side = wide::IfThenElse(where, other.side, end.side);
}

template <class V>
struct Interval {
  End<V> near, far;
};

// Of as many sheets as there are, or, where that is not 0, of the first `Sheets` of either list.
template <bool Folded, unsigned Sheets, class V>
HWY_INLINE Interval<V> intervalOf(const SheetCell& cell, const V& x, const V& y) {
  Interval<V> in{onSheet<Folded>(cell, cell.entered[0], x, y), onSheet<Folded>(cell, cell.left[0], x, y)};
  const unsigned entered = Sheets > 0 ? Sheets : cell.entered_count;
  for (unsigned k = 1; k < entered; ++k) {
    const End<V> other = onSheet<Folded>(cell, cell.entered[k], x, y);
    take<Folded>(in.near, other, wide::Lt(other.z, in.near.z));
  }
  const unsigned left = Sheets > 0 ? Sheets : cell.left_count;
  for (unsigned k = 1; k < left; ++k) {
    const End<V> other = onSheet<Folded>(cell, cell.left[k], x, y);
    take<Folded>(in.far, other, wide::Gt(other.z, in.far.z));
  }
  return in;
}

// What clip planes and the half-spaces of a piece leave of each ray.
template <class V>
struct Limits {
  V near, far;
};

template <class V, class At>
HWY_INLINE Limits<V> limitsOf(const TileView& view, const Pixels& pixels, std::span<const WholeCell::Bound> bounds,
                              const At& first, const V& x, const V& y) {
  const V none = wide::same<V>(hn::Set(DF(), std::numeric_limits<float>::infinity()));
  Limits<V> limits{none, wide::Neg(none)};
  if (view.clipped) {
    limits = {wide::load(pixels.clip_near.data(), first), wide::load(pixels.clip_far.data(), first)};
  }
  for (const WholeCell::Bound& bound : bounds) {
    const V z = formAt(&bound.nearness[0], &bound.nearness[1], &bound.nearness[2], x, y);
    if (bound.entry) {
      limits.near = wide::Min(limits.near, z);
    } else {
      limits.far = wide::Max(limits.far, z);
    }
  }
  return limits;
}

// A gap takes one end or the other of the interval, or leaves two: those lanes are returned. A part is none where it is
// too short to count in the order.
HWY_INLINE hn::Mask<DF> crossGap(const TileView& view, const SheetCell& cell, SheetCell::Gap gap,
                                 const Limits<VF>& limits, const VF& x, const VF& y, Interval<VF>& in) {
  const DF d;
  // Both are one triangle each.
  End<VF> out = onSheet<false>(cell, gap.leaves, x, y);
  End<VF> again = onSheet<false>(cell, gap.enters, x, y);
  out.side = again.side = hn::Zero(d);
  const auto open = hn::And(hn::Gt(in.near.z, in.far.z), hn::Gt(out.z, again.z));
  const auto some = [&](VF near, VF far) HWY_ATTR {
    const VF least = hn::MulAdd(hn::Max(near, hn::Zero(d)), hn::Set(d, solid_share * view.overlap_slope),
                                hn::Set(d, solid_share * view.overlap_at));
    return hn::Gt(hn::Sub(hn::Min(near, limits.near), hn::Max(far, limits.far)), least);
  };
  const auto before = some(in.near.z, hn::Max(out.z, in.far.z));
  const auto behind = some(hn::Min(again.z, in.near.z), in.far.z);
  take<true>(in.far, out, hn::And(open, hn::AndNot(behind, hn::Gt(out.z, in.far.z))));
  take<true>(in.near, again, hn::And(open, hn::And(behind, hn::AndNot(before, hn::Lt(again.z, in.near.z)))));
  return hn::And(open, hn::And(before, behind));
}

HWY_INLINE hn::Mask<DF> meetsSteep(const SheetCell& cell, const Interval<VF>& in) {
  const DF d;
  const hn::RebindToUnsigned<DF> du;
  const auto steep = hn::Set(du, cell.steep);
  const auto bit = [&](VF sheet) HWY_ATTR { return hn::Shr(steep, hn::BitCast(du, sheet)); };
  const auto met = hn::And(hn::Or(bit(in.near.sheet), bit(in.far.sheet)), hn::Set(du, 1));
  return hn::And(hn::RebindMask(d, hn::Ne(met, hn::Zero(du))), hn::Gt(in.near.z, in.far.z));
}

struct Cover {
  const TileView& view;
  const SheetCell& cell;
  std::span<const WholeCell::Bound> bounds;
  const Pixels& pixels;
  SheetCoverage& out;
  std::vector<std::uint16_t>& one_by_one;
};

// Of a piece of a cell, and of a cell with gaps or steep sheets (Careful), vectors on which the limits leave nothing
// are left out (Cut).
template <bool Careful, bool Cut, bool Folded, unsigned Sheets>
HWY_NOINLINE std::size_t coverSheets(const Cover& c) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t n = 0;
  // The end of an interval may lie outside of the limits, which `inside` respects.
  const auto keep = [&](const Interval<VF>& in, hn::Mask<DF> inside, std::size_t first) HWY_ATTR {
    float* out = c.out.vector + SheetCoverage::width * lanes * n;
    hn::Store(in.near.z, d, out);
    hn::Store(in.far.z, d, out + lanes);
    hn::Store(in.near.sheet, d, out + 2 * lanes);
    hn::Store(in.far.sheet, d, out + 3 * lanes);
    if constexpr (Folded) {
      hn::Store(in.near.side, d, out + 4 * lanes);
      hn::Store(in.far.side, d, out + 5 * lanes);
    }
    c.out.pixel[n] = static_cast<std::uint32_t>(first);
    // No branch on what is as good as random: an empty vector's place is taken by the next one.
    n += static_cast<std::size_t>(!hn::AllFalse(d, inside));
  };
  byBlocks(c.cell.block_bits & c.pixels.live, [&](std::size_t first) HWY_ATTR {
    const VF x = centresX(first), y = centresY(first);
    Interval<VF> in = intervalOf<Folded, Sheets>(c.cell, x, y);
    if constexpr (!Cut) return keep(in, hn::Gt(in.near.z, in.far.z), first);
    const Limits<VF> limits = limitsOf(c.view, c.pixels, c.bounds, first, x, y);
    if constexpr (Careful) {
      auto hard = hn::MaskFromVec(hn::Zero(d));
      for (unsigned k = 0; k < c.cell.gap_count; ++k)
        hard = hn::Or(hard, crossGap(c.view, c.cell, c.cell.gap[k], limits, x, y, in));
      hard = hn::Or(hard, meetsSteep(c.cell, in));
      in.near.z = hn::IfThenElse(hard, in.far.z, in.near.z);
      for (unsigned bits = maskBits(hard); HWY_UNLIKELY(bits != 0); bits &= bits - 1)
        c.one_by_one.push_back(static_cast<std::uint16_t>(first + static_cast<unsigned>(std::countr_zero(bits))));
    }
    keep(in, hn::Gt(hn::Min(in.near.z, limits.near), hn::Max(in.far.z, limits.far)), first);
  });
  return n;
}

// A coefficient of each sheet, less a number that is the same for all, to be looked up for a vector of them.
class PerSheet {
 public:
  explicit HWY_INLINE PerSheet(const SheetCell::Coefficient& of, float less = 0.0F)
      : of_(of), less_(hn::Set(DF(), less)) {
    if constexpr (lanes == 16 || lanes == 8) low_ = hn::Sub(hn::LoadU(DF(), of), less_);
    if constexpr (lanes == 8) high_ = hn::Sub(hn::LoadU(DF(), of + 8), less_);
  }
  // Of sheets as End has them.
  HWY_INLINE Two<VF> operator()(const Two<VF>& sheet) const { return {(*this)(sheet.a), (*this)(sheet.b)}; }
  HWY_INLINE VF operator()(VF sheet_bits) const {
    const DF d;
    const VS sheet = hn::BitCast(DS(), sheet_bits);
    if constexpr (lanes == 16) {
      return hn::TableLookupLanes(low_, hn::IndicesFromVec(d, sheet));
    } else if constexpr (lanes == 8) {
      const auto index = hn::IndicesFromVec(d, hn::And(sheet, hn::Set(DS(), 7)));
      return hn::IfThenElse(hn::RebindMask(d, hn::Gt(sheet, hn::Set(DS(), 7))), hn::TableLookupLanes(high_, index),
                            hn::TableLookupLanes(low_, index));
    } else {
      return hn::Sub(hn::GatherIndex(d, of_, sheet), less_);
    }
  }

 private:
  static constexpr std::size_t lanes = hn::MaxLanes(DF());
  const float* of_;
  VF less_, low_, high_;
};

// The scalar at the ends of intervals, and from there their segments.
template <bool Parallel>
class SheetRays {
 public:
  SheetRays(const TileView& view, const SheetCell& cell, float anchor)
      : view_(view),
        base_(cell.base, anchor),
        x_(cell.rate[0]),
        y_(cell.rate[1]),
        t_(cell.rate[2]),
        bend_(cell.bend),
        side_x_(cell.side[0]),
        side_y_(cell.side[1]),
        side_t_(cell.side[2]),
        z0_(hn::Set(DF(), view.z0)) {}

  // Sets the sides of both ends by their sheets.
  template <class V, class At>
  HWY_INLINE void setSides(Interval<V>& in, const At& first) const {
    const V x = centresX(first), y = centresY(first);
    in.near.side = side(in.near.sheet, x, y);
    in.far.side = side(in.far.sheet, x, y);
  }

  // Lanes that are not inside get no length and harmless values. Trims near, far and inside where Clipped.
  template <bool Clipped, class V, class M, class At>
  HWY_INLINE SegmentOf<V> segment(Interval<V>& in, const At& first, M& inside, const Pixels& pixels,
                                  std::span<const WholeCell::Bound> bounds) const {
    const DF d;
    const VF half = hn::Set(d, 0.5F);
    const V x = centresX(first), y = centresY(first);
    V &near = in.near.z, &far = in.far.z;
    V begin, end;
    V length = depths(near, far, begin, end);
    V front = scalar(in.near, begin, x, y), back = scalar(in.far, end, x, y);
    if constexpr (Clipped) {
      const Limits<V> limits = limitsOf(view_, pixels, bounds, first, x, y);
      near = wide::Min(near, limits.near);
      far = wide::Max(far, limits.far);
      inside = wide::And(inside, wide::Gt(near, far));
      near = wide::IfThenElseZero(inside, near);
      far = wide::IfThenElseZero(inside, far);
      // The field runs on as if nothing were cut; an interval too short for float to tell its ends apart has one value.
      const V extent = wide::Sub(end, begin);
      const auto long_enough = wide::And(inside, wide::Gt(extent, hn::Zero(d)));
      const V rate = wide::IfThenElseZero(long_enough, wide::Div(wide::Sub(back, front), extent));
      const V lo = wide::Min(front, back), hi = wide::Max(front, back), start = front, from = begin;
      length = depths(near, far, begin, end);
      front = wide::Clamp(wide::MulAdd(rate, wide::Sub(begin, from), start), lo, hi);
      back = wide::Clamp(wide::MulAdd(rate, wide::Sub(end, from), start), lo, hi);
    }
    return {wide::IfThenElseZero(inside, wide::Mul(wide::Add(front, back), half)),
            wide::IfThenElseZero(inside, wide::Mul(wide::Sub(back, front), half)),
            wide::IfThenElseZero(inside, wide::Mul(length, wide::load(pixels.length.data(), first)))};
  }

 private:
  // The depths of both ends of intervals. Returns how far they are apart.
  template <class V>
  HWY_INLINE V depths(const V& near, const V& far, V& begin, V& end) const {
    if constexpr (Parallel) {
      begin = wide::Sub(z0_, near);
      end = wide::Sub(z0_, far);
      return wide::Sub(near, far);
    } else {
      const V u_near = wide::Add(near, z0_), u_far = wide::Add(far, z0_);
      const V both = reciprocal(wide::Mul(u_near, u_far));
      begin = wide::Mul(u_far, both);
      end = wide::Mul(u_near, both);
      return wide::Mul(wide::Sub(near, far), both);
    }
  }
  // Relative to the anchor.
  template <class V>
  HWY_INLINE V scalar(const End<V>& at, const V& depth, const V& x, const V& y) const {
    const V t = wide::MulAdd(bend_(at.sheet), at.side, t_(at.sheet));
    const V rate = wide::MulAdd(x_(at.sheet), x, wide::MulAdd(y_(at.sheet), y, t));
    const V base = base_(at.sheet);
    return Parallel ? wide::Add(rate, base) : wide::MulAdd(rate, depth, base);
  }
  template <class V>
  HWY_INLINE V side(const V& sheet, const V& x, const V& y) const {
    const V form = wide::MulAdd(side_x_(sheet), x, wide::MulAdd(side_y_(sheet), y, side_t_(sheet)));
    return wide::Max(form, hn::Zero(DF()));
  }

  const TileView& view_;
  PerSheet base_;  // relative to the anchor
  PerSheet x_, y_, t_, bend_, side_x_, side_y_, side_t_;
  VF z0_;
};

// Most cells have three or four sheets on either side.
template <bool Careful, bool Cut, bool Folded>
HWY_INLINE std::size_t coverCounted(const Cover& c) {
  const unsigned most = std::max(c.cell.entered_count, c.cell.left_count);
  if constexpr (!Cut) {
    if (most <= 3) return coverSheets<Careful, Cut, Folded, 3>(c);
  }
  if constexpr (Folded || !Cut) {
    if (most <= 4) return coverSheets<Careful, Cut, Folded, 4>(c);
  }
  return coverSheets<Careful, Cut, Folded, 0>(c);
}

HWY_INLINE std::size_t coverAny(const Cover& c) {
  if (c.cell.gap_count > 0 || c.cell.steep != 0) {
    return c.cell.folded ? coverCounted<true, true, true>(c) : coverCounted<true, true, false>(c);
  }
  if (!c.bounds.empty())
    return c.cell.folded ? coverCounted<false, true, true>(c) : coverCounted<false, true, false>(c);
  return c.cell.folded ? coverCounted<false, false, true>(c) : coverCounted<false, false, false>(c);
}

struct Painting {
  const TileView& view;
  const SheetCell& cell;
  std::span<const WholeCell::Bound> bounds;
  const SheetCoverage& covered;
  std::size_t count;
};

// The intervals of the vectors at `at` of a SheetCoverage.
template <bool Parallel, class At>
HWY_INLINE auto loadInterval(const Painting& p, const SheetRays<Parallel>& rays, const At& first, const At& at) {
  const std::size_t lanes = hn::Lanes(DF());
  const auto load = [&](std::size_t k) HWY_ATTR { return wide::load(p.covered.vector + k * lanes, at); };
  using V = decltype(load(0));
  Interval<V> in{{load(0), load(2), load(0)}, {load(1), load(3), load(1)}};
  if (p.cell.folded) {
    in.near.side = load(4);
    in.far.side = load(5);
  } else {
    rays.setSides(in, first);
  }
  return in;
}

// Vectors by twos: they are of different pixels.
template <bool Parallel, bool Clipped, Care care>
HWY_NOINLINE std::size_t shadeSheets(const Painting& p, Pixels& pixels) {
  const std::size_t lanes = hn::Lanes(DF());
  const Shader<care> shader(p.cell.look);
  const SheetRays<Parallel> rays(p.view, p.cell, shader.anchor());
  const Certificate certificate(p.view);
  std::size_t fragments = 0;
  const auto shade = [&](const auto& first, const auto& at) HWY_ATTR {
    auto in = loadInterval(p, rays, first, at);
    auto inside = wide::Gt(in.near.z, in.far.z);
    const auto segment = rays.template segment<Clipped>(in, first, inside, pixels, p.bounds);
    fragments += wide::CountTrue(inside);
    certificate.check(in.near.z, in.far.z, inside, first, pixels);
    shader.blend(segment, first, pixels);
  };
  wide::byTwos(p.covered.pixel, p.count, SheetCoverage::width * lanes, shade);
  return fragments;
}

template <bool Parallel, bool Clipped>
std::size_t shadeSheetsAs(const Painting& p, Pixels& pixels) {
  return withCare(p.cell.care,
                  [&](auto care) HWY_ATTR { return shadeSheets<Parallel, Clipped, decltype(care)::value>(p, pixels); });
}

// The common case in one pass: a cell that nothing cuts, of as many sheets as `Sheets` says (see intervalOf).
template <bool Parallel, bool Folded, unsigned Sheets, Care care>
HWY_NOINLINE std::size_t paintPlain(const TileView& view, const SheetCell& cell, Pixels& pixels) {
  const Shader<care> shader(cell.look);
  const SheetRays<Parallel> rays(view, cell, shader.anchor());
  const Certificate certificate(view);
  std::size_t fragments = 0;
  byTwoBlocks(cell.block_bits & pixels.live, [&](const auto& first) HWY_ATTR {
    auto in = intervalOf<Folded, Sheets>(cell, centresX(first), centresY(first));
    auto inside = wide::Gt(in.near.z, in.far.z);
    if constexpr (!Folded) rays.setSides(in, first);
    const auto segment = rays.template segment<false>(in, first, inside, pixels, {});
    fragments += wide::CountTrue(inside);
    certificate.check(in.near.z, in.far.z, inside, first, pixels);
    shader.blend(segment, first, pixels);
  });
  return fragments;
}

template <bool Parallel, bool Folded, Care care>
HWY_INLINE std::size_t paintPlainAs(const TileView& view, const SheetCell& cell, Pixels& pixels) {
  return std::max(cell.entered_count, cell.left_count) <= 3 ? paintPlain<Parallel, Folded, 3, care>(view, cell, pixels)
                                                            : paintPlain<Parallel, Folded, 0, care>(view, cell, pixels);
}

constexpr bool isPlain(Care care) {
  return care == Care::none || care == Care::bend || care == Care::bends || care == Care::long_bends;
}

// Whether the cell was that simple, and was painted.
template <bool Parallel>
HWY_INLINE bool paintedPlain(const TileView& view, Entry entry, const SheetCell& cell, Pixels& pixels,
                             std::size_t& fragments) {
  if (entry.cut() || view.clipped || cell.gap_count > 0 || cell.steep != 0 || !isPlain(cell.care)) return false;
  fragments += withCare(cell.care, [&](auto care) HWY_ATTR {
    constexpr Care as = decltype(care)::value;
    if constexpr (isPlain(as)) {
      return cell.folded ? paintPlainAs<Parallel, true, as>(view, cell, pixels)
                         : paintPlainAs<Parallel, false, as>(view, cell, pixels);
    } else {
      return std::size_t{0};  // never: looked at above
    }
  });
  return true;
}

// The planes of a piece; false where one is seen edge-on or there are too many.
HWY_INLINE bool setBounds(const TileView& view, const TileRays& tile, Entry entry,
                          std::vector<WholeCell::Bound>& bounds) {
  bounds.clear();
  if (HWY_LIKELY(!entry.cut())) return true;
  for (const sort::HalfSpace& keep : view.screen->frame().order.cuts[entry.index()].keep) {
    if (!setBound(view, tile, keep, bounds.emplace_back())) return false;
  }
  return true;
}

// One cell's vectors, or nothing where it is handed back.
HWY_INLINE std::size_t coverOne(const TileView& view, const TileRays& tile, Entry entry, const SheetCell& cell,
                                const Pixels& pixels, SheetScratch& scratch) {
  if (HWY_UNLIKELY(cell.care == Care::edge_on || !setBounds(view, tile, entry, scratch.bounds))) {
    view.hand_back.take(view.hand_back.self, entry);
    return 0;
  }
  if ((cell.block_bits & pixels.live) == 0) return 0;
  scratch.one_by_one.clear();
  const Cover cover{view, cell, scratch.bounds, pixels, scratch.covered, scratch.one_by_one};
  const std::size_t n = coverAny(cover);
  if (HWY_UNLIKELY(!scratch.one_by_one.empty())) {
    view.hand_back.take_pixels(view.hand_back.self, entry, scratch.one_by_one);
  }
  return n;
}

constexpr std::size_t batches_between_looks = 4;

std::size_t sheets(const TileView& view, std::span<const Entry> entries, Pixels& pixels, SheetScratch& scratch) {
  const bool parallel = view.screen->parallel();
  const TileRays tile(view);
  std::size_t fragments = 0;
  for (std::size_t begin = 0; begin < entries.size(); begin += SheetBatch::size) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(SheetBatch::size, entries.size() - begin));
    setUpSheets(view, cells, entries.subspan(begin + cells.size()), scratch.batch);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const SheetCell& cell = scratch.batch.cell[i];
      if (parallel ? paintedPlain<true>(view, cells[i], cell, pixels, fragments)
                   : paintedPlain<false>(view, cells[i], cell, pixels, fragments)) {
        continue;
      }
      const std::size_t n = coverOne(view, tile, cells[i], cell, pixels, scratch);
      if (n == 0) continue;
      const Painting painting{view, cell, scratch.bounds, scratch.covered, n};
      const bool clipped = view.clipped || !scratch.bounds.empty();
      if (parallel) {
        fragments +=
            clipped ? shadeSheetsAs<true, true>(painting, pixels) : shadeSheetsAs<true, false>(painting, pixels);
      } else {
        fragments +=
            clipped ? shadeSheetsAs<false, true>(painting, pixels) : shadeSheetsAs<false, false>(painting, pixels);
      }
    }
    if (view.trusted && begin / SheetBatch::size % batches_between_looks == batches_between_looks - 1 &&
        markOpaque(pixels)) {
      break;
    }
  }
  return fragments;
}

// The fragments of a cell on the pixels wanted. There are few: every cell takes the shader that is right for all.
template <bool Parallel>
HWY_NOINLINE void collectOne(const Painting& p, const PixelMask& wanted, const Pixels& pixels, Pixels& blank,
                             std::vector<Fragment>& out) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<Care::full> shader(p.cell.look);
  const SheetRays<Parallel> rays(p.view, p.cell, shader.anchor());
  alignas(64) float nears[block_pixels];
  alignas(64) float fars[block_pixels];
  for (std::size_t k = 0; k < p.count; ++k) {
    const std::size_t first = p.covered.pixel[k];
    Interval<VF> in = loadInterval(p, rays, first, SheetCoverage::width * lanes * k);
    auto inside = hn::Gt(in.near.z, in.far.z);
    const Segment segment = rays.template segment<true>(in, first, inside, pixels, p.bounds);
    unsigned bits = maskBits(inside) & (static_cast<unsigned>(wanted[first / block_pixels]) >> (first % block_pixels));
    if (bits == 0) continue;
    for (auto* channel : {&blank.red, &blank.green, &blank.blue})
      hn::Store(hn::Zero(d), d, channel->data() + first);
    hn::Store(hn::Set(d, 1.0F), d, blank.light.data() + first);
    shader.blend(segment, first, blank);
    hn::Store(in.near.z, d, nears);
    hn::Store(in.far.z, d, fars);
    for (; bits != 0; bits &= bits - 1) {
      const std::size_t lane = static_cast<unsigned>(std::countr_zero(bits));
      const std::size_t at = first + lane;
      out.push_back({nears[lane], fars[lane], blank.red[at], blank.green[at], blank.blue[at], blank.light[at],
                     static_cast<std::uint32_t>(at)});
    }
  }
}

bool sheetFragments(const TileView& view, std::span<const Entry> entries, const PixelMask& wanted, Pixels& pixels,
                    SheetScratch& scratch, Pixels& blank, std::size_t most, std::vector<Fragment>& out) {
  lookAtWanted(wanted, pixels);
  const TileRays tile(view);
  for (std::size_t begin = 0; begin < entries.size(); begin += SheetBatch::size) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(SheetBatch::size, entries.size() - begin));
    setUpSheets(view, cells, entries.subspan(begin + cells.size()), scratch.batch);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const SheetCell& cell = scratch.batch.cell[i];
      const std::size_t n = coverOne(view, tile, cells[i], cell, pixels, scratch);
      if (n == 0) continue;
      const Painting painting{view, cell, scratch.bounds, scratch.covered, n};
      if (view.screen->parallel()) {
        collectOne<true>(painting, wanted, pixels, blank, out);
      } else {
        collectOne<false>(painting, wanted, pixels, blank, out);
      }
    }
    if (out.size() > most) return false;
  }
  return true;
}

void cellBoxes(const Place* places, const mesh::Id* corners, const mesh::Id* offset, const Box& region,
               std::size_t first, std::size_t last, TileBox* out) {
  // Wider than the rounding of a place in float anywhere in the largest image.
  constexpr float margin = 0.01F;
  static_assert(tile_size == 1 << tile_shift);
  for (std::size_t c = first; c < last; ++c) {
    float x0 = not_a_place, y0 = not_a_place, x1 = -not_a_place, y1 = -not_a_place;
    for (mesh::Id k = offset[c]; k < offset[c + 1]; ++k) {
      const Place& p = places[corners[k]];
      x0 = std::min(x0, p.x);
      y0 = std::min(y0, p.y);
      x1 = std::max(x1, p.x);
      y1 = std::max(y1, p.y);
    }
    if (x1 == not_a_place) {
      out[c] = unknown_tiles;
      continue;
    }
    const auto from = [](float lo, int begin) {
      return std::max(std::ceil(lo - (0.5F + margin)), static_cast<float>(begin)) - static_cast<float>(begin);
    };
    const auto to = [](float hi, int begin, int end) {
      return std::min(std::floor(hi - (0.5F - margin)), static_cast<float>(end - 1)) - static_cast<float>(begin);
    };
    const float a = from(x0, region.x0), b = from(y0, region.y0);
    const float e = to(x1, region.x0, region.x1), f = to(y1, region.y0, region.y1);
    const auto tile = [](float pixel) { return static_cast<std::uint32_t>(pixel) >> tile_shift; };
    out[c] = a > e || b > f ? no_tiles : tileBox(tile(a), tile(b), tile(e), tile(f));
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::composite::native {

HWY_EXPORT(sheets);
HWY_EXPORT(sheetFragments);
HWY_EXPORT(cellBoxes);

void boxCells(const Place* places, const mesh::Id* corners, const mesh::Id* offset, const Box& region,
              std::size_t first, std::size_t last, TileBox* boxes) {
  HWY_DYNAMIC_DISPATCH(cellBoxes)(places, corners, offset, region, first, last, boxes);
}

std::size_t paintSheets(const TileView& view, std::span<const Entry> entries, Pixels& pixels, SheetScratch& scratch) {
  return HWY_DYNAMIC_DISPATCH(sheets)(view, entries, pixels, scratch);
}

bool collectSheets(const TileView& view, std::span<const Entry> entries, const PixelMask& wanted, Pixels& pixels,
                   SheetScratch& scratch, Pixels& blank, std::size_t most, std::vector<Fragment>& out) {
  return HWY_DYNAMIC_DISPATCH(sheetFragments)(view, entries, wanted, pixels, scratch, blank, most, out);
}

}  // namespace spillikin::composite::native
#endif
