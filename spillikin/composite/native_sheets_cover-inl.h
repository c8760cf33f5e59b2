// Where rays enter and leave whole cells and pieces of them, by their sheets. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_SHEETS_COVER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_SHEETS_COVER_INL_H
#undef SPILLIKIN_NATIVE_SHEETS_COVER_INL_H
#else
#define SPILLIKIN_NATIVE_SHEETS_COVER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_piece_share-inl.h"
#include "spillikin/composite/native_sheets.h"
#include "spillikin/composite/native_sheets_crossing-inl.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// What clip planes leave of each ray.
template <class V>
struct Limits {
  V near, far;
};

template <class V, class At>
HWY_INLINE Limits<V> limitsOf(const TileView& view, const Pixels& pixels, const At& first) {
  if (view.clipped) return {wide::load(pixels.clip_near.data(), first), wide::load(pixels.clip_far.data(), first)};
  const V none = wide::same<V>(hn::Set(DF(), std::numeric_limits<float>::infinity()));
  return {none, wide::Neg(none)};
}

// A gap that rays may cross: where they leave the cell, and where they enter it again. Both are one triangle each.
template <Known known>
struct GapEnds {
  End<known, VF> out, again;
  hn::Mask<DF> open;
  VF margin;  // what cannot be told of either in float, and the certificate's tolerance
  bool out_steep, again_steep;
  HWY_INLINE GapEnds(const SheetCell& cell, SheetCell::Gap gap, const VF& tolerance, const VF& x, const VF& y)
      : out(onSheet<known, false>(cell, gap.leaves, x, y)),
        again(onSheet<known, false>(cell, gap.enters, x, y)),
        open(hn::Gt(out.z, again.z)),
        margin(hn::Add(tolerance, hn::Set(DF(), gap.rounding))),
        out_steep((cell.steep >> gap.leaves & 1U) != 0),
        again_steep((cell.steep >> gap.enters & 1U) != 0) {}

  // Whether the gap is open, or as good as, where an interval is.
  HWY_INLINE hn::Mask<DF> touches(const Interval<known, VF>& in) const {
    const auto ends_behind = hn::Gt(out.z, hn::Sub(hn::Max(in.far.z, again.z), margin));
    return hn::And(in.some(), hn::And(ends_behind, hn::Lt(again.z, hn::Add(in.near.z, margin))));
  }
  // Whether a steep sheet is met within the interval.
  HWY_INLINE hn::Mask<DF> meetsSteep(const Interval<known, VF>& in) const {
    const DF d;
    const auto within = [&](const VF& z) HWY_ATTR {
      return hn::And(hn::Gt(z, hn::Sub(in.far.z, margin)), hn::Lt(z, hn::Add(in.near.z, margin)));
    };
    const auto none = hn::MaskFromVec(hn::Zero(d));
    return hn::Or(out_steep ? within(out.z) : none, again_steep ? within(again.z) : none);
  }
};

// What a gap leaves of an interval before it and behind it; nothing where that is too short to count in the order.
template <Known known>
struct GapParts {
  hn::Mask<DF> before, behind;
  HWY_INLINE GapParts(const TileView& view, const GapEnds<known>& gap, const Limits<VF>& limits,
                      const Interval<known, VF>& in) {
    const DF d;
    const auto open = hn::And(gap.open, in.some());
    const auto some = [&](VF near, VF far) HWY_ATTR {
      const VF least = hn::MulAdd(hn::Max(near, hn::Zero(d)), hn::Set(d, solid_share * view.overlap_slope),
                                  hn::Set(d, solid_share * view.overlap_at));
      return hn::And(open, hn::Gt(hn::Sub(hn::Min(near, limits.near), hn::Max(far, limits.far)), least));
    };
    before = some(in.near.z, hn::Max(gap.out.z, in.far.z));
    behind = some(hn::Min(gap.again.z, in.near.z), in.far.z);
    // Where nothing is behind, the interval ends no later than before the gap.
    ends = hn::And(open, hn::AndNot(behind, hn::Gt(gap.out.z, in.far.z)));
    begins = hn::And(behind, hn::AndNot(before, hn::Lt(gap.again.z, in.near.z)));
  }
  HWY_INLINE hn::Mask<DF> both() const { return hn::And(before, behind); }
  HWY_INLINE void apply(const GapEnds<known>& gap, Interval<known, VF>& in) const {
    take(in.far, gap.out, ends);
    take(in.near, gap.again, begins);
  }

