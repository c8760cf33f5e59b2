// What walking rays see: each ray of a vector runs through a cell of its own, over pieces of the transfer function of
// its own, so that the pieces' numbers are looked up per ray. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_WALK_SHADE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_WALK_SHADE_INL_H
#undef SPILLIKIN_NATIVE_WALK_SHADE_INL_H
#else
#define SPILLIKIN_NATIVE_WALK_SHADE_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/composite/native_looks-inl.h"
#include "spillikin/composite/native_shade-inl.h"
#include "spillikin/composite/native_walk_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DI = hn::RebindToSigned<DF>;
using VI = hn::Vec<DI>;

// The numbers of one piece for each lane: from a register where there are no more pieces than lanes.
template <bool in_register>
class Lookup {
 public:
  explicit HWY_INLINE Lookup(VI piece) : piece_(piece) {}
  HWY_INLINE VF operator()(const std::vector<float>& numbers) const {
    const DF d;
    if constexpr (in_register) {
      return hn::TableLookupLanes(hn::LoadU(d, numbers.data()), hn::IndicesFromVec(d, piece_));
    } else {
      return hn::GatherIndex(d, numbers.data(), piece_);
    }
  }

 private:
  VI piece_;
};

// The pieces that scalars lie in; at a jump, the upper one.
HWY_INLINE VI pieceOf(const PieceTable& pieces, VF scalar) {
  const DI di;
  VI piece = hn::Zero(di);
  for (std::int32_t k = 0; k + 1 < pieces.count; ++k) {
    const auto beyond = hn::Ge(scalar, hn::Set(DF(), pieces.end[static_cast<std::size_t>(k)]));
    piece = hn::Add(piece, hn::IfThenElseZero(hn::RebindMask(di, beyond), hn::Set(di, 1)));
  }
  return piece;
}

// The same, from pieces that are near.
template <bool in_register>
HWY_INLINE VI pieceFrom(const PieceTable& pieces, VI piece, VF scalar) {
  const DI di;
  const VI one = hn::Set(di, 1);
  for (;;) {
    const Lookup<in_register> at(piece);
    const auto up = hn::RebindMask(di, hn::Ge(scalar, at(pieces.end)));
    const auto down = hn::RebindMask(di, hn::Lt(scalar, at(pieces.begin)));
    if (hn::AllFalse(di, hn::Or(up, down))) return piece;
    piece = hn::Add(piece, hn::IfThenElseZero(up, one));
    piece = hn::Sub(piece, hn::IfThenElseZero(down, one));
  }
}

// A step of every ray: from where to where, through which pieces.
struct Stretch {
  VF from, to;  // scalar
  VF length;    // in world units, not below 0
  VI first, last;
};

template <bool in_register>
class WalkShader {
 public:
  HWY_INLINE WalkShader(const PieceTable& pieces, const RayPacket& r) : pieces_(pieces) {
    const DF d;
    red_ = hn::Load(d, r.red);
    green_ = hn::Load(d, r.green);
    blue_ = hn::Load(d, r.blue);
    light_ = hn::Load(d, r.light);
  }

  HWY_INLINE void store(RayPacket& r) const {
    const DF d;
    hn::Store(red_, d, r.red);
    hn::Store(green_, d, r.green);
    hn::Store(blue_, d, r.blue);
    hn::Store(light_, d, r.light);
  }

  HWY_INLINE void add(const Stretch& s) {
    if (!pieces_.straight || !addStraight(s)) addAny(s);
  }

