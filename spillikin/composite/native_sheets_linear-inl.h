// Whole cells with a linear field (see native_linear-inl.h) onto the pixels. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_SHEETS_LINEAR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_SHEETS_LINEAR_INL_H
#undef SPILLIKIN_NATIVE_SHEETS_LINEAR_INL_H
#else
#define SPILLIKIN_NATIVE_SHEETS_LINEAR_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "spillikin/composite/native_paint-inl.h"
#include "spillikin/composite/native_sheets.h"
#include "spillikin/composite/native_sheets_cover-inl.h"
#include "spillikin/composite/native_sheets_crossing-inl.h"
#include "spillikin/composite/native_tiny-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <class Shade, bool Folded, unsigned Sheets>
HWY_NOINLINE std::size_t paintCrossing(const TileView& view, const SheetBatch& batch, std::size_t i, Pixels& pixels) {
  const std::uint64_t blocks = batch.cell[i].block_bits & pixels.live;
  const SheetCrossing<Folded, Sheets> crossing(batch.cell[i], scalarForm(batch.field, i), blocks);
  return paintCrossed<Shade>(crossing, view, batch.field, i, blocks, pixels);
}

template <class Shade>
HWY_INLINE std::size_t paintLinearAs(const TileView& view, const SheetBatch& batch, std::size_t i, Pixels& pixels) {
  const SheetCell& cell = batch.cell[i];
  const bool few = std::max(cell.entered_count, cell.left_count) <= 3;
  if (cell.folded) {
    return few ? paintCrossing<Shade, true, 3>(view, batch, i, pixels)
               : paintCrossing<Shade, true, 0>(view, batch, i, pixels);
  }
  return few ? paintCrossing<Shade, false, 3>(view, batch, i, pixels)
             : paintCrossing<Shade, false, 0>(view, batch, i, pixels);
}

// Cell i, of which rays meet one interval each.
template <bool Parallel>
HWY_INLINE std::size_t paintLinear(const TileView& view, const SheetBatch& batch, std::size_t i, Pixels& pixels) {
  return withSmallShading<Parallel>(batch.field.kind[i], [&](auto shade) HWY_ATTR {
    return paintLinearAs<typename decltype(shade)::type>(view, batch, i, pixels);
  });
}

struct LinearCell {
  const TileView& view;
  const CellBatch& field;
  std::size_t i;
};

template <class Shade>
HWY_NOINLINE std::size_t shadeCovered(const LinearCell& cell, const SheetCoverage& covered, std::size_t count,
                                      Pixels& pixels) {
  const std::size_t lanes = hn::Lanes(DF());
  const Shade shade(cell.view, cell.field, cell.i);
  const FormV form(scalarForm(cell.field, cell.i));
  const Certificate certificate(cell.view);
  std::size_t fragments = 0;
  const auto paint = [&](const auto& first, const auto& at) HWY_ATTR {
    const auto near = wide::load(covered.vector, at), far = wide::load(covered.vector + lanes, at);
    const auto inside = wide::Gt(near, far);
    fragments += wide::CountTrue(inside);
    shade.check(certificate, near, far, inside, first, pixels);
    shade.blend(Crossed{near, far, form(first)}, inside, first, pixels);
  };
  if constexpr (Shade::short_chain) {
    for (std::size_t k = 0; k < count; ++k)
      paint(std::size_t{covered.pixel[k]}, SheetCoverage::width * lanes * k);
  } else {
    wide::byTwos(covered.pixel, count, SheetCoverage::width * lanes, paint);
  }
  return fragments;
}

// The same where coverAny() has told the intervals.
template <bool Parallel>
HWY_INLINE std::size_t shadeLinear(const LinearCell& cell, const SheetCoverage& covered, std::size_t count,
                                   Pixels& pixels) {
  return withSmallShading<Parallel>(cell.field.kind[cell.i], [&](auto shade) HWY_ATTR {
    return shadeCovered<typename decltype(shade)::type>(cell, covered, count, pixels);
  });
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
