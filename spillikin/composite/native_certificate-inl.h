// The proof of the order, kept while fragments are composited. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_CERTIFICATE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_CERTIFICATE_INL_H
#undef SPILLIKIN_NATIVE_CERTIFICATE_INL_H
#else
#define SPILLIKIN_NATIVE_CERTIFICATE_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

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

// Proves the order on every pixel: a fragment that begins before where the last one ended, up to rounding, is flagged.
// One that is no longer than that rounding may be where the cell is not (the planes of a flat cell part slowly) and
// proves nothing.
class Certificate {
 public:
  explicit HWY_INLINE Certificate(const TileView& view)
      : at_(hn::Set(DF(), view.overlap_at)),
        slope_(hn::Set(DF(), 1.0F + view.overlap_slope)),
        solid_at_(hn::Set(DF(), solid_share * view.overlap_at)),
        solid_slope_(hn::Set(DF(), 1.0F + solid_share * view.overlap_slope)) {}

  HWY_INLINE void check(VF near, VF far, hn::Mask<DF> inside, std::size_t first, Pixels& pixels) const {
    const DF d;
    const VF last = hn::Load(d, pixels.last.data() + first);
    const auto solid = hn::And(inside, hn::Gt(near, hn::MulAdd(far, solid_slope_, solid_at_)));
    hn::Store(hn::IfThenElse(solid, far, last), d, pixels.last.data() + first);
    const auto early = hn::And(solid, hn::Gt(near, hn::MulAdd(last, slope_, at_)));
    if (HWY_UNLIKELY(!hn::AllFalse(d, early))) {
      pixels.flagged[first / block_pixels] |= static_cast<std::uint16_t>(maskBits(early) << (first % block_pixels));
    }
  }

 private:
  VF at_, slope_, solid_at_, solid_slope_;
};

// Marks the vectors with pixels that are wanted as those that cells need come to.
HWY_INLINE void lookAtWanted(const PixelMask& wanted, Pixels& pixels) {
  const std::size_t lanes = hn::Lanes(DF());
  const unsigned full = static_cast<unsigned>((std::uint64_t{1} << lanes) - 1);
  for (std::size_t i = 0; i < tile_pixels; i += lanes) {
    const unsigned bits = static_cast<unsigned>(wanted[i / block_pixels]) >> (i % block_pixels) & full;
    pixels.live[i] = static_cast<std::uint8_t>(bits != 0);
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
