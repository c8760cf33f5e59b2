// A tile before the first cell and after the last: cleared pixels with the lengths of their rays, and the way from a
// tile's blocks to an image's rows. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_CANVAS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_CANVAS_INL_H
#undef SPILLIKIN_NATIVE_CANVAS_INL_H
#else
#define SPILLIKIN_NATIVE_CANVAS_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "spillikin/composite/native_centres-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_thin-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Directions are linear in the pixel; relative to the tile's corner float keeps their lengths to a unit in the last
// place or two.
void clear(const TileView& view, Pixels& pixels) {
  const DF d;
  const project::Camera& camera = view.screen->frame().camera;
  const Vec3 corner = camera.direction(view.x0, view.y0);
  const auto component = [&](int k, VF x, VF y) HWY_ATTR {
    const auto set = [&](double v) HWY_ATTR { return hn::Set(d, static_cast<float>(v)); };
    return hn::MulAdd(set(camera.directionDx()[k]), x, hn::MulAdd(set(camera.directionDy()[k]), y, set(corner[k])));
  };
  for (std::size_t i = 0; i < tile_pixels; i += hn::Lanes(d)) {
    for (auto* channel : {&pixels.red, &pixels.green, &pixels.blue})
      hn::Store(hn::Zero(d), d, channel->data() + i);
    hn::Store(hn::Set(d, 1.0F), d, pixels.light.data() + i);
    hn::Store(hn::Set(d, std::numeric_limits<float>::infinity()), d, pixels.last.data() + i);
    const VF x = centresX(i), y = centresY(i);
    const VF u = component(0, x, y), v = component(1, x, y), w = component(2, x, y);
    hn::Store(hn::Sqrt(hn::MulAdd(u, u, hn::MulAdd(v, v, hn::Mul(w, w)))), d, pixels.length.data() + i);
  }
  pixels.flagged.fill(0);
  pixels.live = ~std::uint64_t{0};
}

// Four rows of a tile as the image has them.
struct Rows {
  static constexpr std::size_t row = std::size_t{4} * tile_size;
  alignas(64) float rgba[4][row];
};

HWY_INLINE void interleave(const Pixels& pixels, std::size_t block_row, Rows& rows) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  alignas(64) float rgba[4 * block_pixels];
  for (std::size_t bx = 0; bx < block_columns; ++bx) {
    const std::size_t first = (block_row * block_columns + bx) * block_pixels;
    for (std::size_t sub = 0; sub < block_pixels; sub += lanes) {
      const auto load = [&](const auto& channel) HWY_ATTR { return hn::Load(d, channel.data() + first + sub); };
      hn::StoreInterleaved4(load(pixels.red), load(pixels.green), load(pixels.blue),
                            hn::Sub(hn::Set(d, 1.0F), load(pixels.light)), d, rgba + 4 * sub);
    }
    for (std::size_t y = 0; y < 4; ++y)
      std::memcpy(rows.rgba[y] + 16 * bx, rgba + 16 * y, 16 * sizeof(float));
  }
}

// Whole vectors go past the cache: an image is larger than that, and nothing of it is read while it is drawn.
HWY_INLINE void streamRow(const float* from, std::size_t count, float* to) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t vector_bytes = lanes * sizeof(float);
  const std::size_t behind = reinterpret_cast<std::uintptr_t>(to) % vector_bytes;
  std::size_t i = behind == 0 ? 0 : std::min((vector_bytes - behind) / sizeof(float), count);
  std::memcpy(to, from, i * sizeof(float));
  for (; i + lanes <= count; i += lanes)
    hn::Stream(hn::LoadU(d, from + i), d, to + i);
  std::memcpy(to + i, from + i, (count - i) * sizeof(float));
}

void store(const Pixels& pixels, int width, int height, float* out, std::size_t stride) {
  Rows rows;
  const std::size_t count = 4 * static_cast<std::size_t>(width);
  for (int by = 0; 4 * by < height; ++by) {
    interleave(pixels, static_cast<std::size_t>(by), rows);
    for (int y = 0; y < 4 && 4 * by + y < height; ++y, out += stride)
      streamRow(rows.rgba[y], count, out);
  }
  hwy::FlushStream();
}

// What store() writes of pixels that nothing has been drawn on.
void blank(int width, int height, float* out, std::size_t stride) {
  alignas(64) constexpr float none[Rows::row] = {};
  for (int y = 0; y < height; ++y, out += stride)
    streamRow(none, 4 * static_cast<std::size_t>(width), out);
  hwy::FlushStream();
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
