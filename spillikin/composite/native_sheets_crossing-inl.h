// Where rays enter and leave whole cells by their sheets, were there no gap between them. Included once per instruction
// set.

#if defined(SPILLIKIN_NATIVE_SHEETS_CROSSING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_SHEETS_CROSSING_INL_H
#undef SPILLIKIN_NATIVE_SHEETS_CROSSING_INL_H
#else
#define SPILLIKIN_NATIVE_SHEETS_CROSSING_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_crossing-inl.h"
#include "spillikin/composite/native_forms-inl.h"
#include "spillikin/composite/native_sheets.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DS = hn::RebindToSigned<DF>;
using VS = hn::Vec<DS>;

// Of sheet k.
HWY_INLINE Form sheetForm(const SheetCell::Coefficient (&of)[3], std::size_t k) {
  return {of[0][k], of[1][k], of[2][k]};
}

// What is known of the ends of intervals: how near they are alone; the sheets that they lie on, too; and on which side
// of the diagonal, where that is folded.
enum class Known { place, sheet, side };

// One end of the intervals of a vector of rays, or of two: how near, on which sheet (a number's bits), and e on it.
template <Known known, class V>
struct End {
  V z, sheet, side;
};
template <class V>
struct End<Known::place, V> {
  V z;
};
template <class V>
struct End<Known::sheet, V> {
  V z, sheet;
};

template <class V>
HWY_INLINE V sideOf(const SheetCell& cell, std::size_t k, const V& x, const V& y) {
  return wide::Max(formAt(sheetForm(cell.side, k), x, y), hn::Zero(DF()));
}

template <Known known, bool Folded, class V>
HWY_INLINE End<known, V> onSheet(const SheetCell& cell, std::size_t k, const V& x, const V& y) {
  const DF d;
  End<known, V> end;
  end.z = formAt(sheetForm(cell.plane, k), x, y);
  if constexpr (known != Known::place)
    end.sheet = wide::same<V>(hn::BitCast(d, hn::Set(DS(), static_cast<std::int32_t>(k))));
  if constexpr (Folded) {
    const V side = sideOf(cell, k, x, y);
    end.z = wide::MulAdd(hn::Set(d, cell.fold[k]), side, end.z);
    if constexpr (known == Known::side) end.side = side;
  } else if constexpr (known == Known::side) {
    end.side = wide::same<V>(hn::Zero(d));  // a triangle has but one
  }
  return end;
}

template <Known known, class V, class M>
HWY_INLINE void take(End<known, V>& end, const End<known, V>& other, const M& where) {
  end.z = wide::IfThenElse(where, other.z, end.z);
  if constexpr (known != Known::place) end.sheet = wide::IfThenElse(where, other.sheet, end.sheet);
  if constexpr (known == Known::side) end.side = wide::IfThenElse(where, other.side, end.side);
}

// The farther, or the nearer, of two ends.
template <Known known, class V>
HWY_INLINE void takeFarther(End<known, V>& end, const End<known, V>& other) {
  if constexpr (known == Known::place) {
    end.z = wide::Min(end.z, other.z);
  } else {
    take(end, other, wide::Lt(other.z, end.z));
  }
}
template <Known known, class V>
HWY_INLINE void takeNearer(End<known, V>& end, const End<known, V>& other) {
  if constexpr (known == Known::place) {
    end.z = wide::Max(end.z, other.z);
  } else {
    take(end, other, wide::Gt(other.z, end.z));
  }
}

template <Known known, class V>
struct Interval {
  End<known, V> near, far;
  HWY_INLINE auto some() const { return wide::Gt(near.z, far.z); }
};