 private:
  // Extinction on one line and not so deep (see StraightShader). False, with nothing done, where some ray asks for
  // more.
  HWY_INLINE bool addStraight(const Stretch& s) {
    const DF d;
    const VF zero = hn::Zero(d), a_half = hn::Set(d, 0.5F);
    const VF mean = hn::Mul(hn::Add(s.from, s.to), a_half), half = hn::Mul(hn::Sub(s.to, s.from), a_half);
    const VF slope = hn::Set(d, pieces_.extinction_slope[0]);
    const VF extinction =
        hn::MulAdd(slope, hn::Sub(mean, hn::Set(d, pieces_.anchor[0])), hn::Set(d, pieces_.extinction[0]));
    const VF depth = hn::Mul(s.length, extinction);
    const VF growth = hn::Mul(hn::Mul(s.length, hn::Add(slope, slope)), half);
    const VF most = hn::Max(hn::MulAdd(hn::Abs(growth), a_half, depth), hn::Abs(growth));
    VF alpha, skew;
    static_assert(thin_depth == thin_growth);
    const bool thin = hn::AllTrue(d, hn::Lt(most, hn::Set(d, thin_depth)));
    if (thin) {
      alpha = ShortSeries::alpha(depth);
      skew = ShortSeries::skew(depth, depth, growth, zero);
    } else {
      if (!hn::AllTrue(d, hn::Lt(most, hn::Set(d, deep_depth)))) return false;
      alpha = ForwardSeries::alpha(depth);
      skew = ForwardSeries::skew(depth, depth, growth, zero);
    }
    const VI low = hn::Min(s.first, s.last), high = hn::Max(s.first, s.last);
    const Bends bends = bendsOf(low, high, half, thin);
    if (bends == Bends::many && !fewBends(low, high, half, extinction, depth, growth)) return false;

    const VF a = hn::Mul(light_, alpha), tilt = hn::Mul(light_, hn::Mul(half, skew));
    light_ = hn::Sub(light_, a);
    const Lookup<in_register> at(low);
    addLine(at, a, hn::MulAdd(hn::Sub(mean, at(pieces_.anchor)), a, tilt));
    if (bends == Bends::none) return true;
    const Segment segment{mean, half, s.length};
    if (bends == Bends::one) {
      addBend<false>(at, hn::Lt(low, high), Ramps<VF>(segment, a, tilt));
    } else {
      addBends(low, high, Ramps<VF>(segment, a, tilt, depth, growth));
    }
    return true;
  }

  // What of bends a vector's fragments have: at most one each, and so little of it that the light's bow is not asked
  // for; no more of them than the light's bow is good for; or so many that a closer look is wanted.
  enum class Bends : std::uint8_t { none, one, few, many };
  HWY_INLINE Bends bendsOf(VI low, VI high, VF half, bool thin) const {
    const DF d;
    const DI di;
    if (hn::AllFalse(di, hn::Lt(low, high))) return Bends::none;
    const VF size = hn::Abs(half);
    const auto all = [&](float limit) HWY_ATTR { return hn::AllTrue(d, hn::Le(size, hn::Set(d, limit))); };
    if (!thin || !all(pieces_.few_bends_half)) return Bends::many;
    const bool once = hn::AllFalse(di, hn::Lt(hn::Add(low, hn::Set(di, 1)), high));
    return once && all(pieces_.one_bend_half) ? Bends::one : Bends::few;
  }

  // Whether bends may be weighted with the mean, the tilt and the bow of the light (see Look).
  HWY_INLINE bool fewBends(VI low, VI high, VF half, VF amid, VF depth, VF growth) const {
    const DF d;
    const Lookup<in_register> at_low(low), at_high(high);
    const VF change = hn::Abs(hn::Add(half, half));
    const VF bend = hn::Mul(change, hn::Sub(at_high(pieces_.bent), at_low(pieces_.bent)));
    const VF slope = hn::Mul(hn::Abs(hn::Set(d, pieces_.extinction_slope[0])), change);
    const VF left_out = hn::Mul(bend, bowLeftOut(depth, hn::Abs(growth), slope, amid));
    return hn::AllTrue(d, hn::And(hn::Le(bend, hn::Set(d, most_bend)), hn::Le(left_out, hn::Set(d, bend_left_out))));
  }

  HWY_INLINE void addLine(const Lookup<in_register>& at, VF a, VF tint) {
    red_ = hn::MulAdd(at(pieces_.color[0]), a, hn::MulAdd(at(pieces_.color_slope[0]), tint, red_));
    green_ = hn::MulAdd(at(pieces_.color[1]), a, hn::MulAdd(at(pieces_.color_slope[1]), tint, green_));
    blue_ = hn::MulAdd(at(pieces_.color[2]), a, hn::MulAdd(at(pieces_.color_slope[2]), tint, blue_));
  }

  // The joint behind each piece, of the rays that reach beyond it.
  template <bool bowed>
  HWY_INLINE void addBend(const Lookup<in_register>& at, hn::Mask<DI> bent, const Ramps<VF>& ramps) {
    const VF weight = hn::IfThenElseZero(hn::RebindMask(DF(), bent), ramps.template weight<bowed>(at(pieces_.end)));
    red_ = hn::MulAdd(at(pieces_.kink[0]), weight, red_);
    green_ = hn::MulAdd(at(pieces_.kink[1]), weight, green_);
    blue_ = hn::MulAdd(at(pieces_.kink[2]), weight, blue_);
  }

