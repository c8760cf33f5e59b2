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
#include "spillikin/composite/native_tiny-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// The first `Count` sheets that a cell is entered by, then those that it is left by.
template <unsigned Count>
HWY_INLINE std::size_t sheetOf(const SheetCell& cell, std::size_t j) {
  return j < Count ? cell.entered[j] : cell.left[j - Count];
}

// Where rays cross a cell of flat sheets, as many on either side, and the scalar's form there.
template <unsigned Sheets>
class FlatCrossing {
 public:
  HWY_INLINE FlatCrossing(const SheetCell& cell, const Form& scalar, std::uint64_t /*blocks*/)
      : forms_(setForms(cell, scalar, given_)) {}

  template <class At>
  HWY_INLINE auto operator()(const At& first, const Pixels& /*pixels*/) const {
    auto near = forms_(0, first), far = forms_(Sheets, first);
    for (unsigned j = 1; j < Sheets; ++j) {
      near = wide::Min(near, forms_(j, first));
      far = wide::Max(far, forms_(Sheets + j, first));
    }
    return Crossed<decltype(near)>{near, far, forms_(scalar_form, first)};
  }

 private:
  static constexpr std::size_t scalar_form = std::size_t{2} * Sheets;
  using Given = Forms<scalar_form + 1>;

  static HWY_INLINE const Given& setForms(const SheetCell& cell, const Form& scalar, Given& forms) {
    for (std::size_t j = 0; j < scalar_form; ++j) {
      const std::size_t k = sheetOf<Sheets>(cell, j);
      forms.set(j, {cell.plane[0][k], cell.plane[1][k], cell.plane[2][k]});
    }
    forms.set(scalar_form, scalar);
    return forms;
  }

  Given given_;
  FormsV<scalar_form + 1> forms_;
};

// The same of folded sheets.
template <unsigned Sheets>
class FoldedCrossing {
 public:
  HWY_INLINE FoldedCrossing(const SheetCell& cell, const Form& scalar, std::uint64_t blocks)
      : forms_([&](std::size_t f) HWY_ATTR { return formOf(cell, scalar, f); }, blocks) {
    for (std::size_t j = 0; j < planes; ++j)
      fold_[j] = cell.fold[sheetOf<Sheets>(cell, j)];
  }

  template <class At>
  HWY_INLINE auto operator()(const At& first, const Pixels& /*pixels*/) const {
    const auto place = [&](std::size_t j) HWY_ATTR {
      const auto side = wide::Max(forms_(planes + j, first), hn::Zero(DF()));
      return wide::MulAdd(hn::Set(DF(), fold_[j]), side, forms_(j, first));
    };
    auto near = place(0), far = place(Sheets);
    for (unsigned j = 1; j < Sheets; ++j) {
      near = wide::Min(near, place(j));
      far = wide::Max(far, place(Sheets + j));
    }
    return Crossed<decltype(near)>{near, far, forms_(scalar_form, first)};
  }

 private:
  // The sheets' planes, then their sides.
  static constexpr std::size_t planes = std::size_t{2} * Sheets, scalar_form = 2 * planes;

  static HWY_INLINE Form formOf(const SheetCell& cell, const Form& scalar, std::size_t f) {
    if (f == scalar_form) return scalar;
    const auto& of = f < planes ? cell.plane : cell.side;
    const std::size_t k = sheetOf<Sheets>(cell, f % planes);
    return {of[0][k], of[1][k], of[2][k]};
  }

  BlockForms<scalar_form + 1> forms_;
  float fold_[planes];
};

// The same of as many sheets as there are.
template <bool Folded>
class AnySheetCrossing {
 public:
  HWY_INLINE AnySheetCrossing(const SheetCell& cell, const Form& scalar, std::uint64_t /*blocks*/)
      : cell_(cell), scalar_(scalar) {}

  template <class At>
  HWY_INLINE auto operator()(const At& first, const Pixels& /*pixels*/) const {
    const auto in = intervalOf<Known::place, Folded, 0>(cell_, centresX(first), centresY(first));
    return Crossed<std::remove_cvref_t<decltype(in.near.z)>>{in.near.z, in.far.z, scalar_(first)};
  }

 private:
  const SheetCell& cell_;
  FormV scalar_;
};
// Of a cell that has neither gaps nor steep sheets. `Sheets` as with intervalOf.
template <bool Folded, unsigned Sheets>
using SheetCrossing = std::conditional_t<Sheets == 0, AnySheetCrossing<Folded>,
                                         std::conditional_t<Folded, FoldedCrossing<Sheets>, FlatCrossing<Sheets>>>;

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
