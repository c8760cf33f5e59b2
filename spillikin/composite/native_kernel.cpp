#include "spillikin/composite/native_kernel.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

// Once for each instruction set; the best that the machine has is taken at run time.
#define HWY_DISABLED_TARGETS (HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/composite/native_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spillikin/composite/native_centres.h"
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

// The fragments of one cell on one tile, vector by vector: where each vector lies and where its rays enter and leave.
struct Coverage {
  alignas(64) float near[tile_pixels];
  alignas(64) float far[tile_pixels];
  std::uint32_t pixel[tile_pixels + 1];  // index of the vector's first pixel
  std::uint32_t row[tile_pixels + 1];    // offsets of its centres in Centres::y
  std::uint32_t column[tile_pixels + 1];
};

template <unsigned Entered, bool Clipped>
HWY_INLINE std::size_t cover(const TileView& view, const CellBatch& batch, std::size_t i, const Pixels& pixels,
                             Coverage& out) {
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
  for (int by = batch.block_y0[i]; by <= batch.block_y1[i]; ++by) {
    for (std::size_t sub = 0; sub < block_pixels; sub += lanes) {
      const VF y = hn::Load(d, centres.y[by] + sub);
      const VF r0 = hn::MulAdd(y0, y, t0);
      const VF r1 = hn::MulAdd(y1, y, t1);
      const VF r2 = hn::MulAdd(y2, y, t2);
      const VF r3 = hn::MulAdd(y3, y, t3);
      for (int bx = batch.block_x0[i]; bx <= batch.block_x1[i]; ++bx) {
        const VF x = hn::Load(d, centres.x[bx] + sub);
        const VF z0 = hn::MulAdd(x0, x, r0);
        const VF z1 = hn::MulAdd(x1, x, r1);
        const VF z2 = hn::MulAdd(x2, x, r2);
        const VF z3 = hn::MulAdd(x3, x, r3);
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
        const auto first = static_cast<std::size_t>((by * block_columns + bx) * block_pixels) + sub;
        if constexpr (Clipped) {
          near = hn::Min(near, hn::Load(d, pixels.clip_near.data() + first));
          far = hn::Max(far, hn::Load(d, pixels.clip_far.data() + first));
        }
        hn::Store(near, d, out.near + n * lanes);
        hn::Store(far, d, out.far + n * lanes);
        out.pixel[n] = static_cast<std::uint32_t>(first);
        out.row[n] = static_cast<std::uint32_t>(static_cast<std::size_t>(by) * block_pixels + sub);
        out.column[n] = static_cast<std::uint32_t>(static_cast<std::size_t>(bx) * block_pixels + sub);
        // No branch on what is as good as random: an empty vector's place is taken by the next one.
        const bool some = !hn::AllFalse(d, hn::Gt(near, far));
        n += static_cast<std::size_t>(some & ((pixels.opaque[first] == 0) | !view.trusted));
      }
    }
  }
  return n;
}

template <bool Clipped>
HWY_INLINE std::size_t coverAny(const TileView& view, const CellBatch& batch, std::size_t i, const Pixels& pixels,
                                Coverage& out) {
  switch (face_order.entered[batch.code[i]]) {
    case 0:
      return batch.parallel ? 0 : cover<0, true>(view, batch, i, pixels, out);
    case 1:
      return cover<1, Clipped>(view, batch, i, pixels, out);
    case 2:
      return cover<2, Clipped>(view, batch, i, pixels, out);
    case 3:
      return cover<3, Clipped>(view, batch, i, pixels, out);
    default:
      return 0;
  }
}

