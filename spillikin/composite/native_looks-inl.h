// What a vector of cells shows of the transfer function. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_LOOKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_LOOKS_INL_H
#undef SPILLIKIN_NATIVE_LOOKS_INL_H
#else
#define SPILLIKIN_NATIVE_LOOKS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DIF = hn::RebindToSigned<DF>;

// The numbers of one piece of the transfer function for each lane: from two registers where they hold those of all
// pieces.
class PieceNumbers {
 public:
  HWY_INLINE PieceNumbers(const Screen& screen, hn::Vec<DIF> piece)
      : columns_(screen.pieceColumns().data()),
        stride_(screen.pieceStride()),
        few_(screen.pieces().size() <= 2 * hn::Lanes(DF())),
        piece_(piece),
        in_second_(hn::RebindMask(DF(), hn::Gt(piece, lastLane()))),
        lane_(hn::IndicesFromVec(DF(), hn::And(piece, lastLane()))) {}

  // By its offset in Piece.
  HWY_INLINE VF operator()(std::size_t offset) const {
    const DF d;
    const float* column = columns_ + offset / sizeof(float) * stride_;
    if (HWY_LIKELY(few_)) {
      return hn::IfThenElse(in_second_, hn::TableLookupLanes(hn::LoadU(d, column + hn::Lanes(d)), lane_),
                            hn::TableLookupLanes(hn::LoadU(d, column), lane_));
    }
    return hn::GatherIndex(d, column, piece_);
  }

 private:
  static HWY_INLINE hn::Vec<DIF> lastLane() { return hn::Set(DIF(), static_cast<std::int32_t>(hn::Lanes(DF())) - 1); }

  const float* columns_;
  std::size_t stride_;
  bool few_;
  hn::Vec<DIF> piece_;
  hn::Mask<DF> in_second_;
  decltype(hn::IndicesFromVec(DF(), hn::Zero(DIF()))) lane_;
};

// See native_batch.h.
HWY_INLINE VF tiltLeftOut(VF depth, VF growth) {
  const DF d;
  return hn::MulAdd(hn::Mul(depth, depth), hn::Set(d, LeftOut::depth_squared),
                    hn::Mul(growth, hn::Set(d, LeftOut::growth)));
}
HWY_INLINE VF bowLeftOut(VF depth, VF growth, VF change, VF amid) {
  const auto set = [](float v) HWY_ATTR { return hn::Set(DF(), v); };
  const VF ratio = hn::Min(hn::Div(change, hn::Max(amid, set(1e-30F))), set(2.0F));
  const VF by_ratio = hn::Mul(hn::MulAdd(set(LeftOut::depth_growth_ratio), depth, set(LeftOut::growth_ratio)), ratio);
  const VF by_growth = hn::Mul(growth, hn::MulAdd(set(LeftOut::depth_growth), depth, by_ratio));
  return hn::MulAdd(hn::Mul(hn::Mul(depth, depth), depth), set(LeftOut::depth_cubed), by_growth);
}

// Look (see native_batch.h) of the cells from i on, as if extinction were the line of their first piece.
struct Looks {
  hn::Vec<DIF> bends;      // joints of pieces within the cell's range
  hn::Mask<DIF> straight;  // extinction is one line indeed
  VF range;                // of the scalar
  VF extinction_slope;     // of the first piece
  VF at_lo, at_hi;         // extinction at both ends of the range
  VF bend;                 // of the colour's slope, all joints together
  VF steepest;             // slope of the colour

  HWY_INLINE Looks(const Screen& screen, const CellBatch& batch, std::size_t i) {
    const DF d;
    const DIF di;
    const auto first = hn::Load(di, batch.first_piece + i);
    const auto last = hn::Load(di, batch.last_piece + i);
    const VF lo = hn::Load(d, batch.lo + i), hi = hn::Load(d, batch.hi + i);
    const PieceNumbers of_first(screen, first), of_last(screen, last);
    bends = hn::Sub(last, first);
    straight = hn::Not(hn::Gt(last, hn::BitCast(di, of_first(offsetof(Piece, reach)))));
    range = hn::Sub(hi, lo);
    const VF anchor = of_first(offsetof(Piece, anchor));
    extinction_slope = of_first(offsetof(Piece, extinction_slope));
    const VF extinction = of_first(offsetof(Piece, extinction));
    at_lo = hn::MulAdd(extinction_slope, hn::Sub(lo, anchor), extinction);
    at_hi = hn::MulAdd(extinction_slope, hn::Sub(hi, anchor), extinction);
    bend = hn::Sub(of_last(offsetof(Piece, bent)), of_first(offsetof(Piece, bent)));
    steepest = hn::Add(of_first(offsetof(Piece, steepest)), bend);
  }
};

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
