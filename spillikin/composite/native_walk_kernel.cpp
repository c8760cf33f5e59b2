#include "spillikin/composite/native_walk_kernel.h"

#include <algorithm>
#include <bit>
#include <limits>

// Once for each instruction set; the best that the machine has is taken at run time.
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/composite/native_walk_kernel.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spillikin/composite/native_walk_shade-inl.h"

#ifndef SPILLIKIN_NATIVE_RANK_TABLE
#define SPILLIKIN_NATIVE_RANK_TABLE
namespace spillikin::composite::native {

// What becomes of corners' ranks on the way through a cell. The three corners of the face that it is entered by have an
// order among themselves, one of six; with the rank of the corner ahead, below 4, that is a row, 4 * order + rank. Its
// five bits from 5 j on say what follows when the corner ahead takes the place of corner j: in the lower two the rank
// that corner j has in the cell, above them the order of the three that are left.
struct RankTable {
  static constexpr std::size_t rows = 32;
  static constexpr int bits = 5;
  alignas(64) std::int32_t row[rows] = {};
  alignas(64) std::int32_t order[rows] = {};  // by 3 * place of corner 0 + place of corner 1
  constexpr RankTable() {
    constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    for (int o = 0; o < 6; ++o)
      order[3 * orders[o][0] + orders[o][1]] = o;
    for (int o = 0; o < 6; ++o) {
      for (int ahead = 0; ahead < 4; ++ahead) {
        for (int j = 0; j < 3; ++j) {
          const auto rank = [&](int i) { return orders[o][i] + (orders[o][i] >= ahead ? 1 : 0); };
          const int gone = rank(j);
          const auto place = [&](int i) {
            const int r = i == j ? ahead : rank(i);
            return r - (r > gone ? 1 : 0);
          };
          row[4 * o + ahead] |= (gone | order[3 * place(0) + place(1)] << 2) << (bits * j);
        }
      }
    }
  }
};
inline constexpr RankTable rank_table;

// Pixels in a block, from its first.
struct InBlock {
  alignas(64) std::int32_t x[block_pixels] = {};
  alignas(64) std::int32_t y[block_pixels] = {};
  constexpr InBlock() {
    for (int i = 0; i < block_pixels; ++i) {
      x[i] = i % 4;
      y[i] = i / 4;
    }
  }
};
inline constexpr InBlock in_block;

}  // namespace spillikin::composite::native
#endif

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Below every edge function that is not 0 of a face that anything could be seen through.
constexpr float least_weight = std::numeric_limits<float>::min();

struct Corner {
  VI x, y;
  VF depth, value;
};

// Where numbers are below 0; of 0 it may be either.
HWY_INLINE hn::Mask<DF> isNegative(VF v) {
#if HWY_MAX_BYTES >= 64
  return hn::MaskFromVec(v);  // of each sign bit, there alone
#else
  return hn::Lt(v, hn::Zero(DF()));
#endif
}

#if HWY_MAX_BYTES >= 64
using D64 = hn::Repartition<std::uint64_t, DF>;

// Highway's gather takes indices as wide as the numbers; to widen them first would make a step a tenth slower.
HWY_INLINE hn::Vec<D64> gatherHalf(const std::uint64_t* pairs, hn::Vec<hn::Half<DI>> index) {
#if HWY_ARCH_X86
  return hn::Vec<D64>{_mm512_mask_i32gather_epi64(_mm512_setzero_si512(), 0xff, index.raw, pairs, sizeof(*pairs))};
#else
  return hn::GatherIndex(D64(), pairs, hn::PromoteTo(hn::RebindToSigned<D64>(), index));
#endif
}

