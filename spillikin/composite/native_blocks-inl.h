// Which blocks of a tile hold pixels that a tetrahedron covers: a bit each, so that a kernel comes to no others. A ray
// meets the cell where it crosses every face that it enters by before any that it leaves by; for each such pair that is
// one side of a line on the screen, of the edge that the two faces share where it is part of the outline. A row of
// blocks is cut by a line at one place. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_BLOCKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_BLOCKS_INL_H
#undef SPILLIKIN_NATIVE_BLOCKS_INL_H
#else
#define SPILLIKIN_NATIVE_BLOCKS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_centres.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// A vector of cells' faces, or of differences of two: nearness x X + y Y + t.
struct PlaneV {
  VF x, y, t;
};

HWY_INLINE PlaneV choose(hn::Mask<DF> which, const PlaneV& yes, const PlaneV& no) {
  return {hn::IfThenElse(which, yes.x, no.x), hn::IfThenElse(which, yes.y, no.y), hn::IfThenElse(which, yes.t, no.t)};
}

// The blocks that have pixels on one side of a line: in row r those from column at + slope r on, or up to there.
struct LineV {
  VF slope, at;
  hn::Mask<DF> from;

  // Where `entered` may lie before `left`, by the pixel of a block that is farthest on that side.
  HWY_INLINE LineV(const PlaneV& entered, const PlaneV& left) {
    const DF d;
    constexpr float block = 4.0F, middle = 2.0F;  // in pixels
    const VF size = hn::Set(d, static_cast<float>(tile_size));
    const auto terms = [&](const PlaneV& p)
                           HWY_ATTR { return hn::MulAdd(size, hn::Add(hn::Abs(p.x), hn::Abs(p.y)), hn::Abs(p.t)); };
    const VF x = hn::Sub(entered.x, left.x), y = hn::Sub(entered.y, left.y), t = hn::Sub(entered.t, left.t);
    // Of nearness, anywhere in the tile.
    const VF error = hn::MulAdd(hn::Set(d, float_rounding), hn::Add(terms(entered), terms(left)), hn::Set(d, 1e-30F));
    const VF outermost = hn::Mul(hn::Set(d, block_reach), hn::Add(hn::Abs(x), hn::Abs(y)));
    // A line that runs along the rows is tilted by as much as rounding may.
    const VF steep = hn::Max(hn::Abs(x), hn::Mul(error, hn::Set(d, 1.0F / tile_size)));
    const VF corner =
        hn::Add(hn::MulAdd(hn::Set(d, middle), hn::Add(x, y), t), hn::Add(outermost, hn::Add(error, error)));
    from = hn::Ge(x, hn::Zero(d));
    const VF per = hn::Mul(hn::Set(d, -1.0F / block), reciprocal(hn::IfThenElse(from, steep, hn::Neg(steep))));
    slope = hn::Mul(hn::Mul(y, hn::Set(d, block)), per);
    at = hn::Mul(corner, per);
  }
};

// The numbers of a table of 16, by index.
HWY_INLINE hn::Vec<hn::RebindToSigned<DF>> fromTable(const std::int32_t* table, hn::Vec<hn::RebindToSigned<DF>> index) {
  const hn::RebindToSigned<DF> di;
  if constexpr (hn::MaxLanes(DF()) == 16)
    return hn::TableLookupLanes(hn::Load(di, table), hn::IndicesFromVec(di, index));
  return hn::GatherIndex(di, table, index);
}

// The faces of cells from i on in the order in which rays cross them: those entered before those left.
struct CrossedV {
  PlaneV face[4];
  hn::Mask<DF> two, three;  // as many are entered at least
  hn::Mask<DF> none, all;   // of them are entered