// Of as many sheets as there are, or, where that is not 0, of the first `Sheets` of either list.
template <Known known, bool Folded, unsigned Sheets, class V>
HWY_INLINE Interval<known, V> intervalOf(const SheetCell& cell, const V& x, const V& y) {
  const auto sheet = [&](std::size_t k) HWY_ATTR { return onSheet<known, Folded>(cell, k, x, y); };
  Interval<known, V> in{sheet(cell.entered[0]), sheet(cell.left[0])};
  const unsigned entered = Sheets > 0 ? Sheets : cell.entered_count;
  for (unsigned k = 1; k < entered; ++k)
    takeFarther(in.near, sheet(cell.entered[k]));
  const unsigned left = Sheets > 0 ? Sheets : cell.left_count;
  for (unsigned k = 1; k < left; ++k)
    takeNearer(in.far, sheet(cell.left[k]));
  return in;
}

// The first `Count` sheets that a cell is entered by, then those that it is left by.
template <unsigned Count>
HWY_INLINE std::size_t sheetOf(const SheetCell& cell, std::size_t j) {
  return j < Count ? cell.entered[j] : cell.left[j - Count];
}

// Between as many sheets on either side: place(j) is nearness on one of them, in that order.
template <unsigned Count, class V, class Place>
HWY_INLINE Crossed<V> betweenSheets(const Place& place, const V& scalar) {
  V near = place(0), far = place(Count);
  for (std::size_t j = 1; j < Count; ++j) {
    near = wide::Min(near, place(j));
    far = wide::Max(far, place(Count + j));
  }
  return {near, far, scalar};
}

// Where rays cross a cell of flat sheets, as many on either side, and the scalar's form there.
template <unsigned Sheets>
class FlatCrossing {
 public:
  HWY_INLINE FlatCrossing(const SheetCell& cell, const Form& scalar, std::uint64_t /*blocks*/)
      : forms_(setForms(cell, scalar, given_)) {}

  template <class At>
  HWY_INLINE auto operator()(const At& first) const {
    const auto place = [&](std::size_t j) HWY_ATTR { return forms_(j, first); };
    return betweenSheets<Sheets>(place, forms_(scalar_form, first));
  }

 private:
  static constexpr std::size_t scalar_form = std::size_t{2} * Sheets;
  using Given = Forms<scalar_form + 1>;

  static HWY_INLINE const Given& setForms(const SheetCell& cell, const Form& scalar, Given& forms) {
    for (std::size_t j = 0; j < scalar_form; ++j)
      forms.set(j, sheetForm(cell.plane, sheetOf<Sheets>(cell, j)));
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
  HWY_INLINE auto operator()(const At& first) const {
    const auto place = [&](std::size_t j) HWY_ATTR {
      const auto side = wide::Max(forms_(planes + j, first), hn::Zero(DF()));
      return wide::MulAdd(hn::Set(DF(), fold_[j]), side, forms_(j, first));
    };
    return betweenSheets<Sheets>(place, forms_(scalar_form, first));
  }

 private:
  // The sheets' planes, then their sides.
  static constexpr std::size_t planes = std::size_t{2} * Sheets, scalar_form = 2 * planes;

  static HWY_INLINE Form formOf(const SheetCell& cell, const Form& scalar, std::size_t f) {
    if (f == scalar_form) return scalar;
    return sheetForm(f < planes ? cell.plane : cell.side, sheetOf<Sheets>(cell, f % planes));
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
  HWY_INLINE auto operator()(const At& first) const {
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

// Intervals of rays without the scalar. `Sheets` as with intervalOf.
template <Known known, bool Folded, unsigned Sheets>
class SheetIntervals {
 public:
  HWY_INLINE SheetIntervals(const SheetCell& cell, std::uint64_t /*blocks*/) : cell_(cell) {}
  HWY_INLINE Interval<known, VF> operator()(std::size_t first) const {
    return intervalOf<known, Folded, Sheets>(cell_, centresX(first), centresY(first));
  }

 private:
  const SheetCell& cell_;
};

template <>
class SheetIntervals<Known::place, true, 3> {
 public:
  HWY_INLINE SheetIntervals(const SheetCell& cell, std::uint64_t blocks) : crossing_(cell, {}, blocks) {}
  HWY_INLINE Interval<Known::place, VF> operator()(std::size_t first) const {
    const auto ray = crossing_(first);
    return {{ray.near}, {ray.far}};
  }

 private:
  FoldedCrossing<3> crossing_;
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
