// psi_float.h on Highway vectors. Include it in a file that Highway compiles once per instruction set (after
// <hwy/foreach_target.h>), between no namespaces:
//   const auto w = integrate::HWY_NAMESPACE::weights(d, x, y);  // w.front, w.back, w.alpha: vectors of D
#if defined(SPILLIKIN_SEGMENT_SIMD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_SEGMENT_SIMD_INL_H_
#undef SPILLIKIN_SEGMENT_SIMD_INL_H_
#else
#define SPILLIKIN_SEGMENT_SIMD_INL_H_
#endif

#include <hwy/highway.h>

#include "spillikin/integrate/psi_float.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::integrate {
namespace HWY_NAMESPACE {

namespace psi {

using namespace integrate::psi;  // the tables

#include "spillikin/integrate/psi_formulas-inl.h"

}  // namespace psi

template <class D>
struct VectorOps {
  using V = hwy::HWY_NAMESPACE::Vec<D>;
  using M = hwy::HWY_NAMESPACE::Mask<D>;
  HWY_INLINE V set(float a) const { return hwy::HWY_NAMESPACE::Set(D(), a); }
  HWY_INLINE V add(V a, V b) const { return hwy::HWY_NAMESPACE::Add(a, b); }
  HWY_INLINE V sub(V a, V b) const { return hwy::HWY_NAMESPACE::Sub(a, b); }
  HWY_INLINE V mul(V a, V b) const { return hwy::HWY_NAMESPACE::Mul(a, b); }
  HWY_INLINE V mulAdd(V a, V b, V c) const { return hwy::HWY_NAMESPACE::MulAdd(a, b, c); }
  // To a few units in the last place; a full division takes four times as long there.
  HWY_INLINE V reciprocal(V a) const {
    namespace hn = hwy::HWY_NAMESPACE;
#if HWY_ARCH_X86
    const V r = hn::ApproximateReciprocal(a);
    return hn::MulAdd(r, hn::NegMulAdd(a, r, hn::Set(D(), 1.0F)), r);
#else
    return hn::Div(hn::Set(D(), 1.0F), a);
#endif
  }
  HWY_INLINE V sqrt(V a) const {
    return hwy::HWY_NAMESPACE::Sqrt(a);
  }
  HWY_INLINE V abs(V a) const {
    return hwy::HWY_NAMESPACE::Abs(a);
  }
  HWY_INLINE V min(V a, V b) const {
    return hwy::HWY_NAMESPACE::Min(a, b);
  }
  HWY_INLINE V round(V a) const {
    return hwy::HWY_NAMESPACE::Round(a);
  }
  HWY_INLINE V exp2i(V whole) const {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::RebindToSigned<D> di;
    return hn::BitCast(D(), hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, whole), hn::Set(di, 127))));
  }
  HWY_INLINE M less(V a, V b) const {
    return hwy::HWY_NAMESPACE::Lt(a, b);
  }
  HWY_INLINE bool all(M m) const {
    return hwy::HWY_NAMESPACE::AllTrue(D(), m);
  }
  HWY_INLINE V select(M m, V yes, V no) const {
    return hwy::HWY_NAMESPACE::IfThenElse(m, yes, no);
  }
};

template <class D, class V = hwy::HWY_NAMESPACE::Vec<D>>
HWY_INLINE integrate::psi::Weights<V> weights(D, V x, V y) {
  return psi::weights(VectorOps<D>(), x, y);
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::integrate
HWY_AFTER_NAMESPACE();

#endif
