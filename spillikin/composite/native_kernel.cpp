#include "spillikin/composite/native_kernel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

// Once for each instruction set; the best that the machine has is taken at run time.
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/composite/native_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spillikin/composite/native_canvas-inl.h"
#include "spillikin/composite/native_centres.h"
#include "spillikin/composite/native_setup-inl.h"
#include "spillikin/composite/native_shade-inl.h"
#include "spillikin/composite/native_whole.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// The faces of a cell by the code of those it is left through: entered faces first.
struct FaceOrder {
  std::uint8_t slot[16][4] = {};
  std::uint8_t entered[16] = {};
  constexpr FaceOrder() {
    for (unsigned code = 0; code < 16; ++code) {
      unsigned n = 0;
      for (unsigned f = 0; f < 4; ++f) {
        if ((code >> f & 1U) == 0) slot[code][n++] = static_cast<std::uint8_t>(f);
      }
      entered[code] = static_cast<std::uint8_t>(n);
      for (unsigned f = 0; f < 4; ++f) {
        if ((code >> f & 1U) != 0) slot[code][n++] = static_cast<std::uint8_t>(f);
      }
    }
  }
};
constexpr FaceOrder face_order;

HWY_INLINE unsigned maskBits(hn::Mask<DF> mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(DF(), mask, bits);
  return static_cast<unsigned>(bits[0]) | static_cast<unsigned>(bits[1]) << 8U;
}

template <unsigned Entered, bool Clipped>
HWY_NOINLINE std::size_t cover(const CellBatch& batch, std::size_t i, const Pixels& pixels, Coverage& out) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const std::uint8_t* slot = face_order.slot[batch.code[i]];
  const auto face = [&](unsigned k, unsigned c) HWY_ATTR { return hn::Set(d, batch.face[slot[k]][c][i]); };
  const VF x0 = face(0, 0), y0 = face(0, 1), t0 = face(0, 2);
  const VF x1 = face(1, 0), y1 = face(1, 1), t1 = face(1, 2);
  const VF x2 = face(2, 0), y2 = face(2, 1), t2 = face(2, 2);
  const VF x3 = face(3, 0), y3 = face(3, 1), t3 = face(3, 2);
  const VF eye = hn::Set(d, batch.eye_nearness);
  const auto x_first = static_cast<std::size_t>(batch.block_x0[i]);
  const auto columns = static_cast<std::size_t>(batch.block_x1[i] + 1) - x_first;
  const auto rows = static_cast<std::size_t>(batch.block_y1[i] + 1 - batch.block_y0[i]);
  auto by = static_cast<std::size_t>(batch.block_y0[i]);
  std::size_t n = 0;
  std::size_t column = 0;
  // One loop over rows and columns: two would end at as good as random.
  for (std::size_t block = 0; block < rows * columns; ++block) {
    const std::size_t bx = x_first + column;
    for (std::size_t sub = 0; sub < block_pixels; sub += lanes) {
      const VF x = hn::Load(d, centres.x[bx] + sub);
      const VF y = hn::Load(d, centres.y[by] + sub);
      const VF z0 = hn::MulAdd(x0, x, hn::MulAdd(y0, y, t0));
      const VF z1 = hn::MulAdd(x1, x, hn::MulAdd(y1, y, t1));
      const VF z2 = hn::MulAdd(x2, x, hn::MulAdd(y2, y, t2));
      const VF z3 = hn::MulAdd(x3, x, hn::MulAdd(y3, y, t3));
      VF near, far;
      if constexpr (Entered == 0) {
        near = eye;
        far = hn::Max(hn::Max(z0, z1), hn::Max(z2, z3));
      } else if constexpr (Entered == 1) {
        near = z0;
        far = hn::Max(hn::Max(z1, z2), z3);
      } else if constexpr (Entered == 2) {
        near = hn::Min(z0, z1);
        far = hn::Max(z2, z3);
      } else {
        near = hn::Min(hn::Min(z0, z1), z2);
        far = z3;
      }
      const std::size_t first = (by * block_columns + bx) * block_pixels + sub;
      if constexpr (Clipped) {
        near = hn::Min(near, hn::Load(d, pixels.clip_near.data() + first));
        far = hn::Max(far, hn::Load(d, pixels.clip_far.data() + first));
      }
      hn::Store(near, d, out.near + n * lanes);
      hn::Store(far, d, out.far + n * lanes);
      out.pixel[n] = static_cast<std::uint32_t>(first);
      // No branch on what is as good as random: an empty vector's place is taken by the next one.
      const bool some = !hn::AllFalse(d, hn::Gt(near, far));
      n += static_cast<std::size_t>(some) & pixels.live[first];
    }
    ++column;
    by += static_cast<std::size_t>(column == columns);
    column = column == columns ? 0 : column;
  }
  return n;
}

