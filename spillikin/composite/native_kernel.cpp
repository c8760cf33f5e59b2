#include "spillikin/composite/native_kernel.h"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

// Once for each instruction set; the best that the machine has is taken at run time.
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/composite/native_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spillikin/composite/native_canvas-inl.h"
#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_crossing-inl.h"
#include "spillikin/composite/native_paint-inl.h"
#include "spillikin/composite/native_setup-inl.h"
#include "spillikin/composite/native_shade-inl.h"
#include "spillikin/composite/native_small-inl.h"
#include "spillikin/composite/native_tiny-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Whether rays must be kept within the pixels' ranges in cell i.
HWY_INLINE bool limited(const TileView& view, const CellBatch& batch, std::size_t i) {
  return view.clipped || batch.straddles[i] != 0;
}

// What checks and shades the fragments of a cell, from where they begin and end; `kept`, the scalar is not let out of
// the cell's range.
template <bool Parallel, class S, bool kept = false>
class Shading {
 public:
  static constexpr bool short_chain = false;
  HWY_INLINE Shading(const TileView& view, const CellBatch& batch, std::size_t i)
      : shader_(batch.look(view.screen->pieces().data(), i)),
        rays_(view, batch, i, shader_.anchor()),
        lo_(hn::Set(DF(), batch.lo[i] - shader_.anchor())),
        hi_(hn::Set(DF(), batch.hi[i] - shader_.anchor())) {}

  template <class V, class M, class At>
  HWY_INLINE void check(const Certificate& certificate, const V& near, const V& far, const M& inside, const At& first,
                        Pixels& pixels) const {
    certificate.check(near, far, inside, first, pixels);
  }

  template <class V, class M, class At>
  HWY_INLINE void blend(const Crossed<V>& ray, const M& inside, const At& first, Pixels& pixels) const {
    const V unit = wide::load(pixels.length.data(), first);
    SegmentOf<V> segment = rays_(ray, inside, unit);
    if constexpr (kept) segment = segment.within(lo_, hi_);
    shader_.blend(segment, first, pixels);
  }

 private:
  S shader_;
  Rays<Parallel> rays_;
  VF lo_, hi_;
};

// One cell onto the pixels. Returns its fragments.
template <class Shade>
HWY_NOINLINE std::size_t paintCell(const TileView& view, const CellForms& forms, const CellBatch& batch, std::size_t i,
                                   std::uint64_t blocks, Pixels& pixels) {
  return paintCrossed<Shade>(Crossing(forms, batch, i, pixels, limited(view, batch, i)), view, batch, i, blocks,
                             pixels);
}

template <bool Parallel>
HWY_INLINE std::size_t paintKind(const TileView& view, const CellForms& forms, const CellBatch& batch, std::size_t i,
                                 std::uint64_t blocks, Pixels& pixels) {
  const auto paint = [&](auto shade) HWY_ATTR {
    return paintCell<typename decltype(shade)::type>(view, forms, batch, i, blocks, pixels);
  };
  const auto by = [&](auto shader) HWY_ATTR {
    return paint(std::type_identity<Shading<Parallel, typename decltype(shader)::type>>());
  };
  switch (batch.kind[i]) {
    case Kind::tiny:
    case Kind::tiny_curved:
    case Kind::tiny_bend:
    case Kind::small_curved:
    case Kind::small:
    case Kind::small_bends1:
    case Kind::small_bends2:
    case Kind::small_bends3:
    case Kind::small_bends4:
      return withSmallShading<Parallel>(batch.kind[i], paint);
    case Kind::small_bends:
      return paint(std::type_identity<SmallShading<Parallel, any_bends>>());
    case Kind::none:
      return by(std::type_identity<Shader<Care::none>>());
    case Kind::bend:
      return by(std::type_identity<Shader<Care::bend>>());
    case Kind::bends1:
      return by(std::type_identity<StraightShader<ShortSeries, 1>>());
    case Kind::bends2:
      return by(std::type_identity<StraightShader<ShortSeries, 2>>());
    case Kind::bends3:
      return by(std::type_identity<StraightShader<ShortSeries, 3>>());
    case Kind::bends4:
      return by(std::type_identity<StraightShader<ShortSeries, 4>>());
    case Kind::bends:
      return by(std::type_identity<Shader<Care::bends>>());
    case Kind::long0:
      return by(std::type_identity<StraightShader<ForwardSeries, 0>>());
    case Kind::long1:
      return by(std::type_identity<StraightShader<ForwardSeries, 1>>());
    case Kind::long2:
      return by(std::type_identity<StraightShader<ForwardSeries, 2>>());
    case Kind::long3:
      return by(std::type_identity<StraightShader<ForwardSeries, 3>>());
    case Kind::long4:
      return by(std::type_identity<StraightShader<ForwardSeries, 4>>());
    case Kind::longs:
      return by(std::type_identity<Shader<Care::long_bends>>());
    case Kind::kept:
      return paint(std::type_identity<Shading<Parallel, Shader<Care::long_bends>, true>>());
    case Kind::cut:
      return by(std::type_identity<Shader<Care::cut>>());
    case Kind::cuts:
      return by(std::type_identity<Shader<Care::cuts>>());
    case Kind::deep:
      return by(std::type_identity<Shader<Care::deep>>());
    case Kind::peak:
      return by(std::type_identity<Shader<Care::peak>>());
    case Kind::full:
    case Kind::edge_on:
      break;
  }
  return by(std::type_identity<Shader<Care::full>>());
}