// Pairs of 32-bit numbers from an array of them, half as many loads as one by one: the first and the second numbers.
HWY_INLINE void gatherPairs(const std::uint64_t* pairs, VI index, VF& first, VF& second) {
  const DF d;
  const hn::Half<DI> half;
  const auto low = gatherHalf(pairs, hn::LowerHalf(half, index));
  const auto high = gatherHalf(pairs, hn::UpperHalf(half, index));
  first = hn::ConcatEven(d, hn::BitCast(d, high), hn::BitCast(d, low));
  second = hn::ConcatOdd(d, hn::BitCast(d, high), hn::BitCast(d, low));
}

HWY_INLINE Corner gatherCorner(const WalkPoint* points, VI id) {
  static_assert(sizeof(WalkPoint) == 2 * sizeof(std::uint64_t));
  const auto* pairs = reinterpret_cast<const std::uint64_t*>(points);
  const VI index = hn::ShiftLeft<1>(id);
  const DI di;
  Corner c;
  VF x, y;
  gatherPairs(pairs, index, x, y);
  gatherPairs(pairs + 1, index, c.depth, c.value);
  c.x = hn::BitCast(di, x);
  c.y = hn::BitCast(di, y);
  return c;
}

HWY_INLINE void gatherLink(const Link* links, VI at, VI& way, VI& ahead) {
  static_assert(sizeof(Link) == sizeof(std::uint64_t));
  VF first, second;
  gatherPairs(reinterpret_cast<const std::uint64_t*>(links), at, first, second);
  way = hn::BitCast(DI(), first);
  ahead = hn::BitCast(DI(), second);
}

HWY_INLINE VI rankRow(VI ranks) {
  const DI di;
  const auto index = hn::IndicesFromVec(di, hn::And(ranks, hn::Set(di, 15)));
  const auto upper = hn::Gt(ranks, hn::Set(di, 15));
  return hn::IfThenElse(upper, hn::TableLookupLanes(hn::Load(di, rank_table.row + 16), index),
                        hn::TableLookupLanes(hn::Load(di, rank_table.row), index));
}
#else
HWY_INLINE Corner gatherCorner(const WalkPoint* points, VI id) {
  const DF d;
  const DI di;
  const VI index = hn::ShiftLeft<2>(id);
  return {hn::GatherIndex(di, &points->x, index), hn::GatherIndex(di, &points->y, index),
          hn::GatherIndex(d, &points->depth, index), hn::GatherIndex(d, &points->value, index)};
}

HWY_INLINE void gatherLink(const Link* links, VI at, VI& way, VI& ahead) {
  const DI di;
  const auto* numbers = reinterpret_cast<const std::int32_t*>(links);
  const VI index = hn::ShiftLeft<1>(at);
  way = hn::GatherIndex(di, numbers, index);
  ahead = hn::GatherIndex(di, numbers + 1, index);
}

HWY_INLINE VI rankRow(VI ranks) {
  return hn::GatherIndex(DI(), rank_table.row, ranks);
}
#endif

// A corner's place as a ray sees it.
HWY_INLINE VF seen(VI place, VI ray) {
  return hn::ConvertTo(DF(), hn::Sub(place, ray));
}

// The two products are rounded alike from both sides of the edge.
HWY_INLINE VF edgeFunction(VF u0, VF v0, VF u1, VF v1) {
  return hn::Sub(hn::Mul(u0, v1), hn::Mul(v0, u1));
}

// Depth and scalar where rays cross the face whose corners a packet holds. In perspective it is the inverse of depth
// that is linear on the screen.
template <bool Parallel>
HWY_INLINE void crossing(const VF (&edge)[3], const VF (&depth)[3], const VF (&value)[3], VF& at, VF& scalar) {
  const VF weight[3] = {Parallel ? edge[0] : hn::Mul(edge[0], depth[0]),
                        Parallel ? edge[1] : hn::Mul(edge[1], depth[1]),
                        Parallel ? edge[2] : hn::Mul(edge[2], depth[2])};
  const auto sum = [](const VF(&of)[3]) HWY_ATTR { return hn::Add(hn::Add(of[0], of[1]), of[2]); };
  const auto weighted = [&](const VF(&of)[3]) HWY_ATTR {
    return hn::MulAdd(weight[0], of[0], hn::MulAdd(weight[1], of[1], hn::Mul(weight[2], of[2])));
  };
  const VF per_sum = reciprocal(hn::Max(sum(weight), hn::Set(DF(), least_weight)));
  at = hn::Mul(Parallel ? weighted(depth) : sum(edge), per_sum);
  scalar = hn::Mul(weighted(value), per_sum);
}