template <bool Clipped>
HWY_INLINE std::size_t coverAny(const CellBatch& batch, std::size_t i, const Pixels& pixels, Coverage& out) {
  switch (face_order.entered[batch.code[i]]) {
    case 0:
      return batch.parallel ? 0 : cover<0, true>(batch, i, pixels, out);
    case 1:
      return cover<1, Clipped>(batch, i, pixels, out);
    case 2:
      return cover<2, Clipped>(batch, i, pixels, out);
    case 3:
      return cover<3, Clipped>(batch, i, pixels, out);
    default:
      return 0;
  }
}

// Proves the order on every pixel: a fragment that begins before where the last one ended, up to rounding, is flagged.
// One that is no longer than that rounding may be where the cell is not (the planes of a flat cell part slowly) and
// proves nothing.
class Certificate {
 public:
  explicit HWY_INLINE Certificate(const TileView& view)
      : at_(hn::Set(DF(), view.overlap_at)),
        slope_(hn::Set(DF(), 1.0F + view.overlap_slope)),
        solid_at_(hn::Set(DF(), solid_share * view.overlap_at)),
        solid_slope_(hn::Set(DF(), 1.0F + solid_share * view.overlap_slope)) {}

  HWY_INLINE void check(VF near, VF far, hn::Mask<DF> inside, std::size_t first, Pixels& pixels) const {
    const DF d;
    const VF last = hn::Load(d, pixels.last.data() + first);
    const auto solid = hn::And(inside, hn::Gt(near, hn::MulAdd(far, solid_slope_, solid_at_)));
    hn::Store(hn::IfThenElse(solid, far, last), d, pixels.last.data() + first);
    const auto early = hn::And(solid, hn::Gt(near, hn::MulAdd(last, slope_, at_)));
    if (HWY_UNLIKELY(!hn::AllFalse(d, early))) {
      pixels.flagged[first / block_pixels] |= static_cast<std::uint16_t>(maskBits(early) << (first % block_pixels));
    }
  }

 private:
  VF at_, slope_, solid_at_, solid_slope_;
};

template <bool Parallel, Care care>
HWY_NOINLINE std::size_t shadeCell(const TileView& view, const CellBatch& batch, std::size_t i, const Coverage& covered,
                                   std::size_t count, Pixels& pixels) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<care> shader(batch.look(view.screen->pieces().data(), i));
  const Rays<Parallel> rays(view, batch, i, shader.anchor());
  const Certificate certificate(view);
  std::size_t fragments = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = covered.pixel[k];
    const VF near = hn::Load(d, covered.near + k * lanes);
    const VF far = hn::Load(d, covered.far + k * lanes);
    const auto inside = hn::Gt(near, far);
    fragments += hn::CountTrue(d, inside);
    certificate.check(near, far, inside, first, pixels);
    const Segment segment =
        rays(near, far, inside, centresX(first), centresY(first), hn::Load(d, pixels.length.data() + first));
    shader.blend(segment, first, pixels);
  }
  return fragments;
}

// The vectors that cell i may cover.
HWY_INLINE std::size_t coverCell(const TileView& view, const CellBatch& batch, std::size_t i, const Pixels& pixels,
                                 Coverage& covered) {
  if (batch.block_x0[i] > batch.block_x1[i] || batch.block_y0[i] > batch.block_y1[i]) return 0;
  return view.clipped || batch.straddles[i] != 0 ? coverAny<true>(batch, i, pixels, covered)
                                                 : coverAny<false>(batch, i, pixels, covered);
}

