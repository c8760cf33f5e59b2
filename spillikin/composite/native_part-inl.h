// What of a large tetrahedron lies in a tile: the range of its depth and of its scalar there. Smaller ranges make cells
// that a shorter series does for, and that show fewer pieces of the transfer function. The part is convex and both are
// linear in it, so that they are largest and least where an edge of the cell ends or leaves the tile, or where a ray
// through a corner of the tile enters or leaves the cell. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_PART_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_PART_INL_H
#undef SPILLIKIN_NATIVE_PART_INL_H
#else
#define SPILLIKIN_NATIVE_PART_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <limits>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_tiny-inl.h"
#include "spillikin/composite/native_vec3d-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using VH = hn::Vec<DH>;
using MH = hn::Mask<DH>;

// The boxes of a vector of cells in pixels, relative to the tile; without bounds where the eye's plane cuts them.
struct PixelBoxes {
  VH x0, x1, y0, y1;
  MH straddles;
};

// Depths of a vector of cells; in a parallel view, behind the middle depth.
struct DepthRange {
  VD lo, hi;
};

// When to look for the parts of cells in the tile: of those that reach so many pixels beyond it and have so many in it,
// where looking saves more than it takes. Both are cycles of a core, roughly: for a vector of cells; and for a pixel of
// a cell that may then do without bends or an exact series, or become a tiny one.
struct Narrowing {
  static constexpr float beyond = 8.0F, pixels = 128.0F;
  static constexpr float cost = 300.0F, saved_bends = 0.9F, saved_series = 0.12F;
};

// The cells from i on whose parts are worth looking for.
HWY_INLINE MH largeCells(const PixelBoxes& box, const DepthRange& depth, std::size_t i, const CellBatch& batch) {
  const DD d;
  const DH dh;
  const DI di;
  const auto set = [](float v) HWY_ATTR { return hn::Set(DH(), v); };
  const VH zero = hn::Zero(dh), size = set(static_cast<float>(tile_size)), far = set(Narrowing::beyond);
  const VH out =
      hn::Max(hn::Max(hn::Neg(box.x0), hn::Sub(box.x1, size)), hn::Max(hn::Neg(box.y0), hn::Sub(box.y1, size)));
  const VH pixels = hn::Mul(hn::Sub(hn::Min(box.x1, size), hn::Max(box.x0, zero)),
                            hn::Sub(hn::Min(box.y1, size), hn::Max(box.y0, zero)));
  MH large = hn::AndNot(box.straddles, hn::And(hn::Gt(out, far), hn::Gt(pixels, set(Narrowing::pixels))));
  if (HWY_LIKELY(hn::AllFalse(dh, large))) return large;
  const VD thickness = hn::Sub(depth.hi, depth.lo), twice_middle = hn::Add(hn::Abs(depth.lo), hn::Abs(depth.hi));
  const auto deeper = [&](float than) HWY_ATTR {
    if (batch.parallel) return hn::MaskFromVec(zero);  // such a view knows no share of a distance
    const VD more = hn::NegMulAdd(twice_middle, hn::Set(d, 0.5 * static_cast<double>(than)), thickness);
    return hn::Gt(hn::DemoteTo(dh, more), zero);
  };
  const auto joints = hn::Sub(hn::Load(di, batch.last_piece + i), hn::Load(di, batch.first_piece + i));
  const auto more = [&](std::int32_t than) HWY_ATTR { return hn::RebindMask(dh, hn::Gt(joints, hn::Set(di, than))); };
  large = hn::And(large, hn::Or(deeper(tiny_relative_depth), more(0)));
  const MH much = hn::Or(deeper(small_relative_depth), more(1));
  const VH saved = hn::Mul(pixels, hn::IfThenElse(much, set(Narrowing::saved_bends), set(Narrowing::saved_series)));
  const float all_saved = hn::GetLane(hn::SumOfLanes(dh, hn::IfThenElseZero(large, saved)));
  return all_saved > Narrowing::cost ? large : hn::MaskFromVec(zero);
}

// A corner of a vector of cells: its place relative to the tile's corner, in perspective times its depth; the depth (in
// a parallel view, behind the middle depth); and the scalar.
struct PartCorner {
  VH x, y, depth, value;
};

// The scalar along rays: apex + x X + y Y + z depth, in perspective apex + (x X + y Y + z) depth.
struct PartField {
  VH x, y, z, apex;
};

constexpr float no_bound = std::numeric_limits<float>::max();

// The least and the most of what has been taken.
struct Range {
  VH lo, hi;
  HWY_INLINE Range() : lo(hn::Set(DH(), no_bound)), hi(hn::Set(DH(), -no_bound)) {}
  HWY_INLINE void take(MH where, VH v) {
    lo = hn::IfThenElse(where, hn::Min(lo, v), lo);
    hi = hn::IfThenElse(where, hn::Max(hi, v), hi);
  }
};