// Rounding must not take a scalar across a jump that lies at the corners' own value.
HWY_INLINE VF withinCorners(VF scalar, const VF (&value)[3]) {
  return hn::Clamp(scalar, hn::Min(hn::Min(value[0], value[1]), value[2]),
                   hn::Max(hn::Max(value[0], value[1]), value[2]));
}

HWY_INLINE void storeThree(const VF (&from)[3], RayPacket::PerRay<float> (&to)[3]) {
  for (std::size_t k = 0; k < 3; ++k)
    hn::Store(from[k], DF(), to[k]);
}

// Where a ray that crosses a face does so on its edge, to the last digit. (No product overflows before a 0 comes in.)
HWY_INLINE hn::Mask<DF> onEdge(const VF (&edge)[3]) {
  return hn::Eq(hn::Mul(hn::Mul(edge[0], edge[1]), edge[2]), hn::Zero(DF()));
}

HWY_INLINE VI cellOf(VI way) {
  return hn::BitCast(DI(), hn::ShiftRight<2>(hn::BitCast(hn::RebindToUnsigned<DI>(), way)));
}

HWY_INLINE void markHidden(const WalkFrame& frame, const RayPacket& r, std::uint8_t* bits) {
  const DI di;
  const VI hidden = hn::GatherIndex(di, frame.hidden, cellOf(hn::Load(di, r.way)));
  hn::StoreMaskBits(di, hn::Ne(hidden, hn::Zero(di)), bits);
}

// What the next step reads is on its way while other packets take theirs: of some rays, their neighbours' cells being
// mostly the same.
HWY_INLINE void fetchLinks(const WalkFrame& frame, const RayPacket& r) {
  for (std::size_t i = 0; i < hn::Lanes(DI()); i += 5)
    hwy::Prefetch(frame.links + (static_cast<std::uint32_t>(r.way[i]) & ~3U));
}

// The corner ahead of each ray, as the ray sees it.
struct Ahead {
  Corner corner;
  VF u, v;
  VF edge[3];             // its edge functions with the three corners of the face behind
  hn::Mask<DF> place[3];  // the corner whose place it takes: where the signs of the other two turn; none if they do not
};

HWY_INLINE Ahead lookAhead(const WalkFrame& frame, const RayPacket& r) {
  const DF d;
  const DI di;
  Ahead q;
  q.corner = gatherCorner(frame.points, hn::Load(di, r.ahead));
  q.u = seen(q.corner.x, hn::Load(di, r.x));
  q.v = seen(q.corner.y, hn::Load(di, r.y));
  for (std::size_t k = 0; k < 3; ++k)
    q.edge[k] = edgeFunction(hn::Load(d, r.u[k]), hn::Load(d, r.v[k]), q.u, q.v);
  const auto n0 = isNegative(q.edge[0]), n1 = isNegative(q.edge[1]), n2 = isNegative(q.edge[2]);
  q.place[0] = hn::AndNot(n2, n1);
  q.place[1] = hn::AndNot(n0, n2);
  q.place[2] = hn::AndNot(n1, n0);
  return q;
}

// The row of the rank table shifted to what follows.
HWY_INLINE VI ranksAfter(const Ahead& q, VI row) {
  const DI di;
  const auto second = hn::RebindMask(di, q.place[1]), third = hn::RebindMask(di, q.place[2]);
  return hn::Shr(row, hn::IfThenElse(third, hn::Set(di, 2 * RankTable::bits),
                                     hn::IfThenElseZero(second, hn::Set(di, RankTable::bits))));
}