 private:
  hn::Mask<DF> ends, begins;
};

// A gap takes one end or the other of the interval, or leaves two. Returns the lanes that are to go one by one: those
// of two intervals; of a piece of a cell, which may be to draw one of them, those of three, and those of which it
// cannot tell how many there are.
template <Known known>
HWY_INLINE hn::Mask<DF> crossGap(const TileView& view, const SheetCell& cell, SheetCell::Gap at,
                                 const PieceShare& share, const Limits<VF>& limits, const VF& x, const VF& y,
                                 Interval<known, VF>& in, Interval<known, VF>& second) {
  const DF d;
  const GapEnds<known> gap(cell, at, share.toleranceAt(in.near.z), x, y);
  const auto touched = gap.touches(in), second_touched = gap.touches(second);
  auto hard = hn::MaskFromVec(hn::Zero(d));
  // Few rays cross the gap of a face, which is seen nearly edge-on.
  if (HWY_LIKELY(hn::AllFalse(d, hn::Or(touched, second_touched)))) return hard;
  if (gap.out_steep || gap.again_steep) {
    hard = hn::Or(hn::And(touched, gap.meetsSteep(in)), hn::And(second_touched, gap.meetsSteep(second)));
  }
  const GapParts<known> parts(view, gap, limits, in);
  if (!share.partial()) {
    parts.apply(gap, in);
    return hn::Or(hard, parts.both());
  }
  const auto doubt = hn::Le(hn::Abs(hn::Sub(gap.out.z, gap.again.z)), gap.margin);
  hard = hn::Or(hard, hn::And(doubt, hn::Or(touched, second_touched)));
  const auto taken = second.some();
  const GapParts<known> of_second(view, gap, limits, second);
  of_second.apply(gap, second);
  hard = hn::Or(hard, of_second.both());
  hard = hn::Or(hard, hn::And(taken, parts.both()));
  const auto split = hn::AndNot(taken, parts.both());
  take(second.far, in.far, split);
  take(second.near, gap.again, split);
  take(in.far, gap.out, split);
  parts.apply(gap, in);
  return hard;
}

template <Known known>
HWY_INLINE hn::Mask<DF> meetsSteep(const SheetCell& cell, const Interval<known, VF>& in) {
  const DF d;
  const hn::RebindToUnsigned<DF> du;
  const auto steep = hn::Set(du, cell.steep);
  const auto bit = [&](VF sheet) HWY_ATTR { return hn::Shr(steep, hn::BitCast(du, sheet)); };
  const auto met = hn::And(hn::Or(bit(in.near.sheet), bit(in.far.sheet)), hn::Set(du, 1));
  return hn::And(hn::RebindMask(d, hn::Ne(met, hn::Zero(du))), in.some());
}

struct Cover {
  const TileView& view;
  const SheetCell& cell;
  std::span<const WholeCell::Bound> bounds;
  std::uint64_t blocks;
  const Pixels& pixels;
  SheetCoverage& out;
  std::vector<std::uint16_t>& one_by_one;
};

