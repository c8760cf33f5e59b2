// Where rays cross a tetrahedron: behind all faces that they enter by, before all that they leave by. Included once per
// instruction set.

#if defined(SPILLIKIN_NATIVE_CROSSING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_CROSSING_INL_H
#undef SPILLIKIN_NATIVE_CROSSING_INL_H
#else
#define SPILLIKIN_NATIVE_CROSSING_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_centres-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// The planes of one cell. `limited` is for views with clip planes and cells that the eye's plane crosses: rays are then
// kept within the pixels' ranges, and none of the faces need be entered.
class Crossing {
 public:
  HWY_INLINE Crossing(const CellBatch& batch, std::size_t i, bool limited)
      : eye_(hn::Set(DF(), batch.eye_nearness)), limited_(limited) {
    const DF d;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& face = batch.face[k];
      x_[k] = hn::Set(d, face[0][i]);
      y_[k] = hn::Set(d, face[1][i]);
      t_[k] = hn::Set(d, face[2][i]);
    }
    const auto more = [&](std::int32_t than) HWY_ATTR {
      const hn::RebindToSigned<DF> di;
      return hn::RebindMask(d, hn::Gt(hn::Set(di, batch.entered[i]), hn::Set(di, than)));
    };
    two_ = more(1);
    three_ = more(2);
    one_left_ = hn::Not(two_);
    two_left_ = hn::Not(three_);
    inside_ = batch.entered[i] == 0;
  }

  // Nearness where the rays of the vectors at `first`, through (x, y), enter and leave; they meet the cell where near
  // is more than far.
  template <class V, class At>
  HWY_INLINE void operator()(const V& x, const V& y, const At& first, const Pixels& pixels, V& near, V& far) const {
    const auto plane = [&](std::size_t k) HWY_ATTR { return wide::MulAdd(x_[k], x, wide::MulAdd(y_[k], y, t_[k])); };
    const V z0 = plane(0), z1 = plane(1), z2 = plane(2), z3 = plane(3);
    near = wide::IfThenElse(two_, wide::Min(z0, z1), z0);
    near = wide::IfThenElse(three_, wide::Min(near, z2), near);
    far = wide::IfThenElse(one_left_, wide::Max(z3, z1), z3);
    far = wide::IfThenElse(two_left_, wide::Max(far, z2), far);
    if (HWY_UNLIKELY(limited_)) {
      if (inside_) {
        near = wide::same<V>(eye_);
        far = wide::Max(far, z0);
      }
      near = wide::Min(near, wide::load(pixels.clip_near.data(), first));
      far = wide::Max(far, wide::load(pixels.clip_far.data(), first));
    }
  }

 private:
  VF x_[4], y_[4], t_[4], eye_;
  hn::Mask<DF> two_, three_, one_left_, two_left_;  // so many faces are entered, or are left besides the last
  bool limited_, inside_ = false;
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