// Puts the corner ahead into its place: the packet holds the face ahead then. Depth and scalar where rays cross that,
// and which do so within its edges.
template <bool Parallel>
HWY_INLINE hn::Mask<DF> cross(const Ahead& q, RayPacket& r, VF& at, VF (&value)[3], VF& scalar) {
  const DF d;
  VF edge[3], depth[3];
  for (std::size_t k = 0; k < 3; ++k) {
    // Of the edges with the two corners that stay, both to the right.
    const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
    const VF beside = hn::Abs(hn::IfThenElse(q.place[a], q.edge[b], q.edge[a]));
    edge[k] = hn::IfThenElse(q.place[k], hn::Load(d, r.edge[k]), beside);
    depth[k] = hn::IfThenElse(q.place[k], q.corner.depth, hn::Load(d, r.depth[k]));
    value[k] = hn::IfThenElse(q.place[k], q.corner.value, hn::Load(d, r.value[k]));
    hn::BlendedStore(q.u, q.place[k], d, r.u[k]);
    hn::BlendedStore(q.v, q.place[k], d, r.v[k]);
  }
  storeThree(edge, r.edge);
  storeThree(depth, r.depth);
  storeThree(value, r.value);
  crossing<Parallel>(edge, depth, value, at, scalar);
  return hn::AndNot(onEdge(edge), hn::Or(hn::Or(q.place[0], q.place[1]), q.place[2]));
}

// Takes the rays of a packet through the cells where they are, to the n-th place of its path. False when none of them
// has a cell to go on to.
template <bool Parallel>
HWY_INLINE bool step(const WalkFrame& frame, RayPacket& r, RayPath& path, std::size_t n) {
  const DF d;
  const DI di;
  if (frame.hidden != nullptr) markHidden(frame, r, path.hidden[n]);
  const VI row = rankRow(hn::Load(di, r.ranks)), here = hn::Load(di, r.way), three = hn::Set(di, 3);
  const Ahead q = lookAhead(frame, r);
  const VI next = ranksAfter(q, row);
  VI way, ahead;
  gatherLink(frame.links, hn::Or(hn::AndNot(three, here), hn::And(next, three)), way, ahead);

  VF at, scalar, value[3];
  const auto found = hn::RebindMask(di, cross<Parallel>(q, r, at, value, scalar));
  if (frame.cell_values != nullptr) {
    scalar = hn::GatherIndex(d, frame.cell_values, cellOf(here));
  } else if (frame.pieces->jumps || frame.peaks) {
    scalar = withinCorners(scalar, value);
  }
  const auto live = hn::LoadMaskBits(di, r.live);
  const auto moved = hn::RebindMask(d, hn::And(live, found));
  // A ray at its end stays where it was.
  hn::Store(hn::IfThenElse(moved, at, hn::Load(d, path.depth[n - 1])), d, path.depth[n]);
  hn::Store(hn::IfThenElse(moved, scalar, hn::Load(d, path.scalar[n - 1])), d, path.scalar[n]);
  const auto lost = hn::AndNot(found, live);
  if (HWY_UNLIKELY(!hn::AllFalse(di, lost)))
    hn::Store(hn::Or(hn::Load(di, r.lost), hn::VecFromMask(di, lost)), di, r.lost);

  const auto no_cell = hn::Eq(way, hn::Set(di, static_cast<std::int32_t>(no_way)));
  const auto goes_on = hn::AndNot(no_cell, hn::And(live, found));
  hn::StoreMaskBits(di, goes_on, r.live);
  // Rays at their end read what all may read.
  way = hn::IfThenElseZero(goes_on, way);
  hn::Store(way, di, r.way);
  hn::Store(hn::IfThenElseZero(goes_on, ahead), di, r.ahead);
  hn::Store(hn::Or(hn::And(next, hn::Set(di, 7 << 2)), hn::And(way, three)), di, r.ranks);
  if (frame.many) fetchLinks(frame, r);
  return !hn::AllFalse(di, goes_on);
}