template <bool Parallel>
std::size_t paintBatch(const TileView& view, std::span<const Entry> cells, const CellBatch& batch, Pixels& pixels,
                       Coverage& covered) {
  std::size_t fragments = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (HWY_UNLIKELY(batch.care[i] == Care::edge_on)) {
      view.hand_back.take(view.hand_back.self, cells[i]);
      continue;
    }
    const std::size_t n = coverCell(view, batch, i, pixels, covered);
    if (n == 0) continue;
    switch (batch.care[i]) {
      case Care::none:
        fragments += shadeCell<Parallel, Care::none>(view, batch, i, covered, n, pixels);
        break;
      case Care::bend:
        fragments += shadeCell<Parallel, Care::bend>(view, batch, i, covered, n, pixels);
        break;
      case Care::bends:
        fragments += shadeCell<Parallel, Care::bends>(view, batch, i, covered, n, pixels);
        break;
      case Care::long_bends:
        fragments += shadeCell<Parallel, Care::long_bends>(view, batch, i, covered, n, pixels);
        break;
      case Care::cut:
        fragments += shadeCell<Parallel, Care::cut>(view, batch, i, covered, n, pixels);
        break;
      case Care::cuts:
        fragments += shadeCell<Parallel, Care::cuts>(view, batch, i, covered, n, pixels);
        break;
      case Care::deep:
        fragments += shadeCell<Parallel, Care::deep>(view, batch, i, covered, n, pixels);
        break;
      case Care::full:
        fragments += shadeCell<Parallel, Care::full>(view, batch, i, covered, n, pixels);
        break;
      case Care::edge_on:
        break;
    }
  }
  return fragments;
}

HWY_INLINE VF form(const WholeCell::Form& f, VF x, VF y) {
  const DF d;
  return hn::MulAdd(hn::Set(d, f[0]), x, hn::MulAdd(hn::Set(d, f[1]), y, hn::Set(d, f[2])));
}