// a / b, off by a share of less than share_rounding; so much of a cell's ranges are its part's off for that.
constexpr float share_rounding = 1e-3F;
HWY_INLINE VH quotient(VH a, VH b) {
#if HWY_ARCH_X86
  return hn::Mul(a, hn::ApproximateReciprocal(b));
#else
  return hn::Div(a, b);
#endif
}

// Depth and scalar of what lies between the pixel centres of the tile; where nothing does, lo is more than hi.
class TilePart {
 public:
  Range depth, value;

  HWY_INLINE TilePart(const TileView& view, const PartCorner (&corner)[4], bool parallel)
      : parallel_(parallel),
        z0_(hn::Set(DH(), view.z0)),
        side_{hn::Set(DH(), 0.5F), hn::Set(DH(), static_cast<float>(view.width) - 0.5F), hn::Set(DH(), 0.5F),
              hn::Set(DH(), static_cast<float>(view.height) - 0.5F)} {
    Sides sides[4];
    for (std::size_t k = 0; k < 4; ++k)
      setSides(corner[k], sides[k]);
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = a + 1; b < 4; ++b)
        takeEdge(corner[a], corner[b], sides[a], sides[b]);
    }
  }

  // The rays through the tile's corners, by the planes of the batch's cells from i on, as they were set up.
  HWY_INLINE void takeRays(const PartField& field, std::size_t i, const CellBatch& batch) {
    for (std::size_t k = 0; k < 4; ++k)
      takeRay(side_[k % 2], side_[2 + k / 2], field, i, batch);
  }

 private:
  // How far inside of each of the tile's sides a corner lies, and of which it lies outside.
  struct Sides {
    VH inside[4];
    MH beyond[4];
  };

  HWY_INLINE void setSides(const PartCorner& c, Sides& of) const {
    const VH per = parallel_ ? hn::Set(DH(), 1.0F) : c.depth;
    of.inside[0] = hn::NegMulAdd(side_[0], per, c.x);
    of.inside[1] = hn::MulSub(side_[1], per, c.x);
    of.inside[2] = hn::NegMulAdd(side_[2], per, c.y);
    of.inside[3] = hn::MulSub(side_[3], per, c.y);
    for (std::size_t s = 0; s < 4; ++s)
      of.beyond[s] = hn::Lt(of.inside[s], hn::Zero(DH()));
  }

  HWY_INLINE void takeEdge(const PartCorner& a, const PartCorner& b, const Sides& of_a, const Sides& of_b) {
    const DH d;
    // The share of the edge where the part begins, and where it ends.
    VH begin = hn::Zero(d), end = hn::Set(d, 1.0F);
    MH none = hn::MaskFromVec(begin);
    for (std::size_t s = 0; s < 4; ++s) {
      const VH at = quotient(of_a.inside[s], hn::Sub(of_a.inside[s], of_b.inside[s]));
      begin = hn::IfThenElse(of_a.beyond[s], hn::Max(begin, at), begin);
      end = hn::IfThenElse(of_b.beyond[s], hn::Min(end, at), end);
      none = hn::Or(none, hn::And(of_a.beyond[s], of_b.beyond[s]));
    }
    const MH some = hn::AndNot(none, hn::Le(begin, hn::Add(end, hn::Set(d, share_rounding))));
    const VH deeper = hn::Sub(b.depth, a.depth), higher = hn::Sub(b.value, a.value);
    for (const VH& at : {begin, end}) {
      depth.take(some, hn::MulAdd(at, deeper, a.depth));
      value.take(some, hn::MulAdd(at, higher, a.value));
    }
  }

  HWY_INLINE void takeRay(VH x, VH y, const PartField& field, std::size_t i, const CellBatch& batch) {
    const DH d;
    const DI di;
    const auto code = hn::Load(di, batch.code + i);
    VH near = hn::Set(d, no_bound), far = hn::Set(d, -no_bound);
    for (std::size_t k = 0; k < 4; ++k) {
      const auto load = [&](std::size_t c) HWY_ATTR { return hn::Load(d, batch.face[k][c] + i); };
      const VH z = hn::MulAdd(load(0), x, hn::MulAdd(load(1), y, load(2)));
      const MH left = hn::RebindMask(d, hn::Ne(hn::And(code, hn::Set(di, 1 << k)), hn::Zero(di)));
      near = hn::IfThenElse(left, near, hn::Min(near, z));
      far = hn::IfThenElse(left, hn::Max(far, z), far);
    }
    const MH some = hn::Gt(near, far);
    const VH across = hn::MulAdd(field.x, x, hn::Mul(field.y, y));
    for (const VH& z : {near, far}) {
      if (parallel_) {
        depth.take(some, hn::Neg(z));
        value.take(some, hn::NegMulAdd(field.z, z, hn::Add(field.apex, across)));
      } else {
        const VH at = hn::Div(hn::Set(d, 1.0F), hn::Add(z, z0_));
        depth.take(some, at);
        value.take(some, hn::MulAdd(hn::Add(across, field.z), at, field.apex));
      }
    }
  }

  bool parallel_;
  VH z0_;
  VH side_[4];  // of the tile: left, right, top, bottom
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
