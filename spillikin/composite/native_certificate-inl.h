// The proof of the order, kept while fragments are composited. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_CERTIFICATE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_CERTIFICATE_INL_H
#undef SPILLIKIN_NATIVE_CERTIFICATE_INL_H
#else
#define SPILLIKIN_NATIVE_CERTIFICATE_INL_H
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE unsigned maskBits(hn::Mask<DF> mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(DF(), mask, bits);
  return static_cast<unsigned>(bits[0]) | static_cast<unsigned>(bits[1]) << 8U;
}

// Appends the pixels of the lanes, a bit each, of the vector at `first`: few if any.
HWY_INLINE void listPixels(unsigned lanes, std::size_t first, std::vector<std::uint16_t>& out) {
  for (; HWY_UNLIKELY(lanes != 0); lanes &= lanes - 1)
    out.push_back(static_cast<std::uint16_t>(first + static_cast<unsigned>(std::countr_zero(lanes))));
}

// Proves the order on every pixel: a fragment that begins before where the last one ended, up to rounding, is flagged.
// One that is no longer than that rounding may be where the cell is not (the planes of a flat cell part slowly) and
// proves nothing.
class Certificate {
 public:
  explicit HWY_INLINE Certificate(const TileView& view)
      : at_(hn::Set(DF(), view.overlap_at)),
        slope_(hn::Set(DF(), view.early_slope)),
        solid_at_(hn::Set(DF(), view.solid_at)),
        solid_slope_(hn::Set(DF(), view.solid_slope)) {}

  template <class V, class M, class At>
  HWY_INLINE void check(const V& near, const V& far, const M& inside, const At& first, Pixels& pixels) const {
    checkSolid(near, far, wide::And(inside, wide::Gt(near, wide::MulAdd(far, solid_slope_, solid_at_))), first, pixels);
  }

  // The same, where it is known which fragments are long enough to prove anything.
  template <class V, class M, class At>
  HWY_INLINE void checkSolid(const V& near, const V& far, const M& solid, const At& first, Pixels& pixels) const {
    const V last = wide::load(pixels.last.data(), first);
    wide::store(wide::IfThenElse(solid, far, last), pixels.last.data(), first);
    const auto early = wide::And(solid, wide::Gt(near, wide::MulAdd(last, slope_, at_)));
    if (HWY_UNLIKELY(!wide::AllFalse(early))) flag(early, first, pixels);
  }

 private:
  template <class M, class At>
  HWY_INLINE static void flag(const M& early, const At& first, Pixels& pixels) {
    if constexpr (wide::is_two<At>) {
      flag(early.a, first.a, pixels);
      flag(early.b, first.b, pixels);
    } else {
      pixels.flagged[first / block_pixels] |= static_cast<std::uint16_t>(maskBits(early) << (first % block_pixels));
    }
  }

  VF at_, slope_, solid_at_, solid_slope_;
};

// Marks the blocks with pixels that are wanted as those that cells need come to.
inline void lookAtWanted(const PixelMask& wanted, Pixels& pixels) {
  pixels.live = 0;
  for (std::size_t block = 0; block < tile_blocks; ++block)
    pixels.live |= std::uint64_t{wanted[block] != 0} << block;
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