// The segments between the crossings of a whole cell.
template <bool Parallel, bool Clipped>
HWY_INLINE Segment between(const TileView& view, const WholeCell& cell, VF& near, VF& far, VF front, VF back,
                           hn::Mask<DF>& inside, std::size_t first, const Pixels& pixels, float anchor) {
  const DF d;
  const VF half = hn::Set(d, 0.5F);
  const VF z0 = hn::Set(d, static_cast<float>(view.screen->depths().z0));
  const auto depth = [&](VF z) HWY_ATTR { return Parallel ? hn::Sub(z0, z) : reciprocal(hn::Add(z, z0)); };
  near = hn::IfThenElse(inside, near, hn::Zero(d));
  far = hn::IfThenElse(inside, far, hn::Zero(d));
  if constexpr (Clipped) {
    const VF whole_near = near;
    const VF whole_far = far;
    near = hn::Min(near, hn::Load(d, pixels.clip_near.data() + first));
    far = hn::Max(far, hn::Load(d, pixels.clip_far.data() + first));
    for (std::size_t k = 0; k < cell.bound_count; ++k) {
      const VF z = form(cell.bound[k].nearness, centresX(first), centresY(first));
      near = cell.bound[k].entry ? hn::Min(near, z) : near;
      far = cell.bound[k].entry ? far : hn::Max(far, z);
    }
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

// One vector of rays through a whole cell: every boundary triangle that a ray meets is an entry or an exit.
struct Crossings {
  VF near, far, front, back;
  hn::Mask<DF> enters, leaves, bad;
};

template <bool Parallel>
HWY_INLINE Crossings crossings(const WholeCell& cell, VF x, VF y, VF z0) {
  const DF d;
  hn::Mask<DF> side[WholeCell::max_edges];
  VF closest = hn::Set(d, 1.0F);
  for (std::size_t e = 0; e < cell.edge_count; ++e) {
    const VF at = form(cell.edge[e], x, y);
    side[e] = hn::Lt(at, hn::Zero(d));
    closest = hn::Min(closest, hn::Abs(at));
  }
  const auto nothing = hn::MaskFromVec(hn::Zero(d));
  // Too near a line to tell the side in float.
  const auto unsure = hn::Le(closest, hn::Set(d, WholeCell::unsure));
  Crossings c{hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d), nothing, nothing, unsure};
  for (std::size_t k = 0; k < cell.triangle_count; ++k) {
    const WholeCell::Triangle& t = cell.triangle[k];
    const auto ab = side[t.ab], bc = side[t.bc], ac = side[t.ac];
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
  c.bad = hn::Or(c.bad, hn::Xor(c.enters, c.leaves));
  return c;
}

HWY_INLINE void leaveOver(unsigned lanes, std::size_t first, KernelScratch& scratch) {
  for (; HWY_UNLIKELY(lanes != 0); lanes &= lanes - 1)
    scratch.left_over.push_back(static_cast<std::uint16_t>(first + static_cast<unsigned>(std::countr_zero(lanes))));
}

template <bool Parallel, bool Clipped, Care care>
HWY_NOINLINE std::size_t shadeWhole(const TileView& view, const WholeCell& cell, Pixels& pixels,
                                    KernelScratch& scratch) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<care> shader(cell.look);
  const Certificate certificate(view);
  const VF z0 = hn::Set(d, static_cast<float>(view.screen->depths().z0));
  std::size_t fragments = 0;
  for (int by = cell.blocks.y0; by < cell.blocks.y1; ++by) {
    for (int bx = cell.blocks.x0; bx < cell.blocks.x1; ++bx) {
      for (std::size_t sub = 0; sub < block_pixels; sub += lanes) {
        const std::size_t first = static_cast<std::size_t>((by * block_columns + bx) * block_pixels) + sub;
        if (pixels.live[first] == 0) continue;
        const Crossings c = crossings<Parallel>(cell, centresX(first), centresY(first), z0);
        leaveOver(maskBits(c.bad), first, scratch);
        auto inside = hn::And(hn::And(c.enters, hn::Gt(c.near, c.far)), hn::Not(c.bad));
        if (hn::AllFalse(d, inside)) continue;
        VF near = c.near;
        VF far = c.far;
        const Segment segment =
            between<Parallel, Clipped>(view, cell, near, far, c.front, c.back, inside, first, pixels, shader.anchor());
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
  switch (cell.care) {
    case Care::none:
      return shadeWhole<Parallel, Clipped, Care::none>(view, cell, pixels, scratch);
    case Care::bend:
      return shadeWhole<Parallel, Clipped, Care::bend>(view, cell, pixels, scratch);
    case Care::bends:
      return shadeWhole<Parallel, Clipped, Care::bends>(view, cell, pixels, scratch);
    case Care::long_bends:
      return shadeWhole<Parallel, Clipped, Care::long_bends>(view, cell, pixels, scratch);
    case Care::cut:
      return shadeWhole<Parallel, Clipped, Care::cut>(view, cell, pixels, scratch);
    case Care::cuts:
      return shadeWhole<Parallel, Clipped, Care::cuts>(view, cell, pixels, scratch);
    case Care::deep:
      return shadeWhole<Parallel, Clipped, Care::deep>(view, cell, pixels, scratch);
    case Care::full:
    case Care::edge_on:
      break;
  }
  return shadeWhole<Parallel, Clipped, Care::full>(view, cell, pixels, scratch);
}

std::size_t whole(const TileView& view, const WholeCell& cell, Pixels& pixels, KernelScratch& scratch) {
  const bool clipped = view.clipped || cell.bound_count > 0;
  if (view.screen->parallel()) {
    return clipped ? shadeWholeAs<true, true>(view, cell, pixels, scratch)
                   : shadeWholeAs<true, false>(view, cell, pixels, scratch);
  }
  return clipped ? shadeWholeAs<false, true>(view, cell, pixels, scratch)
                 : shadeWholeAs<false, false>(view, cell, pixels, scratch);
}

// Marks the vectors without light as done with; true when the whole tile is. What follows them is behind, if the order
// is to be trusted.
bool findOpaque(Pixels& pixels) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const VF threshold = hn::Set(d, opaque_light);
  bool all = true;
  for (std::size_t i = 0; i < tile_pixels; i += lanes) {
    const bool light = !hn::AllTrue(d, hn::Lt(hn::Load(d, pixels.light.data() + i), threshold));
    pixels.live[i] = static_cast<std::uint8_t>(light);
    all = all && !light;
  }
  return all;
}

// Looking for opaque pixels takes as long as a few cells.
constexpr std::size_t batches_between_looks = 4;

std::size_t paint(const TileView& view, std::span<const Entry> entries, Pixels& pixels, KernelScratch& scratch) {
  CellBatch& batch = scratch.batch;
  Coverage& covered = scratch.covered;
  const bool parallel = view.screen->parallel();
  std::size_t fragments = 0;
  for (std::size_t begin = 0; begin < entries.size(); begin += batch_cells) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(batch_cells, entries.size() - begin));
    setUp(view, cells, entries.subspan(begin + cells.size()), batch);
    fragments += parallel ? paintBatch<true>(view, cells, batch, pixels, covered)
                          : paintBatch<false>(view, cells, batch, pixels, covered);
    if (view.trusted && begin / batch_cells % batches_between_looks == batches_between_looks - 1 &&
        findOpaque(pixels)) {
      break;
    }
  }
  return fragments;
}

template <bool Parallel, Care care>
HWY_NOINLINE void collectCell(const TileView& view, const CellBatch& batch, std::size_t i, std::size_t count,
                              const PixelMask& wanted, const Pixels& pixels, KernelScratch& scratch,
                              std::vector<Fragment>& out) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<care> shader(batch.look(view.screen->pieces().data(), i));
  const Rays<Parallel> rays(view, batch, i, shader.anchor());
  const Coverage& covered = scratch.covered;
  Pixels& blank = scratch.blank;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = covered.pixel[k];
    const VF near = hn::Load(d, covered.near + k * lanes);
    const VF far = hn::Load(d, covered.far + k * lanes);
    const auto inside = hn::Gt(near, far);
    unsigned bits = maskBits(inside) & (static_cast<unsigned>(wanted[first / block_pixels]) >> (first % block_pixels));
    if (bits == 0) continue;
    for (auto* channel : {&blank.red, &blank.green, &blank.blue})
      hn::Store(hn::Zero(d), d, channel->data() + first);
    hn::Store(hn::Set(d, 1.0F), d, blank.light.data() + first);
    shader.blend(rays(near, far, inside, centresX(first), centresY(first), hn::Load(d, pixels.length.data() + first)),
                 first, blank);
    for (std::size_t lane = 0; bits != 0; ++lane, bits >>= 1U) {
      const std::size_t p = first + lane;
      if ((bits & 1U) == 0) continue;
      out.push_back({covered.near[k * lanes + lane], covered.far[k * lanes + lane], blank.red[p], blank.green[p],
                     blank.blue[p], blank.light[p], static_cast<std::uint32_t>(p)});
    }
  }
}

