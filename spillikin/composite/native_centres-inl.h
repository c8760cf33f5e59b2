// Vectors of pixel centres, relative to the tile. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_CENTRES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_CENTRES_INL_H
#undef SPILLIKIN_NATIVE_CENTRES_INL_H
#else
#define SPILLIKIN_NATIVE_CENTRES_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

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

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
