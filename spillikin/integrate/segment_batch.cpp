#include "spillikin/integrate/segment_batch.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/integrate/segment_batch.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spillikin/integrate/segment_simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::integrate {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void WeightsOfMany(const float* x, const float* y, std::size_t count, float* front, float* back, float* alpha) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto w = weights(d, hn::LoadU(d, x + i), hn::LoadU(d, y + i));
    hn::StoreU(w.front, d, front + i);
    hn::StoreU(w.back, d, back + i);
    hn::StoreU(w.alpha, d, alpha + i);
  }
  const hn::CappedTag<float, 1> one;
  for (; i < count; ++i) {
    const auto w = weights(one, hn::LoadU(one, x + i), hn::LoadU(one, y + i));
    hn::StoreU(w.front, one, front + i);
    hn::StoreU(w.back, one, back + i);
    hn::StoreU(w.alpha, one, alpha + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::integrate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::integrate {

HWY_EXPORT(WeightsOfMany);

void weights(std::span<const float> x, std::span<const float> y, std::span<float> front, std::span<float> back,
             std::span<float> alpha) {
  HWY_DYNAMIC_DISPATCH(WeightsOfMany)(x.data(), y.data(), x.size(), front.data(), back.data(), alpha.data());
}

}  // namespace spillikin::integrate
#endif
