// The pixels of a screen tile while cells are composited onto them: premultiplied colour, the light that still comes
// through, and where the last fragment ended. Blocks of 4 by 4 pixels are contiguous, so that a vector covers as
// compact a patch as it can; the whole state fits the first level of cache.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_bins.h"

namespace spillikin::composite::native {

inline constexpr int tile_pixels = tile_size * tile_size;
inline constexpr int block_pixels = 16;  // 4 by 4, row by row
inline constexpr int block_columns = tile_size / 4;
inline constexpr int tile_blocks = tile_pixels / block_pixels;

// Light that still comes through below this is taken as none: an error of at most a hundredth of a display step.
inline constexpr float opaque_light = 4e-5F;

// A fragment that begins before the last one's end by more than this share of the mesh's depth proves an inversion;
// float's rounding of two neighbouring depths stays below it.
inline constexpr double overlap_tolerance = 2e-5;

// A fragment shorter than this share of that tolerance takes no part in the certificate.
inline constexpr float solid_share = 0.25F;

inline constexpr std::size_t pixelIndex(int x, int y) {
  // NOLINTNEXTLINE(bugprone-misplaced-widening-cast): a place within one tile
  return static_cast<std::size_t>(((y >> 2) * block_columns + (x >> 2)) * block_pixels + (y & 3) * 4 + (x & 3));
}

inline constexpr std::int32_t pixelColumn(std::size_t pixel) {
  return static_cast<std::int32_t>(pixel / block_pixels % block_columns * 4 + pixel % 4);
}
inline constexpr std::int32_t pixelRow(std::size_t pixel) {
  return static_cast<std::int32_t>(pixel / block_pixels / block_columns * 4 + pixel % block_pixels / 4);
}

// Some pixels of a tile, a bit each, by block.
using PixelMask = std::array<std::uint16_t, tile_blocks>;
inline void addPixel(PixelMask& mask, std::size_t pixel) {
  mask[pixel / block_pixels] |= static_cast<std::uint16_t>(1U << (pixel % block_pixels));
}
inline bool hasPixel(const PixelMask& mask, std::size_t pixel) {
  return (mask[pixel / block_pixels] >> (pixel % block_pixels) & 1U) != 0;
}

// Structure of arrays over pixelIndex.
struct Pixels {
  // Arrays a power of two apart would lie in the same sets of a cache, and a core takes a load for one of what it has
  // just stored where only the low twelve bits of their addresses are the same: a block's lines lie five lines apart.
  struct alignas(64) PerPixel : std::array<float, tile_pixels> {
    std::array<float, std::size_t{5} * 16> unused;
  };
  PerPixel red, green, blue, light;
  PerPixel last;                 // nearness at which the last fragment ended
  PerPixel length;               // world length of a unit of depth on the pixel's ray
  PerPixel clip_near, clip_far;  // the range of nearness that clip planes and the eye leave
  PixelMask flagged;             // where an inversion was found
  std::uint64_t live;            // a bit for each block to which more cells may come

  bool isLive(std::size_t pixel) const { return (live >> (pixel / block_pixels) & 1U) != 0; }
};
static_assert(tile_blocks == 64);

}  // namespace spillikin::composite::native
