// Faces seen edge-on: float does not tell the nearness on such a face, but off the line that the face is on the screen,
// no ray crosses it. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_EDGE_ON_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_EDGE_ON_INL_H
#undef SPILLIKIN_NATIVE_EDGE_ON_INL_H
#else
#define SPILLIKIN_NATIVE_EDGE_ON_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_forms-inl.h"
#include "spillikin/composite/native_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// The least and the most nearness in a cell.
struct NearnessRange {
  float lo, hi;
};

// Whether on all pixels of the blocks, a bit each, the rays pass the face certainly outside of the cell: nearnessAt(x,
// y), of pixels' centres, is then beyond the cell's by more than `lost`, all that float may have lost of it.
template <class NearnessAt>
HWY_INLINE bool passOutside(const NearnessAt& nearnessAt, std::uint64_t blocks, const NearnessRange& range,
                            float lost) {
  const DF d;
  const VF lo = hn::Set(d, range.lo - lost), hi = hn::Set(d, range.hi + lost);
  auto untold = hn::MaskFromVec(hn::Zero(d));
  byBlocks(blocks, [&](std::size_t first) HWY_ATTR {
    const VF here = nearnessAt(centresX(first), centresY(first));
    untold = hn::Or(untold, hn::And(hn::Ge(here, lo), hn::Le(here, hi)));
  });
  return hn::AllFalse(d, untold);
}

HWY_INLINE NearnessRange nearnessRange(const CellBatch& batch, std::size_t i) {
  const float half = batch.half_per_middle[i], share = half * batch.thickness[i], middle = batch.middle_nearness[i];
  if (batch.parallel) return {middle - share, middle + share};
  const float range = 2.0F * half * share;
  return {middle - range / (1.0F + share), middle + range / std::max(1.0F - share, 1e-30F)};
}

// Whether float tells of every pixel of tetrahedron i on which side of all faces seen edge-on its ray runs.
HWY_INLINE bool sidesTold(const TileView& view, const CellBatch& batch, std::size_t i) {
  const NearnessRange range = nearnessRange(batch, i);
  const float steepest = view.relative ? view.steepest * 2.0F * batch.half_per_middle[i] : view.steepest;
  return std::all_of(std::begin(batch.face), std::end(batch.face), [&](const auto& face) HWY_ATTR {
    const Form form{face[0][i], face[1][i], face[2][i]};
    const float slope = (std::abs(form.x) + std::abs(form.y)) * float{tile_size};
    if (slope <= steepest) return true;
    return passOutside([&](const VF& x, const VF& y) HWY_ATTR { return formAt(form, x, y); }, batch.blockBits(i), range,
                       float_rounding * mostTerms(form));
  });
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