  // The joints between pieces `low` and `high` of each ray, from the lowest on.
  HWY_INLINE void addBends(VI low, VI high, const Ramps<VF>& ramps) {
    const DI di;
    for (auto bent = hn::Lt(low, high); !hn::AllFalse(di, bent); bent = hn::Lt(low, high)) {
      addBend<true>(Lookup<in_register>(low), bent, ramps);
      low = hn::Add(low, hn::IfThenElseZero(bent, hn::Set(di, 1)));
    }
  }

  // Anything: piece by piece along the ray, each at any depth.
  HWY_INLINE void addAny(const Stretch& s) {
    const DF d;
    const DI di;
    const VF one = hn::Set(d, 1.0F);
    const VF whole = hn::Sub(s.to, s.from);
    // On a scale of [0, 1]; of less than this the inverse would have no end.
    const auto flat = hn::Lt(hn::Abs(whole), hn::Set(d, 1e-30F));
    const VF per_whole = hn::Div(one, hn::IfThenElse(flat, one, whole));
    VF from = s.from;
    VI piece = s.first;
    auto todo = hn::Eq(piece, piece);
    while (!hn::AllFalse(di, todo)) {
      const Lookup<in_register> at(piece);
      const auto last = hn::Eq(piece, s.last), up = hn::Lt(piece, s.last);
      const VF border = hn::IfThenElse(hn::RebindMask(d, up), at(pieces_.end), at(pieces_.begin));
      const VF to = hn::IfThenElse(hn::RebindMask(d, last), s.to, border);
      const VF part = hn::Sub(to, from);
      const VF share = hn::IfThenElse(flat, hn::IfThenElseZero(hn::RebindMask(d, last), one),
                                      hn::Max(hn::Mul(part, per_whole), hn::Zero(d)));
      const VF length = hn::IfThenElseZero(hn::RebindMask(d, todo), hn::Mul(share, s.length));
      const Glow<VF> glow = anyDepth(hn::Sub(from, at(pieces_.anchor)), part, length, at(pieces_.extinction),
                                     at(pieces_.extinction_slope));
      const VF a = hn::Mul(light_, glow.alpha);
      addLine(at, a, hn::Mul(light_, glow.tint));
      light_ = hn::Sub(light_, a);
      from = to;
      todo = hn::AndNot(last, todo);
      const VI on = hn::IfThenElse(up, hn::Set(di, 1), hn::Set(di, -1));
      piece = hn::Add(piece, hn::IfThenElseZero(todo, on));
    }
  }

  const PieceTable& pieces_;
  VF red_, green_, blue_, light_;
};

// Takes what lies outside of the clip planes' limits off the steps of a path: they end at the limit, where the scalar
// is what it is there.
HWY_INLINE void clipPath(const RayPacket& r, std::size_t steps, bool of_cells, RayPath& path) {
  const DF d;
  const VF near = hn::Load(d, r.clip_near), far = hn::Load(d, r.clip_far);
  VF depth = hn::Load(d, path.depth[0]), scalar = hn::Load(d, path.scalar[0]);
  const auto setPlace = [&](std::size_t n, VF at, VF value) HWY_ATTR {
    hn::Store(at, d, path.depth[n]);
    if (!of_cells) hn::Store(value, d, path.scalar[n]);
  };
  for (std::size_t n = 1; n <= steps; ++n) {
    const VF next_depth = hn::Load(d, path.depth[n]), next_scalar = hn::Load(d, path.scalar[n]);
    const VF length = hn::Sub(next_depth, depth);
    const VF per_length = hn::Div(hn::Sub(next_scalar, scalar), hn::Max(length, hn::Set(d, 1e-30F)));
    const auto valueAt = [&](VF limit) HWY_ATTR { return hn::MulAdd(hn::Sub(limit, depth), per_length, scalar); };
    // The place before has been kept within the limits as the end of its own step; now as the beginning of this one.
    const auto enters = hn::And(hn::Lt(depth, near), hn::Gt(next_depth, near));
    const VF begin = hn::Load(d, path.depth[n - 1]), begin_scalar = hn::Load(d, path.scalar[n - 1]);
    setPlace(n - 1, hn::Clamp(begin, near, hn::Max(near, far)), hn::IfThenElse(enters, valueAt(near), begin_scalar));
    const auto leaves = hn::And(hn::Gt(next_depth, far), hn::Lt(depth, far));
    setPlace(n, hn::Clamp(next_depth, near, hn::Max(near, far)), hn::IfThenElse(leaves, valueAt(far), next_scalar));
    depth = next_depth;
    scalar = next_scalar;
  }
}

