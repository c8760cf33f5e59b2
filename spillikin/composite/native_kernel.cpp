#include "spillikin/composite/native_kernel.h"

#include <algorithm>
#include <array>
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
#include "spillikin/composite/native_setup-inl.h"
#include "spillikin/composite/native_shade-inl.h"

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

// Steps through the blocks of a box, row by row, as the first pixels of each.
class Blocks {
 public:
  HWY_INLINE Blocks(const CellBatch& batch, std::size_t i)
      : columns_(static_cast<std::size_t>(batch.block_x1[i] + 1 - batch.block_x0[i])),
        count_(columns_ * static_cast<std::size_t>(batch.block_y1[i] + 1 - batch.block_y0[i])),
        at_(block_pixels * static_cast<std::size_t>(batch.block_y0[i] * block_columns + batch.block_x0[i])) {}
  HWY_INLINE std::size_t count() const { return count_; }
  HWY_INLINE std::size_t next() {
    const std::size_t first = at_;
    ++column_;
    const bool end = column_ == columns_;
    at_ += block_pixels + (end ? block_pixels * (block_columns - columns_) : 0);
    column_ = end ? 0 : column_;
    return first;
  }

 private:
  std::size_t columns_, count_, at_, column_ = 0;
};

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
  std::size_t n = 0;
  const auto keep = [&](const VF& near, const VF& far, std::size_t first) HWY_ATTR {
    hn::Store(near, d, out.near + n * lanes);
    hn::Store(far, d, out.far + n * lanes);
    out.pixel[n] = static_cast<std::uint32_t>(first);
    // No branch on what is as good as random: an empty vector's place is taken by the next one.
    const bool some = !hn::AllFalse(d, hn::Gt(near, far));
    n += static_cast<std::size_t>(some) & pixels.live[first];
  };
  const auto coverAt = [&](const auto& first) HWY_ATTR {
    const auto x = centresX(first), y = centresY(first);
    using V = std::remove_const_t<decltype(x)>;
    const V z0 = wide::MulAdd(x0, x, wide::MulAdd(y0, y, t0));
    const V z1 = wide::MulAdd(x1, x, wide::MulAdd(y1, y, t1));
    const V z2 = wide::MulAdd(x2, x, wide::MulAdd(y2, y, t2));
    const V z3 = wide::MulAdd(x3, x, wide::MulAdd(y3, y, t3));
    V near, far;
    if constexpr (Entered == 0) {
      near = wide::same<V>(eye);
      far = wide::Max(wide::Max(z0, z1), wide::Max(z2, z3));
    } else if constexpr (Entered == 1) {
      near = z0;
      far = wide::Max(wide::Max(z1, z2), z3);
    } else if constexpr (Entered == 2) {
      near = wide::Min(z0, z1);
      far = wide::Max(z2, z3);
    } else {
      near = wide::Min(wide::Min(z0, z1), z2);
      far = z3;
    }
    if constexpr (Clipped) {
      near = wide::Min(near, wide::load(pixels.clip_near.data(), first));
      far = wide::Max(far, wide::load(pixels.clip_far.data(), first));
    }
    if constexpr (wide::is_two<V>) {
      keep(near.a, far.a, first.a);
      keep(near.b, far.b, first.b);
    } else {
      keep(near, far, first);
    }
  };
  // One loop over rows and columns: two would end at as good as random.
  Blocks blocks(batch, i);
  std::size_t block = 0;
  for (; block + 1 < blocks.count(); block += 2) {
    const std::size_t a = blocks.next(), b = blocks.next();
    for (std::size_t sub = 0; sub < block_pixels; sub += lanes)
      coverAt(Two<std::size_t>{a + sub, b + sub});
  }
  if (block < blocks.count()) {
    const std::size_t a = blocks.next();
    for (std::size_t sub = 0; sub < block_pixels; sub += lanes)
      coverAt(a + sub);
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

// Vectors by twos: they are of different pixels.
template <bool Parallel, class S>
HWY_NOINLINE std::size_t shadeCell(const TileView& view, const CellBatch& batch, std::size_t i, const Coverage& covered,
                                   std::size_t count, Pixels& pixels) {
  const std::size_t lanes = hn::Lanes(DF());
  const S shader(batch.look(view.screen->pieces().data(), i));
  const Rays<Parallel> rays(view, batch, i, shader.anchor());
  const Certificate certificate(view);
  std::size_t fragments = 0;
  const auto shade = [&](const auto& first, const auto& at) HWY_ATTR {
    const auto near = wide::load(covered.near, at);
    const auto far = wide::load(covered.far, at);
    const auto inside = wide::Gt(near, far);
    fragments += wide::CountTrue(inside);
    certificate.check(near, far, inside, first, pixels);
    const auto unit = wide::load(pixels.length.data(), first);
    shader.blend(rays(near, far, inside, centresX(first), centresY(first), unit), first, pixels);
  };
  wide::byTwos(covered.pixel, count, lanes, shade);
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
HWY_INLINE std::size_t shadeKind(const TileView& view, const CellBatch& batch, std::size_t i, const Coverage& covered,
                                 std::size_t n, Pixels& pixels) {
  switch (batch.kind[i]) {
    case Kind::none:
      return shadeCell<Parallel, Shader<Care::none>>(view, batch, i, covered, n, pixels);
    case Kind::bend:
      return shadeCell<Parallel, Shader<Care::bend>>(view, batch, i, covered, n, pixels);
    case Kind::bends1:
      return shadeCell<Parallel, StraightShader<ThinSeries, 1>>(view, batch, i, covered, n, pixels);
    case Kind::bends2:
      return shadeCell<Parallel, StraightShader<ThinSeries, 2>>(view, batch, i, covered, n, pixels);
    case Kind::bends3:
      return shadeCell<Parallel, StraightShader<ThinSeries, 3>>(view, batch, i, covered, n, pixels);
    case Kind::bends4:
      return shadeCell<Parallel, StraightShader<ThinSeries, 4>>(view, batch, i, covered, n, pixels);
    case Kind::bends:
      return shadeCell<Parallel, Shader<Care::bends>>(view, batch, i, covered, n, pixels);
    case Kind::long0:
      return shadeCell<Parallel, StraightShader<ForwardSeries, 0>>(view, batch, i, covered, n, pixels);
    case Kind::long1:
      return shadeCell<Parallel, StraightShader<ForwardSeries, 1>>(view, batch, i, covered, n, pixels);
    case Kind::long2:
      return shadeCell<Parallel, StraightShader<ForwardSeries, 2>>(view, batch, i, covered, n, pixels);
    case Kind::long3:
      return shadeCell<Parallel, StraightShader<ForwardSeries, 3>>(view, batch, i, covered, n, pixels);
    case Kind::long4:
      return shadeCell<Parallel, StraightShader<ForwardSeries, 4>>(view, batch, i, covered, n, pixels);
    case Kind::longs:
      return shadeCell<Parallel, Shader<Care::long_bends>>(view, batch, i, covered, n, pixels);
    case Kind::cut:
      return shadeCell<Parallel, Shader<Care::cut>>(view, batch, i, covered, n, pixels);
    case Kind::cuts:
      return shadeCell<Parallel, Shader<Care::cuts>>(view, batch, i, covered, n, pixels);
    case Kind::deep:
      return shadeCell<Parallel, Shader<Care::deep>>(view, batch, i, covered, n, pixels);
    case Kind::peak:
      return shadeCell<Parallel, Shader<Care::peak>>(view, batch, i, covered, n, pixels);
    case Kind::full:
    case Kind::edge_on:
      break;
  }
  return shadeCell<Parallel, Shader<Care::full>>(view, batch, i, covered, n, pixels);
}

template <bool Parallel>
std::size_t paintBatch(const TileView& view, std::span<const Entry> cells, const CellBatch& batch, Pixels& pixels,
                       Coverage& covered) {
  std::size_t fragments = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (HWY_UNLIKELY(batch.kind[i] == Kind::edge_on)) {
      view.hand_back.take(view.hand_back.self, cells[i]);
      continue;
    }
    const std::size_t n = coverCell(view, batch, i, pixels, covered);
    if (n == 0) continue;
    fragments += shadeKind<Parallel>(view, batch, i, covered, n, pixels);
  }
  return fragments;
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

template <bool Parallel>
void collectAny(const TileView& view, const CellBatch& batch, std::size_t i, std::size_t n, const PixelMask& wanted,
                const Pixels& pixels, KernelScratch& scratch, std::vector<Fragment>& out) {
  switch (batch.kind[i]) {
    case Kind::none:
      return collectCell<Parallel, Care::none>(view, batch, i, n, wanted, pixels, scratch, out);
    case Kind::bend:
      return collectCell<Parallel, Care::bend>(view, batch, i, n, wanted, pixels, scratch, out);
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