  // Puts the batch's faces in that order, too.
  HWY_INLINE CrossedV(std::size_t i, CellBatch& batch) {
    const DF d;
    const hn::RebindToSigned<DF> di;
    const auto code = hn::Load(di, batch.code + i);
    const auto order = fromTable(face_order.packed, code);
    PlaneV plane[4];
    for (std::size_t k = 0; k < 4; ++k) {
      const auto load = [&](std::size_t c) HWY_ATTR { return hn::Load(d, batch.face[k][c] + i); };
      plane[k] = {load(0), load(1), load(2)};
    }
    const auto bit = [&](auto value, int at) HWY_ATTR {
      return hn::RebindMask(d, hn::Ne(hn::And(value, hn::Set(di, 1 << at)), hn::Zero(di)));
    };
    for (int k = 0; k < 4; ++k) {
      const auto odd = bit(order, 2 * k), high = bit(order, 2 * k + 1);
      face[k] = choose(high, choose(odd, plane[3], plane[2]), choose(odd, plane[1], plane[0]));
      hn::Store(face[k].x, d, batch.face[k][0] + i);
      hn::Store(face[k].y, d, batch.face[k][1] + i);
      hn::Store(face[k].t, d, batch.face[k][2] + i);
    }
    const auto entered = fromTable(face_order.entered, code);
    hn::Store(entered, di, batch.entered + i);
    const auto more = [&](int than) HWY_ATTR { return hn::RebindMask(d, hn::Gt(entered, hn::Set(di, than))); };
    none = hn::Not(more(0));
    two = more(1);
    three = more(2);
    all = more(3);
  }
};

// Sets the blocks of the cells from i on. Those that the eye's plane crosses may cover their whole box; those that no
// ray enters, but from the eye inside, or that none leaves, are degenerate and cover nothing.
HWY_INLINE void setBlockBits(std::size_t i, CellBatch& batch) {
  const DF d;
  const hn::RebindToSigned<DF> di;
  const CrossedV crossed(i, batch);
  const PlaneV* face = crossed.face;
  const auto only_two = hn::AndNot(crossed.three, crossed.two);
  // One face entered: each of the others bounds the cell with it; three: with the one that is left.
  const LineV lines[] = {
      LineV(face[0], face[3]),
      LineV(choose(crossed.three, face[2], face[0]), choose(crossed.three, face[3], face[2])),
      LineV(choose(crossed.two, face[1], face[0]), choose(crossed.two, face[3], face[1])),
      LineV(choose(only_two, face[1], face[0]), choose(only_two, face[2], face[3])),
  };
  const auto number = [&](const std::int32_t* values) HWY_ATTR { return hn::Load(di, values + i); };
  const VF x0 = hn::ConvertTo(d, number(batch.block_x0)), x1 = hn::ConvertTo(d, number(batch.block_x1));
  const auto y0 = number(batch.block_y0), y1 = number(batch.block_y1);
  const auto whole = hn::RebindMask(d, hn::Gt(number(batch.straddles), hn::Zero(di)));
  const auto nothing = hn::RebindMask(di, hn::Or(crossed.all, hn::AndNot(whole, crossed.none)));
  // Row by row of their boxes, as many as the highest has.
  auto low = hn::Zero(di), high = hn::Zero(di), row = y0;
  VF r = hn::ConvertTo(d, y0);
  const std::int32_t rows = hn::GetLane(hn::MaxOfLanes(di, hn::Sub(y1, y0)));
  for (std::int32_t k = 0; k <= rows; ++k) {
    VF from = x0, to = x1;
    for (const LineV& line : lines) {
      const VF column = hn::MulAdd(line.slope, r, line.at);
      from = hn::IfThenElse(line.from, hn::Max(from, column), from);
      to = hn::IfThenElse(line.from, to, hn::Min(to, column));
    }
    from = hn::Min(hn::Ceil(hn::IfThenElse(whole, x0, from)), hn::Set(d, static_cast<float>(block_columns)));
    to = hn::Max(hn::Floor(hn::IfThenElse(whole, x1, to)), hn::Set(d, -1.0F));
    const auto none = hn::Or(hn::RebindMask(di, hn::Gt(from, to)), hn::Gt(row, y1));
    const auto before = [&](VF column) HWY_ATTR { return hn::Shl(hn::Set(di, 1), wholeNumber(d, column)); };
    const auto bits = hn::IfThenZeroElse(none, hn::Sub(before(hn::Add(to, hn::Set(d, 1.0F))), before(from)));
    static_assert(tile_blocks == 64 && block_columns == 8);
    const auto in_half = hn::Shl(bits, hn::And(hn::ShiftLeft<3>(row), hn::Set(di, 24)));
    const auto lower = hn::Gt(hn::Set(di, block_columns / 2), row);
    low = hn::Or(low, hn::IfThenElseZero(lower, in_half));
    high = hn::Or(high, hn::IfThenZeroElse(lower, in_half));
    row = hn::Add(row, hn::Set(di, 1));
    r = hn::Add(r, hn::Set(d, 1.0F));
  }
  hn::Store(hn::IfThenZeroElse(nothing, low), di, batch.blocks[0] + i);
  hn::Store(hn::IfThenZeroElse(nothing, high), di, batch.blocks[1] + i);
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