// Of a piece of a cell, and of a cell with gaps or steep sheets (Careful), vectors on which nothing is left are left
// out (Cut).
template <bool Careful, bool Cut, Known known, bool Folded, unsigned Sheets>
HWY_NOINLINE std::size_t coverSheets(const Cover& c) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t n = 0;
  // The end of an interval may lie outside of the limits, which `inside` respects.
  const auto keep = [&](const Interval<known, VF>& in, hn::Mask<DF> inside, std::size_t first) HWY_ATTR {
    float* out = c.out.vector + SheetCoverage::width * lanes * n;
    hn::Store(in.near.z, d, out);
    hn::Store(in.far.z, d, out + lanes);
    if constexpr (known != Known::place) {
      hn::Store(in.near.sheet, d, out + 2 * lanes);
      hn::Store(in.far.sheet, d, out + 3 * lanes);
    }
    if constexpr (known == Known::side) {
      hn::Store(in.near.side, d, out + 4 * lanes);
      hn::Store(in.far.side, d, out + 5 * lanes);
    }
    c.out.pixel[n] = static_cast<std::uint32_t>(first);
    // No branch on what is as good as random: an empty vector's place is taken by the next one.
    n += static_cast<std::size_t>(!hn::AllFalse(d, inside));
  };
  const PieceShare share(c.view, c.bounds);
  const SheetIntervals<known, Folded, Sheets> interval(c.cell, c.blocks);
  byBlocks(c.blocks, [&](std::size_t first) HWY_ATTR {
    const VF x = centresX(first), y = centresY(first);
    auto in = interval(first);
    if constexpr (!Cut) return keep(in, in.some(), first);
    const Limits<VF> limits = limitsOf<VF>(c.view, c.pixels, first);
    auto hard = hn::MaskFromVec(hn::Zero(d));
    if constexpr (Careful) {
      if constexpr (known != Known::place) hard = meetsSteep(c.cell, in);
      Interval<known, VF> second{in.far, in.far};
      for (unsigned k = 0; k < c.cell.gap_count; ++k)
        hard = hn::Or(hard, crossGap(c.view, c.cell, c.cell.gap[k], share, limits, x, y, in, second));
      const auto more = second.some();
      if (share.partial() && !hn::AllFalse(d, more)) {
        const auto of_first = share(in.near.z, in.far.z, x, y), of_second = share(second.near.z, second.far.z, x, y);
        hard = hn::Or(hard, hn::And(more, hn::Or(of_second.unsure, hn::And(of_second.mine, of_first.mine))));
        const auto mine = hn::And(more, of_second.mine);
        take(in.near, second.near, mine);
        take(in.far, second.far, mine);
      }
    }
    const auto some = hn::Gt(hn::Min(in.near.z, limits.near), hn::Max(in.far.z, limits.far));
    const auto lanes_of = share(in.near.z, in.far.z, x, y);
    hard = hn::Or(hard, hn::And(some, lanes_of.unsure));
    listPixels(maskBits(hard), first, c.one_by_one);
    const auto inside = hn::And(some, hn::AndNot(hard, lanes_of.mine));
    in.near.z = hn::IfThenElse(inside, in.near.z, in.far.z);
    keep(in, inside, first);
  });
  return n;
}

// Most cells have three or four sheets on either side.
template <bool Careful, bool Cut, Known known, bool Folded>
HWY_INLINE std::size_t coverCounted(const Cover& c) {
  const unsigned most = std::max(c.cell.entered_count, c.cell.left_count);
  if constexpr (!Cut || known == Known::place) {
    if (most <= 3) return coverSheets<Careful, Cut, known, Folded, 3>(c);
  }
  if constexpr (Folded || !Cut) {
    if (most <= 4) return coverSheets<Careful, Cut, known, Folded, 4>(c);
  }
  return coverSheets<Careful, Cut, known, Folded, 0>(c);
}

template <bool Careful, bool Cut, Known known>
HWY_INLINE std::size_t coverFolded(const Cover& c) {
  constexpr Known flat = known == Known::side ? Known::sheet : known;
  return c.cell.folded ? coverCounted<Careful, Cut, known, true>(c) : coverCounted<Careful, Cut, flat, false>(c);
}

// Of a cell that is linear no more need be known than where its intervals are, but where sheets are steep.
HWY_INLINE std::size_t coverAny(const Cover& c) {
  if (c.cell.linear && c.cell.steep == 0) return coverFolded<true, true, Known::place>(c);
  if (c.cell.gap_count > 0 || c.cell.steep != 0) return coverFolded<true, true, Known::side>(c);
  if (!c.bounds.empty()) return coverFolded<false, true, Known::side>(c);
  return coverFolded<false, false, Known::side>(c);
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