// The order of three ids (see RankTable).
HWY_INLINE VI orderOf(VI a, VI b, VI c) {
  const DI di;
  const auto less = [&](VI p, VI q) HWY_ATTR { return hn::IfThenElseZero(hn::Lt(p, q), hn::Set(di, 1)); };
  const VI place_a = hn::Add(less(b, a), less(c, a)), place_b = hn::Add(less(a, b), less(c, b));
  return hn::GatherIndex(di, rank_table.order, hn::Add(hn::Add(hn::Add(place_a, place_a), place_a), place_b));
}

// Places the rays at the faces that they enter by.
template <bool Parallel>
HWY_INLINE void enter(const WalkFrame& frame, const VI (&corner)[3], RayPacket& r) {
  const DF d;
  const DI di;
  VF u[3], v[3], depth[3], value[3], edge[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const Corner c = gatherCorner(frame.points, corner[k]);
    u[k] = seen(c.x, hn::Load(di, r.x));
    v[k] = seen(c.y, hn::Load(di, r.y));
    depth[k] = c.depth;
    value[k] = c.value;
  }
  for (std::size_t k = 0; k < 3; ++k)
    edge[k] = edgeFunction(u[(k + 1) % 3], v[(k + 1) % 3], u[(k + 2) % 3], v[(k + 2) % 3]);
  storeThree(u, r.u);
  storeThree(v, r.v);
  storeThree(edge, r.edge);
  storeThree(depth, r.depth);
  storeThree(value, r.value);
  VF at, scalar;
  crossing<Parallel>(edge, depth, value, at, scalar);
  scalar = withinCorners(scalar, value);
  hn::Store(at, d, r.at);
  hn::Store(scalar, d, r.scalar);
  hn::Store(pieceOf(*frame.pieces, scalar), di, r.piece);
}

// Fills a packet with rays from `starts`; the lanes that are left over hold copies of the first, at their end.
template <bool Parallel>
void fill(const WalkFrame& frame, const WalkPlace& place, std::span<const Start> starts, const Pixels& pixels,
          RayPacket& r) {
  const DF d;
  const DI di;
  const std::size_t lanes = hn::Lanes(d);
  r.count = std::min(lanes, starts.size());
  r.steps = 0;
  alignas(64) RayPacket::PerRay<std::int32_t> corner[3];
  for (std::size_t i = 0; i < lanes; ++i) {
    const Start& start = starts[i < r.count ? i : 0];
    const Entrance& entrance = frame.entrances[start.entrance];
    const std::uint32_t p = start.pixel;
    for (std::size_t k = 0; k < 3; ++k)
      corner[k][i] = static_cast<std::int32_t>(entrance.corner[k]);
    r.way[i] = static_cast<std::int32_t>(entrance.in.way);
    r.ahead[i] = static_cast<std::int32_t>(entrance.in.corner);
    r.pixel[i] = p;
    r.x[i] = place.x + frame.pixel * pixelColumn(p);
    r.y[i] = place.y + frame.pixel * pixelRow(p);
    r.length[i] = pixels.length[p];
    r.clip_near[i] = pixels.clip_near[p];
    r.clip_far[i] = pixels.clip_far[p];
    r.red[i] = pixels.red[p];
    r.green[i] = pixels.green[p];
    r.blue[i] = pixels.blue[p];
    r.light[i] = pixels.light[p];
  }
  const VI corners[3] = {hn::Load(di, corner[0]), hn::Load(di, corner[1]), hn::Load(di, corner[2])};
  enter<Parallel>(frame, corners, r);
  const VI way = hn::Load(di, r.way);
  const VI rank = hn::And(way, hn::Set(di, 3));
  hn::Store(hn::Or(hn::ShiftLeft<2>(orderOf(corners[0], corners[1], corners[2])), rank), di, r.ranks);
  hn::Store(hn::Zero(di), di, r.lost);
  hn::StoreMaskBits(di, hn::FirstN(di, r.count), r.live);
  hn::Store(hn::Zero(d), d, r.advance);
}

