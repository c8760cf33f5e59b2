// Which of a cut cell's pieces draws what a ray has in the cell. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_PIECE_SHARE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_PIECE_SHARE_INL_H
#undef SPILLIKIN_NATIVE_PIECE_SHARE_INL_H
#else
#define SPILLIKIN_NATIVE_PIECE_SHARE_INL_H
#endif

#include <hwy/highway.h>

#include <span>

#include "spillikin/composite/native_forms-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_thin-inl.h"
#include "spillikin/composite/native_whole.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE VF form(const WholeCell::Form& f, VF x, VF y) {
  return formAt(Form{f[0], f[1], f[2]}, x, y);
}

// Which intervals are a piece's to draw: those whose middle lies in it, whole. For the pieces of a cell that a ray runs
// through come one after the other (a plane is crossed once, and away from the viewpoint), and nothing comes between
// them on that ray: what is before the first has been drawn when the turn of any of them comes, and what is behind the
// last has not. So pieces make no more fragments than the whole cell. Where float cannot tell on which side of a plane
// a middle lies, all pieces leave the ray to those who can.
class PieceShare {
 public:
  struct Lanes {
    hn::Mask<DF> mine, unsure;
  };

  PieceShare(const TileView& view, std::span<const WholeCell::Bound> bounds)
      : bounds_(bounds), at_(hn::Set(DF(), view.overlap_at)), slope_(hn::Set(DF(), view.overlap_slope)) {}

  // Of intervals from `near` to `far`, on rays through (x, y).
  HWY_INLINE Lanes operator()(VF near, VF far, VF x, VF y) const {
    const DF d;
    const VF zero = hn::Zero(d);
    auto mine = hn::Eq(zero, zero), others = hn::Lt(zero, zero);
    if (bounds_.empty()) return {mine, others};
    const VF middle = hn::Mul(hn::Add(near, far), hn::Set(d, 0.5F));
    const VF tolerance = toleranceAt(near);
    for (const WholeCell::Bound& bound : bounds_) {
      const VF z = form(bound.nearness, x, y);
      const VF margin = hn::Add(tolerance, hn::Set(d, bound.rounding));
      const auto before = hn::Gt(middle, hn::Add(z, margin)), behind = hn::Lt(middle, hn::Sub(z, margin));
      mine = hn::And(mine, bound.entry ? behind : before);
      others = hn::Or(others, bound.entry ? before : behind);
    }
    return {mine, hn::Not(hn::Or(mine, others))};
  }

  // False for a whole cell.
  bool partial() const { return !bounds_.empty(); }

  // The certificate's, for intervals from `near` on.
  HWY_INLINE VF toleranceAt(VF near) const { return hn::MulAdd(hn::Max(near, hn::Zero(DF())), slope_, at_); }

 private:
  std::span<const WholeCell::Bound> bounds_;
  VF at_, slope_;
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