// Where rays lose depth to hidden cells or to rounding, nothing is added.
HWY_INLINE VF shownAdvance(const WalkFrame& frame, const RayPath& path, std::size_t n, VF advance) {
  const DF d;
  const VF forward = hn::Max(advance, hn::Zero(d));
  if (frame.hidden == nullptr) return forward;
  return hn::IfThenZeroElse(hn::LoadMaskBits(d, path.hidden[n]), forward);
}

template <bool in_register>
HWY_INLINE void shadePath(const WalkFrame& frame, const RayPath& path, std::size_t steps, RayPacket& r) {
  const DF d;
  const PieceTable& pieces = *frame.pieces;
  WalkShader<in_register> shader(pieces, r);
  const bool of_cells = frame.cell_values != nullptr;
  const VF unit = hn::Load(d, r.length);
  VF depth = hn::Load(d, path.depth[0]), least = hn::Load(d, r.advance);
  VF scalar = hn::Load(d, path.scalar[0]);
  VI piece = pieceFrom<in_register>(pieces, hn::Load(DI(), r.piece), scalar);
  for (std::size_t n = 1; n <= steps; ++n) {
    const VF next_depth = hn::Load(d, path.depth[n]), next_scalar = hn::Load(d, path.scalar[n]);
    const VF advance = hn::Sub(next_depth, depth);
    least = hn::Min(least, advance);
    const VI next_piece = pieceFrom<in_register>(pieces, piece, next_scalar);
    if (of_cells) {
      scalar = next_scalar;
      piece = next_piece;
    }
    shader.add({scalar, next_scalar, hn::Mul(shownAdvance(frame, path, n, advance), unit), piece, next_piece});
    depth = next_depth;
    scalar = next_scalar;
    piece = next_piece;
  }
  shader.store(r);
  hn::Store(least, d, r.advance);
  hn::Store(piece, DI(), r.piece);
}

// The largest scalar, gathered as red where rays meet cells; light says where they do.
HWY_INLINE void findPeaks(const WalkFrame& frame, const RayPath& path, std::size_t steps, RayPacket& r) {
  const DF d;
  const bool of_cells = frame.cell_values != nullptr;
  VF depth = hn::Load(d, path.depth[0]), scalar = hn::Load(d, path.scalar[0]), least = hn::Load(d, r.advance);
  VF peak = hn::Load(d, r.red), light = hn::Load(d, r.light);
  for (std::size_t n = 1; n <= steps; ++n) {
    const VF next_depth = hn::Load(d, path.depth[n]), next_scalar = hn::Load(d, path.scalar[n]);
    const VF advance = hn::Sub(next_depth, depth);
    least = hn::Min(least, advance);
    const auto some = hn::Gt(shownAdvance(frame, path, n, advance), hn::Zero(d));
    const VF larger = of_cells ? next_scalar : hn::Max(scalar, next_scalar);
    peak = hn::IfThenElse(some, hn::Max(peak, larger), peak);
    light = hn::IfThenZeroElse(some, light);
    depth = next_depth;
    scalar = next_scalar;
  }
  hn::Store(peak, d, r.red);
  hn::Store(light, d, r.light);
  hn::Store(least, d, r.advance);
}

// Composites what the rays of a packet saw on their last steps.
HWY_NOINLINE void shade(const WalkFrame& frame, RayPath& path, std::size_t steps, RayPacket& r) {
  if (frame.clipped) clipPath(r, steps, frame.cell_values != nullptr, path);
  if (frame.peaks) {
    findPeaks(frame, path, steps, r);
  } else if (static_cast<std::size_t>(frame.pieces->count) <= hn::Lanes(DF())) {
    shadePath<true>(frame, path, steps, r);
  } else {
    shadePath<false>(frame, path, steps, r);
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
