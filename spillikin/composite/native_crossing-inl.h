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
#include <type_traits>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_forms-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// The forms of a cell: nearness on its faces, and the scalar as it is wanted (see CellBatch::origin).
inline constexpr std::size_t the_scalar = 4, cell_forms = 5;
using CellForms = Forms<cell_forms>;

HWY_INLINE Form scalarForm(const CellBatch& batch, std::size_t i) {
  return {batch.at[0][i], batch.at[1][i], batch.origin[i]};
}

HWY_INLINE void setForms(const CellBatch& batch, std::size_t i, CellForms& forms) {
  for (std::size_t k = 0; k < the_scalar; ++k)
    forms.set(k, {batch.face[k][0][i], batch.face[k][1][i], batch.face[k][2][i]});
  forms.set(the_scalar, scalarForm(batch, i));
}

// Where the rays of one vector or two enter and leave a cell, as nearness; they meet it where near is more than far.
// And the scalar's form there.
template <class V>
struct Crossed {
  V near, far, at;
};

// The planes of one cell. `limited` is for views with clip planes and cells that the eye's plane crosses: rays are then
// kept within the pixels' ranges, and none of the faces need be entered.
class Crossing {
 public:
  HWY_INLINE Crossing(const CellForms& forms, const CellBatch& batch, std::size_t i, const Pixels& pixels, bool limited)
      : forms_(forms), pixels_(pixels), eye_(hn::Set(DF(), batch.eye_nearness)), limited_(limited) {
    const DF d;
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

  template <class At>
  HWY_INLINE auto operator()(const At& first) const {
    const auto form = [&](std::size_t k) HWY_ATTR { return forms_(k, first); };
    const auto z0 = form(0), z1 = form(1), z2 = form(2), z3 = form(3);
    using V = std::remove_const_t<decltype(z0)>;
    V near = wide::IfThenElse(two_, wide::Min(z0, z1), z0);
    near = wide::IfThenElse(three_, wide::Min(near, z2), near);
    V far = wide::IfThenElse(one_left_, wide::Max(z3, z1), z3);
    far = wide::IfThenElse(two_left_, wide::Max(far, z2), far);
    if (HWY_UNLIKELY(limited_)) {
      if (inside_) {
        near = wide::same<V>(eye_);
        far = wide::Max(far, z0);
      }
      near = wide::Min(near, wide::load(pixels_.clip_near.data(), first));
      far = wide::Max(far, wide::load(pixels_.clip_far.data(), first));
    }
    return Crossed<V>{near, far, form(the_scalar)};
  }

 private:
  FormsV<cell_forms> forms_;
  const Pixels& pixels_;
  VF eye_;
  hn::Mask<DF> two_, three_, one_left_, two_left_;  // so many faces are entered, or are left besides the last
  bool limited_, inside_ = false;
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