template <bool Parallel>
std::size_t paintBatch(const TileView& view, std::span<const Entry> cells, const CellBatch& batch, Pixels& pixels) {
  const auto isEdgeOn = [&](std::size_t i) HWY_ATTR { return HWY_UNLIKELY(batch.kind[i] == Kind::edge_on); };
  const auto blocksOf = [&](std::size_t i) HWY_ATTR { return batch.blockBits(i) & pixels.live; };
  // The first to be painted, or to be handed back, from i on.
  const auto next = [&](std::size_t i) HWY_ATTR {
    while (i < cells.size() && !isEdgeOn(i) && blocksOf(i) == 0)
      ++i;
    return i;
  };
  // Those of a cell are set while the one before it is painted, so that no pixel waits for them.
  CellForms forms[2];
  std::size_t fragments = 0, i = next(0);
  if (i < cells.size()) setForms(batch, i, forms[0]);
  for (std::size_t turn = 0; i < cells.size(); turn ^= 1U) {
    const std::size_t after = next(i + 1);
    if (after < cells.size()) setForms(batch, after, forms[turn ^ 1U]);
    if (isEdgeOn(i)) {
      view.hand_back.take(view.hand_back.self, cells[i]);
    } else {
      fragments += paintKind<Parallel>(view, forms[turn], batch, i, blocksOf(i), pixels);
    }
    i = after;
  }
  return fragments;
}

// The vectors that cell i covers, vector by vector.
HWY_NOINLINE std::size_t coverCell(const TileView& view, const CellBatch& batch, std::size_t i, const Pixels& pixels,
                                   Coverage& out) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  CellForms forms;
  setForms(batch, i, forms);
  const Crossing crossing(forms, batch, i, pixels, limited(view, batch, i));
  std::size_t n = 0;
  const auto keep = [&](const VF& near, const VF& far, std::size_t first) HWY_ATTR {
    hn::Store(near, d, out.near + n * lanes);
    hn::Store(far, d, out.far + n * lanes);
    out.pixel[n] = static_cast<std::uint32_t>(first);
    // No branch on what is as good as random: an empty vector's place is taken by the next one.
    n += static_cast<std::size_t>(!hn::AllFalse(d, hn::Gt(near, far)));
  };
  byTwoBlocks(batch.blockBits(i) & pixels.live, [&](const auto& first) HWY_ATTR {
    const auto ray = crossing(first);
    if constexpr (wide::is_two<std::remove_cvref_t<decltype(first)>>) {
      keep(ray.near.a, ray.far.a, first.a);
      keep(ray.near.b, ray.far.b, first.b);
    } else {
      keep(ray.near, ray.far, first);
    }
  });
  return n;
}

// Marks the blocks without light as done with; true when the whole tile is. What follows them is behind, if the order
// is to be trusted.
bool findOpaque(Pixels& pixels) {
  const DF d;
  const VF threshold = hn::Set(d, opaque_light);
  pixels.live = 0;
  for (std::size_t block = 0; block < tile_blocks; ++block) {
    bool light = false;
    for (std::size_t sub = 0; sub < block_pixels; sub += hn::Lanes(d)) {
      light =
          light || !hn::AllTrue(d, hn::Lt(hn::Load(d, pixels.light.data() + block * block_pixels + sub), threshold));
    }
    pixels.live |= std::uint64_t{light} << block;
  }
  return pixels.live == 0;
}