// What the rays have seen goes back to their pixels.
void empty(const WalkFrame& frame, const RayPacket& r, Pixels& pixels, WalkScratch& scratch) {
  for (std::size_t i = 0; i < r.count; ++i) {
    const std::uint32_t p = r.pixel[i];
    pixels.red[p] = r.red[i];
    pixels.green[p] = r.green[i];
    pixels.blue[p] = r.blue[i];
    pixels.light[p] = r.light[i];
    scratch.left[p] = r.at[i];
    const bool lost = r.lost[i] != 0 || !(r.advance[i] >= -frame.tolerance);
    if (lost) addPixel(pixels.flagged, p);
  }
}

// Rays that nothing reaches any more are at their end.
HWY_INLINE bool stopOpaque(RayPacket& r) {
  const DF d;
  const DI di;
  const auto shows = hn::RebindMask(di, hn::Ge(hn::Load(d, r.light), hn::Set(d, opaque_light)));
  const auto live = hn::And(hn::LoadMaskBits(di, r.live), shows);
  hn::StoreMaskBits(di, live, r.live);
  return !hn::AllFalse(di, live);
}

// As many steps as a path holds, then what was seen on them.
template <bool Parallel>
std::size_t walkOn(const WalkFrame& frame, WalkScratch& scratch, bool (&live)[WalkScratch::packets]) {
  const DI di;
  std::size_t steps[WalkScratch::packets] = {};
  std::size_t fragments = 0;
  for (std::size_t p = 0; p < WalkScratch::packets; ++p) {
    if (!live[p]) continue;
    std::copy_n(scratch.packet[p].at, RayPacket::rays, scratch.path[p].depth[0]);
    std::copy_n(scratch.packet[p].scalar, RayPacket::rays, scratch.path[p].scalar[0]);
  }
  bool walking[WalkScratch::packets];
  std::copy(live, live + WalkScratch::packets, walking);
  for (std::size_t n = 1; n <= RayPath::most; ++n) {
    for (std::size_t p = 0; p < WalkScratch::packets; ++p) {
      if (!walking[p]) continue;
      RayPacket& r = scratch.packet[p];
      fragments += hn::CountTrue(di, hn::LoadMaskBits(di, r.live));
      walking[p] = step<Parallel>(frame, r, scratch.path[p], n);
      steps[p] = n;
    }
  }
  for (std::size_t p = 0; p < WalkScratch::packets; ++p) {
    if (!live[p]) continue;
    RayPacket& r = scratch.packet[p];
    std::copy_n(scratch.path[p].depth[steps[p]], RayPacket::rays, r.at);
    std::copy_n(scratch.path[p].scalar[steps[p]], RayPacket::rays, r.scalar);
    shade(frame, scratch.path[p], steps[p], r);
    live[p] = walking[p] && (frame.peaks || stopOpaque(r));
    r.steps += steps[p];
    if (live[p] && r.steps > frame.most_steps) {
      hn::Store(hn::Or(hn::Load(di, r.lost), hn::VecFromMask(di, hn::LoadMaskBits(di, r.live))), di, r.lost);
      live[p] = false;
    }
  }
  return fragments;
}

