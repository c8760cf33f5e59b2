// One cell onto the pixels of a tile, whatever tells where rays cross it and whatever shades it. Included once per
// instruction set.

#if defined(SPILLIKIN_NATIVE_PAINT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_PAINT_INL_H
#undef SPILLIKIN_NATIVE_PAINT_INL_H
#else
#define SPILLIKIN_NATIVE_PAINT_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_crossing-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_wide-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Cell i of the batch on its blocks. Returns its fragments.
template <class Shade, class Cross>
HWY_INLINE std::size_t paintCrossed(const Cross& crossing, const TileView& view, const CellBatch& batch, std::size_t i,
                                    std::uint64_t blocks, Pixels& pixels) {
  const Shade shade(view, batch, i);
  const Certificate certificate(view);
  std::size_t fragments = 0;
  const auto paint = [&](const auto& first) HWY_ATTR {
    const auto ray = crossing(first);
    const auto inside = wide::Gt(ray.near, ray.far);
    fragments += wide::CountTrue(inside);
    shade.check(certificate, ray.near, ray.far, inside, first, pixels);
    shade.blend(ray, inside, first, pixels);
  };
  // Of a short chain of operations a core works on several at once by itself, with fewer registers.
  if constexpr (Shade::short_chain) {
    byBlocks(blocks, paint);
  } else {
    byTwoBlocks(blocks, paint);
  }
  return fragments;
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