// Looking for opaque pixels takes as long as a few cells.
constexpr std::size_t batches_between_looks = 4;

std::size_t paint(const TileView& view, std::span<const Entry> entries, Pixels& pixels, KernelScratch& scratch) {
  CellBatch& batch = scratch.batch;
  const bool parallel = view.screen->parallel();
  std::size_t fragments = 0;
  for (std::size_t begin = 0; begin < entries.size(); begin += batch_cells) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(batch_cells, entries.size() - begin));
    setUp(view, cells, entries.subspan(begin + cells.size()), batch);
    fragments +=
        parallel ? paintBatch<true>(view, cells, batch, pixels) : paintBatch<false>(view, cells, batch, pixels);
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
  const FormV at({batch.at[0][i], batch.at[1][i], batch.at[2][i] - shader.anchor()});
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
    const Crossed<VF> ray{near, far, at(first)};
    shader.blend(rays(ray, inside, hn::Load(d, pixels.length.data() + first)), first, blank);
    for (std::size_t lane = 0; bits != 0; ++lane, bits >>= 1U) {
      const std::size_t p = first + lane;
      if ((bits & 1U) == 0) continue;
      out.push_back({covered.near[k * lanes + lane], covered.far[k * lanes + lane], blank.red[p], blank.green[p],
                     blank.blue[p], blank.light[p], static_cast<std::uint32_t>(p)});
    }
  }
}

template <bool Parallel>
void collectAny(const TileView& view, const CellBatch& batch, std::size_t i, std::size_t n, const PixelMask& wanted,
                const Pixels& pixels, KernelScratch& scratch, std::vector<Fragment>& out) {
  switch (batch.kind[i]) {
    case Kind::none:
      return collectCell<Parallel, Care::none>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::bend:
      return collectCell<Parallel, Care::bend>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::tiny:
    case Kind::tiny_curved:
    case Kind::tiny_bend:
    case Kind::small_curved:
    case Kind::small:
    case Kind::small_bends1:
    case Kind::small_bends2:
    case Kind::small_bends3:
    case Kind::small_bends4:
    case Kind::small_bends:
    case Kind::bends1:
    case Kind::bends2:
    case Kind::bends3:
    case Kind::bends4:
    case Kind::bends:
      return collectCell<Parallel, Care::bends>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::long0:
    case Kind::long1:
    case Kind::long2:
    case Kind::long3:
    case Kind::long4:
    case Kind::longs:
      return collectCell<Parallel, Care::long_bends>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::cut:
      return collectCell<Parallel, Care::cut>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::cuts:
      return collectCell<Parallel, Care::cuts>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::deep:
      return collectCell<Parallel, Care::deep>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::kept:
    case Kind::full:
      return collectCell<Parallel, Care::full>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::peak:  // needs no order
    case Kind::edge_on:
      return;
  }
}

bool collect(const TileView& view, std::span<const Entry> entries, const PixelMask& wanted, Pixels& pixels,
             KernelScratch& scratch, std::size_t most, std::vector<Fragment>& out) {
  lookAtWanted(wanted, pixels);
  const CellBatch& batch = scratch.batch;
  for (std::size_t begin = 0; begin < entries.size(); begin += batch_cells) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(batch_cells, entries.size() - begin));
    setUp(view, cells, entries.subspan(begin + cells.size()), scratch.batch);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (batch.kind[i] == Kind::edge_on) {
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
      return hn::BitCast(du, hn::ShiftRight<tile_shift>(wholeNumber(d, hn::Sub(pixel, corner))));
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
HWY_EXPORT(blank);
HWY_EXPORT(paint);
HWY_EXPORT(boxes);
HWY_EXPORT(collect);
HWY_EXPORT(findOpaque);

void clearPixels(const TileView& view, Pixels& pixels) {
  HWY_DYNAMIC_DISPATCH(clear)(view, pixels);
}

void storePixels(const Pixels& pixels, int width, int height, float* out, std::size_t stride) {
  HWY_DYNAMIC_DISPATCH(store)(pixels, width, height, out, stride);
}

void storeBlank(int width, int height, float* out, std::size_t stride) {
  HWY_DYNAMIC_DISPATCH(blank)(width, height, out, stride);
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