template <bool Parallel>
std::size_t walkAll(const WalkFrame& frame, const WalkPlace& place, std::span<const Start> starts, Pixels& pixels,
                    WalkScratch& scratch) {
  const std::size_t lanes = hn::Lanes(DF());
  bool live[WalkScratch::packets] = {};
  bool full[WalkScratch::packets] = {};
  std::size_t fragments = 0;
  for (;;) {
    bool any = false;
    for (std::size_t p = 0; p < WalkScratch::packets; ++p) {
      if (!live[p]) {
        if (full[p]) empty(frame, scratch.packet[p], pixels, scratch);
        full[p] = live[p] = !starts.empty();
        if (full[p]) {
          fill<Parallel>(frame, place, starts, pixels, scratch.packet[p]);
          starts = starts.subspan(std::min(lanes, starts.size()));
        }
      }
      any = any || live[p];
    }
    if (!any) return fragments;
    fragments += walkOn<Parallel>(frame, scratch, live);
  }
}

std::size_t walk(const WalkFrame& frame, const WalkPlace& place, std::span<const Start> starts, Pixels& pixels,
                 WalkScratch& scratch) {
  return frame.parallel ? walkAll<true>(frame, place, starts, pixels, scratch)
                        : walkAll<false>(frame, place, starts, pixels, scratch);
}

// One face and the pixels of a tile.
template <bool Parallel>
class FaceOnTile {
 public:
  FaceOnTile(const WalkFrame& frame, const WalkPlace& place, std::uint32_t face)
      : place_(place), pixel_(frame.pixel), face_(face) {
    for (std::size_t k = 0; k < 3; ++k)
      corner_[k] = frame.points[frame.entrances[face].corner[k]];
  }

  PixelRange columns() const { return range(&WalkPoint::x, place_.x); }
  PixelRange rows() const { return range(&WalkPoint::y, place_.y); }

  void find(std::size_t block, std::uint16_t wanted, WalkScratch& scratch, std::vector<Start>& out) const {
    const DF d;
    const DI di;
    const auto column = static_cast<std::int32_t>(block % block_columns * 4);
    const auto row = static_cast<std::int32_t>(block / block_columns * 4);
    for (std::size_t sub = 0; sub < block_pixels; sub += hn::Lanes(d)) {
      const std::size_t first = block * block_pixels + sub;
      const auto centre = [&](std::int32_t place, std::int32_t begin, const std::int32_t* offset) HWY_ATTR {
        return hn::Add(hn::Mul(hn::Set(di, pixel_), hn::Load(di, offset + sub)), hn::Set(di, place + pixel_ * begin));
      };
      const VI x = centre(place_.x, column, in_block.x), y = centre(place_.y, row, in_block.y);
      VF u[3], v[3], edge[3], depth[3];
      for (std::size_t k = 0; k < 3; ++k) {
        depth[k] = hn::Set(d, corner_[k].depth);
        u[k] = seen(hn::Set(di, corner_[k].x), x);
        v[k] = seen(hn::Set(di, corner_[k].y), y);
      }
      for (std::size_t k = 0; k < 3; ++k)
        edge[k] = edgeFunction(u[(k + 1) % 3], v[(k + 1) % 3], u[(k + 2) % 3], v[(k + 2) % 3]);
      const auto n0 = isNegative(edge[0]), n1 = isNegative(edge[1]), n2 = isNegative(edge[2]);
      const auto tie = onEdge(edge);
      if (!hn::AllFalse(d, tie)) count(first, hn::RebindMask(di, hn::And(tie, touched(edge))), unknown, scratch);
      const auto leaves = hn::And(hn::And(n0, n1), n2);
      const auto outside = hn::Or(hn::Or(n0, n1), n2);
      if (!hn::AllFalse(d, leaves)) count(first, hn::RebindMask(di, leaves), -1, scratch);
      if (hn::AllTrue(d, outside)) continue;
      count(first, hn::RebindMask(di, hn::Not(outside)), 1, scratch);
      VF at, unused;
      crossing<Parallel>(edge, depth, depth, at, unused);
      append(first, hn::Not(outside), static_cast<std::uint32_t>(wanted) >> sub, at, out);
    }
  }

