#include <algorithm>
#include <bit>
#include <vector>

#include "spillikin/composite/native_kernel.h"

// Once for each instruction set; the best that the machine has is taken at run time.
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/composite/native_whole_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_piece_share-inl.h"
#include "spillikin/composite/native_shade-inl.h"
#include "spillikin/composite/native_whole.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// The segments between the crossings of a whole cell.
template <bool Parallel, bool Clipped>
HWY_INLINE Segment between(const TileView& view, VF& near, VF& far, VF front, VF back, hn::Mask<DF>& inside,
                           std::size_t first, const Pixels& pixels, float anchor) {
  const DF d;
  const VF half = hn::Set(d, 0.5F);
  const VF z0 = hn::Set(d, view.z0);
  const auto depth = [&](VF z) HWY_ATTR { return Parallel ? hn::Sub(z0, z) : reciprocal(hn::Add(z, z0)); };
  near = hn::IfThenElse(inside, near, hn::Zero(d));
  far = hn::IfThenElse(inside, far, hn::Zero(d));
  if constexpr (Clipped) {
    const VF whole_near = near;
    const VF whole_far = far;
    near = hn::Min(near, hn::Load(d, pixels.clip_near.data() + first));
    far = hn::Max(far, hn::Load(d, pixels.clip_far.data() + first));
    inside = hn::And(inside, hn::Gt(near, far));
    near = hn::IfThenElse(inside, near, hn::Zero(d));
    far = hn::IfThenElse(inside, far, hn::Zero(d));
    // The field runs on as if nothing were cut; an interval too short for float to tell its ends apart has one value.
    const VF begin = depth(whole_near);
    const VF extent = hn::Sub(depth(whole_far), begin);
    const auto long_enough = hn::And(inside, hn::Gt(extent, hn::Zero(d)));
    const VF rate = hn::IfThenElseZero(long_enough, hn::Div(hn::Sub(back, front), extent));
    const VF lo = hn::Min(front, back);
    const VF hi = hn::Max(front, back);
    const VF start = front;
    front = hn::Clamp(hn::MulAdd(rate, hn::Sub(depth(near), begin), start), lo, hi);
    back = hn::Clamp(hn::MulAdd(rate, hn::Sub(depth(far), begin), start), lo, hi);
  }
  VF length = hn::Sub(near, far);
  if constexpr (!Parallel) length = hn::Mul(length, reciprocal(hn::Mul(hn::Add(near, z0), hn::Add(far, z0))));
  length = hn::IfThenElseZero(inside, hn::Mul(length, hn::Load(d, pixels.length.data() + first)));
  const VF half_change = hn::IfThenElseZero(inside, hn::Mul(hn::Sub(back, front), half));
  const VF mean = hn::IfThenElseZero(inside, hn::Add(front, half_change));
  return {hn::Sub(mean, hn::Set(d, anchor)), half_change, length};
}

// The triangles that the rays of each block of the tile may meet, a bit each: those that have pixels, or the lines
// through them, on the sides of all three edges. A block inside of a large cell meets two of its many triangles.
class BlockTriangles {
 public:
  HWY_INLINE explicit BlockTriangles(const WholeCell& cell) {
    static_assert(WholeCell::max_triangles <= 64 && tile_blocks == 64);
    std::uint64_t below[WholeCell::max_edges], above[WholeCell::max_edges];
    for (std::size_t e = 0; e < cell.edge_count; ++e)
      findSides(cell, cell.edge[e], below[e], above[e]);
    const std::uint64_t box = boxBits(cell.blocks);
    for (std::uint64_t blocks = box; blocks != 0; blocks &= blocks - 1)
      of_block_[std::countr_zero(blocks)] = 0;
    for (std::size_t k = 0; k < cell.triangle_count; ++k) {
      const WholeCell::Triangle& t = cell.triangle[k];
      const std::uint64_t negative = below[t.ab] & below[t.bc] & above[t.ac];
      const std::uint64_t positive = above[t.ab] & above[t.bc] & below[t.ac];
      for (std::uint64_t blocks = (negative | positive) & box; blocks != 0; blocks &= blocks - 1)
        of_block_[std::countr_zero(blocks)] |= std::uint64_t{1} << k;
    }
  }

  std::uint64_t operator()(std::size_t first) const { return of_block_[first / block_pixels]; }

 private:
  // The blocks with pixels below a line and with such above it, near it counting as both.
  static HWY_INLINE void findSides(const WholeCell& cell, const WholeCell::Form& line, std::uint64_t& below,
                                   std::uint64_t& above) {
    const DF d;
    const VF reach = hn::Set(d, block_reach * (std::abs(line[0]) + std::abs(line[1])) + 4.0F * WholeCell::unsure);
    const std::size_t lanes = hn::Lanes(d);
    below = above = 0;
    const auto first = static_cast<std::size_t>(cell.blocks.y0) * block_columns;
    for (std::size_t b = first / lanes * lanes; b < static_cast<std::size_t>(cell.blocks.y1) * block_columns;
         b += lanes) {
      const VF at = form(line, hn::Load(d, block_middles.x + b), hn::Load(d, block_middles.y + b));
      below |= std::uint64_t{maskBits(hn::Lt(at, reach))} << b;
      above |= std::uint64_t{maskBits(hn::Gt(at, hn::Neg(reach)))} << b;
    }
  }

