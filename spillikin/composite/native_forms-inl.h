// Linear forms of a pixel's centre, such as nearness on a plane, on one vector of pixels after the other. Included once
// per instruction set.

#if defined(SPILLIKIN_NATIVE_FORMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_FORMS_INL_H
#undef SPILLIKIN_NATIVE_FORMS_INL_H
#else
#define SPILLIKIN_NATIVE_FORMS_INL_H
#endif

#include <hwy/highway.h>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_wide-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// A linear form of the pixel's centre.
struct Form {
  float x, y, t;
};

// What its terms add up to at most, anywhere in the tile.
HWY_INLINE float mostTerms(const Form& form) {
  return (std::abs(form.x) + std::abs(form.y)) * float{tile_size} + std::abs(form.t);
}

template <class V>
HWY_INLINE V formAt(const Form& form, const V& x, const V& y) {
  const DF d;
  return wide::MulAdd(hn::Set(d, form.x), x, wide::MulAdd(hn::Set(d, form.y), y, hn::Set(d, form.t)));
}

// The same over vectors, where they come in no order.
class FormV {
 public:
  explicit HWY_INLINE FormV(const Form& form)
      : x_(hn::Set(DF(), form.x)), y_(hn::Set(DF(), form.y)), t_(hn::Set(DF(), form.t)) {}

  template <class At>
  HWY_INLINE auto operator()(const At& first) const {
    return wide::MulAdd(x_, centresX(first), wide::MulAdd(y_, centresY(first), t_));
  }

 private:
  VF x_, y_, t_;
};

// What a form of slopes x and y gains from a block's first pixel on, vector by vector.
class OverBlock {
 public:
  static constexpr std::size_t lanes = hn::MaxLanes(DF()), vectors = block_pixels / lanes;
  HWY_INLINE VF operator()(float x, float y, std::size_t vector) const {
    const DF d;
    const auto from_first = [&](const float* centre)
                                HWY_ATTR { return hn::Sub(hn::Load(d, centre + vector * lanes), hn::Set(d, *centre)); };
    return hn::MulAdd(hn::Set(d, x), from_first(centres.x[0]), hn::Mul(hn::Set(d, y), from_first(centres.y[0])));
  }
};

// Forms over the blocks of a tile. Each is what it gains from a block's first pixel on, the same for every block, and a
// number each for the block's column and its row: two additions, which take fewer registers than the form's three
// coefficients, and which some cores do beside their multiplications (a fifth to a quarter less time a block on Zen 4).
template <std::size_t Count>
struct Forms {
  static constexpr std::size_t columns = block_columns;
  float slope[Count][2];
  alignas(64) float of_block[Count][2 * columns];  // by column, then by row

  HWY_INLINE void set(std::size_t k, const Form& form) {
    const hn::CappedTag<float, columns> d;
    slope[k][0] = form.x;
    slope[k][1] = form.y;
    for (std::size_t c = 0; c < columns; c += hn::Lanes(d)) {
      const auto corner = hn::Load(d, block_corners.at + c);
      hn::Store(hn::Mul(hn::Set(d, form.x), corner), d, of_block[k] + c);
      hn::Store(hn::MulAdd(hn::Set(d, form.y), corner, hn::Set(d, form.t)), d, of_block[k] + columns + c);
    }
  }
};

// The same in registers, as far as they reach.
template <std::size_t Count>
class FormsV {
 public:
  // `forms` is to outlive it.
  explicit HWY_INLINE FormsV(const Forms<Count>& forms) : of_block_(forms.of_block) {
    for (std::size_t k = 0; k < Count; ++k) {
      for (std::size_t v = 0; v < OverBlock::vectors; ++v)
        over_[k][v] = OverBlock()(forms.slope[k][0], forms.slope[k][1], v);
    }
  }

  // Form k on the vectors at one place or at two.
  template <class At>
  HWY_INLINE auto operator()(std::size_t k, const At& first) const {
    if constexpr (wide::is_two<At>) {
      return wide::two((*this)(k, first.a), (*this)(k, first.b));
    } else {
      const DF d;
      const std::size_t block = first / block_pixels;
      const float* at = of_block_[k];
      const VF over = over_[k][first % block_pixels / OverBlock::lanes];
      const VF in_row = hn::Add(over, hn::Set(d, at[Given::columns + block / Given::columns]));
      return hn::Add(in_row, hn::Set(d, at[block % Given::columns]));
    }
  }

 private:
  using Given = Forms<Count>;
  VF over_[Count][OverBlock::vectors];
  const float (*of_block_)[2 * Given::columns];
};

// So many forms, 16 at most, over those blocks of a tile that a cell covers: what they are at the first pixels of the
// blocks is found ahead, for all forms at once, and one addition is left. It pays for many forms on many blocks; what
// is found just before it is wanted must first come out of the core's store buffer.
template <std::size_t Count>
class BlockForms {
 public:
  // formOf(k) is the k-th.
  template <class F>
  HWY_INLINE BlockForms(const F& formOf, std::uint64_t blocks) {
    alignas(64) float x[room] = {}, y[room] = {}, t[room] = {};
    for (std::size_t k = 0; k < Count; ++k) {
      const Form form = formOf(k);
      x[k] = form.x;
      y[k] = form.y;
      t[k] = form.t;
    }
    const OverBlock over;
    for (std::size_t k = 0; k < Count; ++k) {
      for (std::size_t v = 0; v < OverBlock::vectors; ++v)
        over_[k][v] = over(x[k], y[k], v);
    }
    for (; blocks != 0; blocks &= blocks - 1)
      setFirst(x, y, t, static_cast<std::size_t>(std::countr_zero(blocks)));
  }

  template <class At>
  HWY_INLINE auto operator()(std::size_t k, const At& first) const {
    if constexpr (wide::is_two<At>) {
      return wide::two((*this)(k, first.a), (*this)(k, first.b));
    } else {
      const VF over = over_[k][first % block_pixels / OverBlock::lanes];
      return hn::Add(over, hn::Set(DF(), first_[first / block_pixels][k]));
    }
  }

 private:
  static constexpr std::size_t room = 16;
  static_assert(Count <= room);

  HWY_INLINE void setFirst(const float* x, const float* y, const float* t, std::size_t block) {
    const DF d;
    const VF column = hn::Set(d, block_corners.at[block % block_columns]);
    const VF row = hn::Set(d, block_corners.at[block / block_columns]);
    for (std::size_t k = 0; k < Count; k += hn::Lanes(d)) {
      const VF in_row = hn::MulAdd(hn::Load(d, y + k), row, hn::Load(d, t + k));
      hn::Store(hn::MulAdd(hn::Load(d, x + k), column, in_row), d, first_[block] + k);
    }
  }

  VF over_[Count][OverBlock::vectors];
  alignas(64) float first_[tile_blocks][room];  // by block, of those that are covered
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