template <bool Parallel, bool Simple>
HWY_INLINE std::size_t shadeCell(const TileView& view, const CellBatch& batch, std::size_t i, const Coverage& covered,
                                 std::size_t count, Pixels& pixels) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Shader<Parallel, Simple> shader(view, batch, i);
  const VF overlap_at = hn::Set(d, view.overlap_at);
  const VF overlap_slope = hn::Set(d, 1.0F + view.overlap_slope);
  std::size_t fragments = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = covered.pixel[k];
    const VF near = hn::Load(d, covered.near + k * lanes);
    const VF far = hn::Load(d, covered.far + k * lanes);
    const auto inside = hn::Gt(near, far);
    fragments += hn::CountTrue(d, inside);
    // The certificate: behind where the last fragment ended, up to rounding.
    const VF last = hn::Load(d, pixels.last.data() + first);
    hn::Store(hn::IfThenElse(inside, far, last), d, pixels.last.data() + first);
    const auto early = hn::And(inside, hn::Gt(near, hn::MulAdd(last, overlap_slope, overlap_at)));
    if (HWY_UNLIKELY(!hn::AllFalse(d, early))) {
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, early, bits);
      const unsigned mask = static_cast<unsigned>(bits[0]) | static_cast<unsigned>(bits[1]) << 8U;
      pixels.flagged[first / block_pixels] |= static_cast<std::uint16_t>(mask << (first % block_pixels));
    }
    shader.blend(near, far, inside, covered.row[k], covered.column[k], first, pixels);
  }
  return fragments;
}

template <bool Parallel, bool Clipped>
std::size_t paintBatch(const TileView& view, const CellBatch& batch, std::size_t count, Pixels& pixels,
                       Coverage& covered) {
  std::size_t fragments = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (batch.block_x0[i] > batch.block_x1[i] || batch.block_y0[i] > batch.block_y1[i]) continue;
    std::size_t n;
    if (Clipped || batch.straddles[i] != 0) {
      n = coverAny<true>(view, batch, i, pixels, covered);
    } else {
      n = coverAny<false>(view, batch, i, pixels, covered);
    }
    if (n == 0) continue;
    if (batch.simple[i] != 0) {
      fragments += shadeCell<Parallel, true>(view, batch, i, covered, n, pixels);
    } else {
      fragments += shadeCell<Parallel, false>(view, batch, i, covered, n, pixels);
    }
  }
  return fragments;
}

// Marks the vectors without light; true when there is none left in the whole tile.
bool findOpaque(Pixels& pixels) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const VF threshold = hn::Set(d, opaque_light);
  bool all = true;
  for (std::size_t i = 0; i < tile_pixels; i += lanes) {
    const bool dark = hn::AllTrue(d, hn::Lt(hn::Load(d, pixels.light.data() + i), threshold));
    pixels.opaque[i] = static_cast<std::uint8_t>(dark);
    all = all && dark;
  }
  return all;
}

std::size_t paint(const TileView& view, std::span<const Entry> entries, Pixels& pixels) {
  static thread_local CellBatch batch;
  static thread_local Coverage covered;
  const bool parallel = view.screen->parallel();
  std::size_t fragments = 0;
  // An opaque tile is looked for ever more rarely where none is in sight.
  std::size_t until_look = 8;
  std::size_t look = until_look;
  for (std::size_t begin = 0; begin < entries.size(); begin += batch_cells) {
    const auto cells = entries.subspan(begin, std::min<std::size_t>(batch_cells, entries.size() - begin));
    setUp(view, cells, entries.subspan(begin + cells.size()), batch);
    if (parallel) {
      fragments += view.clipped ? paintBatch<true, true>(view, batch, cells.size(), pixels, covered)
                                : paintBatch<true, false>(view, batch, cells.size(), pixels, covered);
    } else {
      fragments += view.clipped ? paintBatch<false, true>(view, batch, cells.size(), pixels, covered)
                                : paintBatch<false, false>(view, batch, cells.size(), pixels, covered);
    }
    if (--look == 0) {
      if (findOpaque(pixels) && view.trusted) break;
      look = until_look;
    }
  }
  return fragments;
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::composite::native {

HWY_EXPORT(paint);

std::size_t paintTetrahedra(const TileView& view, std::span<const Entry> entries, Pixels& pixels) {
  return HWY_DYNAMIC_DISPATCH(paint)(view, entries, pixels);
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