  std::uint64_t of_block_[tile_blocks];  // of those in the cell's box
};

// One vector of rays through a whole cell: every boundary triangle that a ray meets is an entry or an exit.
struct Crossings {
  VF near, far, front, back;
  hn::Mask<DF> enters, leaves, bad;
};

template <bool Parallel>
HWY_INLINE Crossings crossings(const WholeCell& cell, std::uint64_t triangles, VF x, VF y, VF z0) {
  const DF d;
  const auto nothing = hn::MaskFromVec(hn::Zero(d));
  Crossings c{hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d), nothing, nothing, nothing};
  VF closest = hn::Set(d, 1.0F);
  for (; triangles != 0; triangles &= triangles - 1) {
    const WholeCell::Triangle& t = cell.triangle[static_cast<std::size_t>(std::countr_zero(triangles))];
    const auto below = [&](std::size_t e) HWY_ATTR {
      const VF at = form(cell.edge[e], x, y);
      closest = hn::Min(closest, hn::Abs(at));
      return hn::Lt(at, hn::Zero(d));
    };
    const auto ab = below(t.ab), bc = below(t.bc), ac = below(t.ac);
    const auto negative = hn::And(hn::And(ab, bc), hn::Not(ac));
    const auto positive = hn::And(ac, hn::Not(hn::Or(ab, bc)));
    if (hn::AllFalse(d, hn::Or(negative, positive))) continue;
    const VF z = hn::Clamp(form(t.nearness, x, y), hn::Set(d, t.farthest), hn::Set(d, t.nearest));
    VF s = form(t.scalar, x, y);
    if constexpr (!Parallel) s = hn::Mul(s, reciprocal(hn::Add(z, z0)));
    s = hn::Clamp(hn::Add(s, hn::Set(d, t.base)), hn::Set(d, t.lo), hn::Set(d, t.hi));
    const auto leaves = t.turned ? negative : positive;
    const auto enters = t.turned ? positive : negative;
    c.bad = hn::Or(c.bad, hn::Or(hn::And(enters, c.enters), hn::And(leaves, c.leaves)));
    c.enters = hn::Or(c.enters, enters);
    c.leaves = hn::Or(c.leaves, leaves);
    c.near = hn::IfThenElse(enters, z, c.near);
    c.front = hn::IfThenElse(enters, s, c.front);
    c.far = hn::IfThenElse(leaves, z, c.far);
    c.back = hn::IfThenElse(leaves, s, c.back);
  }
  // Too near a line to tell the side in float.
  const auto unsure = hn::Le(closest, hn::Set(d, WholeCell::unsure));
  c.bad = hn::Or(c.bad, hn::Or(unsure, hn::Xor(c.enters, c.leaves)));
  return c;
}

// What of the crossings is to be drawn; those that are to go one by one are added to c.bad.
HWY_INLINE hn::Mask<DF> drawn(const PieceShare& share, std::size_t first, Crossings& c) {
  const auto some = hn::And(hn::And(c.enters, hn::Gt(c.near, c.far)), hn::Not(c.bad));
  const auto lanes = share(c.near, c.far, centresX(first), centresY(first));
  c.bad = hn::Or(c.bad, hn::And(some, lanes.unsure));
  return hn::And(some, lanes.mine);
}

template <bool Parallel, bool Clipped, Care care>
HWY_NOINLINE std::size_t shadeWhole(const TileView& view, const WholeCell& cell, Pixels& pixels,
                                    KernelScratch& scratch) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<care> shader(cell.look);
  const Certificate certificate(view);
  const PieceShare share(view, {cell.bound.data(), cell.bound_count});
  const VF z0 = hn::Set(d, view.z0);
  const BlockTriangles triangles(cell);
  std::size_t fragments = 0;
  for (int by = cell.blocks.y0; by < cell.blocks.y1; ++by) {
    for (int bx = cell.blocks.x0; bx < cell.blocks.x1; ++bx) {
      for (std::size_t sub = 0; sub < block_pixels; sub += lanes) {
        const std::size_t first = static_cast<std::size_t>((by * block_columns + bx) * block_pixels) + sub;
        if (triangles(first) == 0 || !pixels.isLive(first)) continue;
        Crossings c = crossings<Parallel>(cell, triangles(first), centresX(first), centresY(first), z0);
        auto inside = drawn(share, first, c);
        listPixels(maskBits(c.bad), first, scratch.left_over);
        if (hn::AllFalse(d, inside)) continue;
        VF near = c.near;
        VF far = c.far;
        const Segment segment =
            between<Parallel, Clipped>(view, near, far, c.front, c.back, inside, first, pixels, shader.anchor());
        fragments += hn::CountTrue(d, inside);
        certificate.check(near, far, inside, first, pixels);
        shader.blend(segment, first, pixels);
      }
    }
  }
  return fragments;
}