 private:
  PixelRange range(std::int32_t WalkPoint::*side, std::int32_t first) const {
    const auto [lo, hi] = std::minmax({corner_[0].*side, corner_[1].*side, corner_[2].*side});
    return {lo - first, hi - first, pixel_, tile_size};
  }

  // What a line that meets a face's edge adds to its balance: never 0 again.
  static constexpr std::int32_t unknown = 1 << 16;

  // Where no two edge functions are of different signs: on the face, its edges included.
  static HWY_INLINE hn::Mask<DF> touched(const VF (&edge)[3]) {
    const VF zero = hn::Zero(DF());
    const VF least = hn::Min(hn::Min(edge[0], edge[1]), edge[2]), most = hn::Max(hn::Max(edge[0], edge[1]), edge[2]);
    return hn::Or(hn::Ge(least, zero), hn::Le(most, zero));
  }

  static HWY_INLINE void count(std::size_t first, hn::Mask<DI> which, std::int32_t by, WalkScratch& scratch) {
    const DI di;
    std::int32_t* balance = scratch.balance.data() + first;
    hn::StoreU(hn::Add(hn::LoadU(di, balance), hn::IfThenElseZero(which, hn::Set(di, by))), di, balance);
  }

  HWY_INLINE void append(std::size_t first, hn::Mask<DF> inside, std::uint32_t wanted, VF at,
                         std::vector<Start>& out) const {
    const DF d;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, inside, bytes);
    alignas(64) float depth[RayPacket::rays];
    hn::Store(at, d, depth);
    const std::uint32_t lanes = (1U << hn::Lanes(d)) - 1;
    for (std::uint32_t bits = (bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8U) & wanted & lanes; bits != 0;
         bits &= bits - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(bits));
      out.push_back({depth[i], face_, static_cast<std::uint32_t>(first + i)});
    }
  }

  WalkPlace place_;
  std::int32_t pixel_;
  std::uint32_t face_;
  WalkPoint corner_[3];
};

template <bool Parallel>
void findAll(const WalkFrame& frame, const WalkPlace& place, std::span<const std::uint32_t> faces,
             const PixelMask& wanted, WalkScratch& scratch, std::vector<Start>& out) {
  for (const std::uint32_t f : faces) {
    const FaceOnTile<Parallel> face(frame, place, f);
    const PixelRange columns = face.columns(), rows = face.rows();
    if (columns.last < columns.first) continue;
    for (int y = rows.first / 4; y <= rows.last / 4 && rows.first <= rows.last; ++y) {
      for (int x = columns.first / 4; x <= columns.last / 4; ++x) {
        const auto block = static_cast<std::size_t>(y * block_columns + x);
        if (wanted[block] != 0) face.find(block, wanted[block], scratch, out);
      }
    }
  }
}

void find(const WalkFrame& frame, const WalkPlace& place, std::span<const std::uint32_t> faces, const PixelMask& wanted,
          WalkScratch& scratch, std::vector<Start>& out) {
  frame.parallel ? findAll<true>(frame, place, faces, wanted, scratch, out)
                 : findAll<false>(frame, place, faces, wanted, scratch, out);
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::composite::native {

HWY_EXPORT(find);
HWY_EXPORT(walk);

void findStarts(const WalkFrame& frame, const WalkPlace& place, std::span<const std::uint32_t> faces,
                const PixelMask& wanted, WalkScratch& scratch, std::vector<Start>& out) {
  HWY_DYNAMIC_DISPATCH(find)(frame, place, faces, wanted, scratch, out);
}

std::size_t walkRays(const WalkFrame& frame, const WalkPlace& place, std::span<const Start> starts, Pixels& pixels,
                     WalkScratch& scratch) {
  return HWY_DYNAMIC_DISPATCH(walk)(frame, place, starts, pixels, scratch);
}

}  // namespace spillikin::composite::native
#endif