// The fragments of a whole cell on the pixels wanted. There are few: every cell takes the shader that is right for all.
template <bool Parallel>
void collectWholeAs(const TileView& view, const WholeCell& cell, const PixelMask& wanted, const Pixels& pixels,
                    KernelScratch& scratch, std::vector<Fragment>& out) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<Care::full> shader(cell.look);
  const VF z0 = hn::Set(d, static_cast<float>(view.screen->depths().z0));
  Pixels& blank = scratch.blank;
  alignas(64) float nears[block_pixels];
  alignas(64) float fars[block_pixels];
  for (int by = cell.blocks.y0; by < cell.blocks.y1; ++by) {
    for (int bx = cell.blocks.x0; bx < cell.blocks.x1; ++bx) {
      for (std::size_t sub = 0; sub < block_pixels; sub += lanes) {
        const std::size_t first = static_cast<std::size_t>((by * block_columns + bx) * block_pixels) + sub;
        const unsigned asked = static_cast<unsigned>(wanted[first / block_pixels]) >> (first % block_pixels);
        if (asked == 0) continue;
        const Crossings c = crossings<Parallel>(cell, centresX(first), centresY(first), z0);
        leaveOver(maskBits(c.bad) & asked, first, scratch);
        auto inside = hn::And(hn::And(c.enters, hn::Gt(c.near, c.far)), hn::Not(c.bad));
        VF near = c.near;
        VF far = c.far;
        const Segment segment =
            between<Parallel, true>(view, cell, near, far, c.front, c.back, inside, first, pixels, shader.anchor());
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

template <bool Parallel>
void collectAny(const TileView& view, const CellBatch& batch, std::size_t i, std::size_t n, const PixelMask& wanted,
                const Pixels& pixels, KernelScratch& scratch, std::vector<Fragment>& out) {
  switch (batch.care[i]) {
    case Care::none:
      return collectCell<Parallel, Care::none>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::bend:
      return collectCell<Parallel, Care::bend>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::bends:
      return collectCell<Parallel, Care::bends>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::long_bends:
      return collectCell<Parallel, Care::long_bends>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::cut:
      return collectCell<Parallel, Care::cut>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::cuts:
      return collectCell<Parallel, Care::cuts>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::deep:
      return collectCell<Parallel, Care::deep>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::full:
      return collectCell<Parallel, Care::full>(view, batch, i, n, wanted, pixels, scratch, out);
    case Care::edge_on:
      return;
  }
}

bool collect(const TileView& view, std::span<const Entry> entries, const PixelMask& wanted, Pixels& pixels,
             KernelScratch& scratch, std::size_t most, std::vector<Fragment>& out) {
  const std::size_t lanes = hn::Lanes(DF());
  const unsigned full = static_cast<unsigned>((std::uint64_t{1} << lanes) - 1);
  for (std::size_t i = 0; i < tile_pixels; i += lanes) {
    const unsigned bits = static_cast<unsigned>(wanted[i / block_pixels]) >> (i % block_pixels) & full;
    pixels.live[i] = static_cast<std::uint8_t>(bits != 0);
  }
  const CellBatch& batch = scratch.batch;
  for (std::size_t begin = 0; begin < entries.size(); begin += batch_cells) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(batch_cells, entries.size() - begin));
    setUp(view, cells, entries.subspan(begin + cells.size()), scratch.batch);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (batch.care[i] == Care::edge_on) {
        view.hand_back.take(view.hand_back.self, cells[i]);
        continue;
      }
      const std::size_t n = coverCell(view, batch, i, pixels, scratch.covered);
      if (n == 0) continue;
      if (batch.parallel) {
        collectAny<true>(view, batch, i, n, wanted, pixels, scratch, out);
      } else {
        collectAny<false>(view, batch, i, n, wanted, pixels, scratch, out);
      }
    }
    if (out.size() > most) return false;
  }
  return true;
}