template <bool Parallel, bool Clipped>
std::size_t shadeWholeAs(const TileView& view, const WholeCell& cell, Pixels& pixels, KernelScratch& scratch) {
  return withCare(cell.care, [&](auto care) HWY_ATTR {
    return shadeWhole<Parallel, Clipped, decltype(care)::value>(view, cell, pixels, scratch);
  });
}

std::size_t whole(const TileView& view, const WholeCell& cell, Pixels& pixels, KernelScratch& scratch) {
  if (view.screen->parallel()) {
    return view.clipped ? shadeWholeAs<true, true>(view, cell, pixels, scratch)
                        : shadeWholeAs<true, false>(view, cell, pixels, scratch);
  }
  return view.clipped ? shadeWholeAs<false, true>(view, cell, pixels, scratch)
                      : shadeWholeAs<false, false>(view, cell, pixels, scratch);
}

// The fragments of a whole cell on the pixels wanted. There are few: every cell takes the shader that is right for all.
template <bool Parallel>
void collectWholeAs(const TileView& view, const WholeCell& cell, const PixelMask& wanted, const Pixels& pixels,
                    KernelScratch& scratch, std::vector<Fragment>& out) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<Care::full> shader(cell.look);
  const PieceShare share(view, {cell.bound.data(), cell.bound_count});
  const VF z0 = hn::Set(d, view.z0);
  const BlockTriangles triangles(cell);
  Pixels& blank = scratch.blank;
  alignas(64) float nears[block_pixels];
  alignas(64) float fars[block_pixels];
  for (int by = cell.blocks.y0; by < cell.blocks.y1; ++by) {
    for (int bx = cell.blocks.x0; bx < cell.blocks.x1; ++bx) {
      for (std::size_t sub = 0; sub < block_pixels; sub += lanes) {
        const std::size_t first = static_cast<std::size_t>((by * block_columns + bx) * block_pixels) + sub;
        const unsigned asked = static_cast<unsigned>(wanted[first / block_pixels]) >> (first % block_pixels);
        if (asked == 0 || triangles(first) == 0) continue;
        Crossings c = crossings<Parallel>(cell, triangles(first), centresX(first), centresY(first), z0);
        auto inside = drawn(share, first, c);
        listPixels(maskBits(c.bad) & asked, first, scratch.left_over);
        VF near = c.near;
        VF far = c.far;
        const Segment segment =
            between<Parallel, true>(view, near, far, c.front, c.back, inside, first, pixels, shader.anchor());
        unsigned bits = maskBits(inside) & asked;
        if (bits == 0) continue;
        for (auto* channel : {&blank.red, &blank.green, &blank.blue})
          hn::Store(hn::Zero(d), d, channel->data() + first);
        hn::Store(hn::Set(d, 1.0F), d, blank.light.data() + first);
        shader.blend(segment, first, blank);
        hn::Store(near, d, nears);
        hn::Store(far, d, fars);
        for (; bits != 0; bits &= bits - 1) {
          const std::size_t lane = static_cast<unsigned>(std::countr_zero(bits));
          const std::size_t p = first + lane;
          out.push_back({nears[lane], fars[lane], blank.red[p], blank.green[p], blank.blue[p], blank.light[p],
                         static_cast<std::uint32_t>(p)});
        }
      }
    }
  }
}

void wholeFragments(const TileView& view, const WholeCell& cell, const PixelMask& wanted, const Pixels& pixels,
                    KernelScratch& scratch, std::vector<Fragment>& out) {
  if (view.screen->parallel()) {
    collectWholeAs<true>(view, cell, wanted, pixels, scratch, out);
  } else {
    collectWholeAs<false>(view, cell, wanted, pixels, scratch, out);
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::composite::native {

HWY_EXPORT(whole);
HWY_EXPORT(wholeFragments);

std::size_t paintWhole(const TileView& view, const WholeCell& cell, Pixels& pixels, KernelScratch& scratch) {
  return HWY_DYNAMIC_DISPATCH(whole)(view, cell, pixels, scratch);
}

void collectWhole(const TileView& view, const WholeCell& cell, const PixelMask& wanted, const Pixels& pixels,
                  KernelScratch& scratch, std::vector<Fragment>& out) {
  HWY_DYNAMIC_DISPATCH(wholeFragments)(view, cell, wanted, pixels, scratch, out);
}

}  // namespace spillikin::composite::native
#endif
