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
#include "spillikin/composite/native_sheets_cover-inl.h"
#include "spillikin/composite/native_sheets_linear-inl.h"
#include "spillikin/composite/native_sheets_setup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

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

  // With the sides of both ends by their sheets, where these are not known.
  template <Known known, class V, class At>
  HWY_INLINE Interval<Known::side, V> sided(const Interval<known, V>& in, const At& first) const {
    if constexpr (known == Known::side) {
      return in;
    } else {
      const V x = centresX(first), y = centresY(first);
      return {{in.near.z, in.near.sheet, side(in.near.sheet, x, y)},
              {in.far.z, in.far.sheet, side(in.far.sheet, x, y)}};
    }
  }

  // Lanes that are not inside get no length and harmless values. Trims near, far and inside where Clipped.
  template <bool Clipped, class V, class M, class At>
  HWY_INLINE SegmentOf<V> segment(Interval<Known::side, V>& in, const At& first, M& inside,
                                  const Pixels& pixels) const {
    const DF d;
    const VF half = hn::Set(d, 0.5F);
    const V x = centresX(first), y = centresY(first);
    V &near = in.near.z, &far = in.far.z;
    V begin, end;
    V length = depths(near, far, begin, end);
    V front = scalar(in.near, begin, x, y), back = scalar(in.far, end, x, y);
    if constexpr (Clipped) {
      const Limits<V> limits = limitsOf<V>(view_, pixels, first);
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
  HWY_INLINE V scalar(const End<Known::side, V>& at, const V& depth, const V& x, const V& y) const {
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

struct Painting {
  const TileView& view;
  const SheetCell& cell;
  const SheetCoverage& covered;
  std::size_t count;
};

// The intervals of the vectors at `at` of a SheetCoverage.
template <bool Parallel, class At>
HWY_INLINE auto loadInterval(const Painting& p, const SheetRays<Parallel>& rays, const At& first, const At& at) {
  const std::size_t lanes = hn::Lanes(DF());
  const auto load = [&](std::size_t k) HWY_ATTR { return wide::load(p.covered.vector + k * lanes, at); };
  using V = decltype(load(0));
  if (p.cell.folded) {
    return Interval<Known::side, V>{{load(0), load(2), load(4)}, {load(1), load(3), load(5)}};
  }
  return rays.sided(Interval<Known::sheet, V>{{load(0), load(2)}, {load(1), load(3)}}, first);
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
    auto inside = in.some();
    const auto segment = rays.template segment<Clipped>(in, first, inside, pixels);
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
    constexpr Known known = Folded ? Known::side : Known::sheet;
    auto in = rays.sided(intervalOf<known, Folded, Sheets>(cell, centresX(first), centresY(first)), first);
    auto inside = in.some();
    const auto segment = rays.template segment<false>(in, first, inside, pixels);
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

// Whether rays meet one interval of the cell each, told in float, and all of it is to be drawn.
HWY_INLINE bool isOneInterval(Entry entry, const SheetCell& cell) {
  return !entry.cut() && cell.gap_count == 0 && cell.steep == 0;
}

// Whether the cell was that simple, and was painted.
template <bool Parallel>
HWY_INLINE bool paintedPlain(const TileView& view, Entry entry, const SheetCell& cell, Pixels& pixels,
                             std::size_t& fragments) {
  if (cell.linear || view.clipped || !isOneInterval(entry, cell) || !isPlain(cell.care)) return false;
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

// The planes of a piece.
HWY_INLINE void setBounds(const TileView& view, const TileRays& tile, Entry entry,
                          std::vector<WholeCell::Bound>& bounds) {
  bounds.clear();
  if (HWY_LIKELY(!entry.cut())) return;
  for (const sort::HalfSpace& keep : view.screen->frame().order.cuts[entry.index()].keep)
    bounds.push_back(boundOf(view, tile, keep));
}

// One cell's vectors, or nothing where it is handed back.
HWY_INLINE std::size_t coverOne(const TileView& view, const TileRays& tile, Entry entry, const SheetCell& cell,
                                const Pixels& pixels, SheetScratch& scratch) {
  if (HWY_UNLIKELY(cell.care == Care::edge_on)) {
    view.hand_back.take(view.hand_back.self, entry);
    return 0;
  }
  setBounds(view, tile, entry, scratch.bounds);
  std::uint64_t blocks = cell.block_bits;
  if (entry.cut())
    blocks = cell.folded ? blockBits<true>(cell, scratch.bounds) : blockBits<false>(cell, scratch.bounds);
  blocks &= pixels.live;
  if (blocks == 0) return 0;
  scratch.one_by_one.clear();
  const Cover cover{view, cell, scratch.bounds, blocks, pixels, scratch.covered, scratch.one_by_one};
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
  const bool linear = !view.clipped && !view.peaks;
  std::size_t fragments = 0;
  for (std::size_t begin = 0; begin < entries.size(); begin += SheetBatch::size) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(SheetBatch::size, entries.size() - begin));
    setUpSheets(view, cells, entries.subspan(begin + cells.size()), linear, scratch.batch);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const SheetCell& cell = scratch.batch.cell[i];
      if (cell.linear && isOneInterval(cells[i], cell)) {
        fragments += parallel ? paintLinear<true>(view, scratch.batch, i, pixels)
                              : paintLinear<false>(view, scratch.batch, i, pixels);
        continue;
      }
      if (parallel ? paintedPlain<true>(view, cells[i], cell, pixels, fragments)
                   : paintedPlain<false>(view, cells[i], cell, pixels, fragments)) {
        continue;
      }
      const std::size_t n = coverOne(view, tile, cells[i], cell, pixels, scratch);
      if (n == 0) continue;
      if (cell.linear) {
        const LinearCell as{view, scratch.batch.field, i};
        fragments += parallel ? shadeLinear<true>(as, scratch.covered, n, pixels)
                              : shadeLinear<false>(as, scratch.covered, n, pixels);
        continue;
      }
      const Painting painting{view, cell, scratch.covered, n};
      if (parallel) {
        fragments +=
            view.clipped ? shadeSheetsAs<true, true>(painting, pixels) : shadeSheetsAs<true, false>(painting, pixels);
      } else {
        fragments +=
            view.clipped ? shadeSheetsAs<false, true>(painting, pixels) : shadeSheetsAs<false, false>(painting, pixels);
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
    auto in = loadInterval(p, rays, first, SheetCoverage::width * lanes * k);
    auto inside = in.some();
    const Segment segment = rays.template segment<true>(in, first, inside, pixels);
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
    setUpSheets(view, cells, entries.subspan(begin + cells.size()), false, scratch.batch);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const SheetCell& cell = scratch.batch.cell[i];
      const std::size_t n = coverOne(view, tile, cells[i], cell, pixels, scratch);
      if (n == 0) continue;
      const Painting painting{view, cell, scratch.covered, n};
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