std::size_t boxes(const Place* places, const mesh::Id* corners, const Box& region, std::size_t first, std::size_t last,
                  TileBox* out) {
  // Wider than the rounding of a place in float anywhere in the largest image.
  constexpr float margin = 0.01F;
  const DF d;
  const hn::RebindToSigned<DF> di;
  const hn::RebindToUnsigned<DF> du;
  const std::size_t lanes = hn::Lanes(d);
  const float* base = &places->x;
  const VF x0 = hn::Set(d, static_cast<float>(region.x0)), x1 = hn::Set(d, static_cast<float>(region.x1 - 1));
  const VF y0 = hn::Set(d, static_cast<float>(region.y0)), y1 = hn::Set(d, static_cast<float>(region.y1 - 1));
  for (; first + lanes <= last; first += lanes) {
    hn::Vec<decltype(du)> id[4];
    hn::LoadInterleaved4(du, corners + 4 * first, id[0], id[1], id[2], id[3]);
    VF lo_x = hn::Set(d, not_a_place), lo_y = lo_x;
    VF hi_x = hn::Neg(lo_x), hi_y = hi_x;
    for (const auto& k : id) {
      const auto index = hn::BitCast(di, hn::Add(k, k));
      const VF x = hn::GatherIndex(d, base, index);
      const VF y = hn::GatherIndex(d, base + 1, index);
      lo_x = hn::Min(lo_x, x);
      hi_x = hn::Max(hi_x, x);
      lo_y = hn::Min(lo_y, y);
      hi_y = hn::Max(hi_y, y);
    }
    const auto behind = hn::Eq(hi_x, hn::Set(d, not_a_place));
    const VF a = hn::Max(hn::Ceil(hn::Sub(lo_x, hn::Set(d, 0.5F + margin))), x0);
    const VF b = hn::Max(hn::Ceil(hn::Sub(lo_y, hn::Set(d, 0.5F + margin))), y0);
    const VF c = hn::Min(hn::Floor(hn::Sub(hi_x, hn::Set(d, 0.5F - margin))), x1);
    const VF e = hn::Min(hn::Floor(hn::Sub(hi_y, hn::Set(d, 0.5F - margin))), y1);
    const auto none = hn::Or(hn::Gt(a, c), hn::Gt(b, e));
    static_assert(tile_size == 1 << tile_shift);
    const auto tile = [&](VF pixel, VF corner) HWY_ATTR {
      return hn::BitCast(du, hn::ShiftRight<tile_shift>(hn::ConvertTo(di, hn::Sub(pixel, corner))));
    };
    auto box = hn::Or(hn::Or(tile(a, x0), hn::ShiftLeft<8>(tile(b, y0))),
                      hn::Or(hn::ShiftLeft<16>(tile(c, x0)), hn::ShiftLeft<24>(tile(e, y0))));
    box = hn::IfThenElse(hn::RebindMask(du, none), hn::Set(du, no_tiles), box);
    box = hn::IfThenElse(hn::RebindMask(du, behind), hn::Set(du, unknown_tiles), box);
    hn::StoreU(box, du, out + first);
  }
  return first;
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::composite::native {

HWY_EXPORT(clear);
HWY_EXPORT(store);
HWY_EXPORT(paint);
HWY_EXPORT(boxes);
HWY_EXPORT(whole);
HWY_EXPORT(collect);
HWY_EXPORT(wholeFragments);
HWY_EXPORT(findOpaque);

void clearPixels(const TileView& view, Pixels& pixels) {
  HWY_DYNAMIC_DISPATCH(clear)(view, pixels);
}

void storePixels(const Pixels& pixels, int width, int height, float* out, std::size_t stride) {
  HWY_DYNAMIC_DISPATCH(store)(pixels, width, height, out, stride);
}

std::size_t paintTetrahedra(const TileView& view, std::span<const Entry> entries, Pixels& pixels,
                            KernelScratch& scratch) {
  return HWY_DYNAMIC_DISPATCH(paint)(view, entries, pixels, scratch);
}

std::size_t boxTetrahedra(const Place* places, const mesh::Id* corners, const Box& region, std::size_t first,
                          std::size_t last, TileBox* boxes) {
  return HWY_DYNAMIC_DISPATCH(boxes)(places, corners, region, first, last, boxes);
}

bool collectTetrahedra(const TileView& view, std::span<const Entry> entries, const PixelMask& wanted, Pixels& pixels,
                       KernelScratch& scratch, std::size_t most, std::vector<Fragment>& out) {
  return HWY_DYNAMIC_DISPATCH(collect)(view, entries, wanted, pixels, scratch, most, out);
}

std::size_t paintWhole(const TileView& view, const WholeCell& cell, Pixels& pixels, KernelScratch& scratch) {
  return HWY_DYNAMIC_DISPATCH(whole)(view, cell, pixels, scratch);
}

void collectWhole(const TileView& view, const WholeCell& cell, const PixelMask& wanted, const Pixels& pixels,
                  KernelScratch& scratch, std::vector<Fragment>& out) {
  HWY_DYNAMIC_DISPATCH(wholeFragments)(view, cell, wanted, pixels, scratch, out);
}

bool markOpaque(Pixels& pixels) {
  return HWY_DYNAMIC_DISPATCH(findOpaque)(pixels);
}

std::vector<const char*> kernelTargets() {
  std::vector<const char*> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
    names.push_back(hwy::TargetName(target));
  return names;
}

void chooseKernelTarget(int index) {
  hwy::SetSupportedTargetsForTest(0);
  if (index >= 0) {
    hwy::SetSupportedTargetsForTest(hwy::SupportedAndGeneratedTargets().at(static_cast<std::size_t>(index)));
  }
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace spillikin::composite::native
#endif
