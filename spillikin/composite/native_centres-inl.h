// Vectors of pixel centres, relative to the tile. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_CENTRES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_CENTRES_INL_H
#undef SPILLIKIN_NATIVE_CENTRES_INL_H
#else
#define SPILLIKIN_NATIVE_CENTRES_INL_H
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_centres.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <class At>
HWY_INLINE auto centresX(const At& first) {
  if constexpr (wide::is_two<At>) {
    return wide::two(centresX(first.a), centresX(first.b));
  } else {
    return hn::Load(DF(), centres.x[first / block_pixels % block_columns] + first % block_pixels);
  }
}
template <class At>
HWY_INLINE auto centresY(const At& first) {
  if constexpr (wide::is_two<At>) {
    return wide::two(centresY(first.a), centresY(first.b));
  } else {
    return hn::Load(DF(), centres.y[first / block_pixels / block_columns] + first % block_pixels);
  }
}

// A bit for each block of the box.
inline std::uint64_t boxBits(const Box& blocks) {
  if (blocks.empty()) return 0;
  const std::uint64_t row = ((std::uint64_t{1} << (blocks.x1 - blocks.x0)) - 1) << blocks.x0;
  std::uint64_t bits = 0;
  for (int y = blocks.y0; y < blocks.y1; ++y)
    bits |= row << (block_columns * y);
  return bits;
}

// Calls f with the first pixels of the vectors of blocks, a bit each: of two blocks at a time, and of the last of an
// odd number alone.
template <class F>
HWY_INLINE void byTwoBlocks(std::uint64_t blocks, const F& f) {
  const std::size_t lanes = hn::Lanes(DF());
  const auto next = [&blocks]() HWY_ATTR {
    const auto block = static_cast<std::size_t>(std::countr_zero(blocks));
    blocks &= blocks - 1;
    return block * block_pixels;
  };
  while ((blocks & (blocks - 1)) != 0) {
    const std::size_t a = next(), b = next();
    for (std::size_t sub = 0; sub < block_pixels; sub += lanes)
      f(Two<std::size_t>{a + sub, b + sub});
  }
  if (blocks == 0) return;
  const std::size_t a = next();
  for (std::size_t sub = 0; sub < block_pixels; sub += lanes)
    f(a + sub);
}

// The same of one vector at a time.
template <class F>
HWY_INLINE void byBlocks(std::uint64_t blocks, const F& f) {
  for (; blocks != 0; blocks &= blocks - 1) {
    for (std::size_t sub = 0; sub < block_pixels; sub += hn::Lanes(DF()))
      f(static_cast<std::size_t>(std::countr_zero(blocks)) * block_pixels + sub);
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
