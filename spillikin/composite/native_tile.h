// One screen tile: its pixels while cells are composited onto them, and the certificate of their order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/composite/native_bins.h"
#include "spillikin/composite/native_cell.h"
#include "spillikin/composite/native_screen.h"

namespace spillikin::composite::native {

inline constexpr int tile_pixels = tile_size * tile_size;
inline constexpr int block_pixels = 16;  // a block is 4 by 4 pixels, contiguous, row by row
inline constexpr int block_columns = tile_size / 4;
inline constexpr int tile_blocks = tile_pixels / block_pixels;

// Light that still comes through below this is taken as none: an error of at most a hundredth of a display step.
inline constexpr float opaque_light = 4e-5F;

// A fragment that begins before the last one's end by more than this share of the mesh's depth proves an inversion;
// float's rounding of two neighbouring depths stays below it.
inline constexpr double overlap_tolerance = 2e-5;

// The same in double precision, where the fragments of a pixel have been put in order: beyond it the cells themselves
// overlap in space.
inline constexpr double resolved_tolerance = 1e-9;

inline int pixelIndex(int x, int y) {
  return ((y >> 2) * block_columns + (x >> 2)) * block_pixels + (y & 3) * 4 + (x & 3);
}

// State of the pixels, structure of arrays over pixelIndex.
struct Pixels {
  alignas(64) std::array<float, tile_pixels> red, green, blue, light;
  alignas(64) std::array<float, tile_pixels> last;                 // nearness at which the last fragment ended
  alignas(64) std::array<float, tile_pixels> length;               // world length of a unit of depth on the pixel's ray
  alignas(64) std::array<float, tile_pixels> clip_near, clip_far;  // nearness that the clip planes and the eye leave
  std::array<std::uint16_t, tile_blocks> flagged;                  // pixels of a block where an inversion was found
};

struct TileStats {
  std::size_t fragments = 0, flagged = 0, resolved = 0, unresolved = 0;
  void add(const TileStats& other) {
    fragments += other.fragments;
    flagged += other.flagged;
    resolved += other.resolved;
    unresolved += other.unresolved;
  }
};

// Composites tiles one after the other; one per thread. Everything it holds is scratch.
class TilePainter {
 public:
  // Composites the cells of `entries`, nearest first, onto the pixels of `window`, which lies in one tile, and writes
  // them to `image`.
  TileStats paint(const Screen& screen, std::span<const Entry> entries, const Box& window, Image& image);

 private:
  struct Fragment {
    std::uint32_t pixel = 0;
    mesh::Id cell = 0;
    Span span;
  };
  void begin(const Screen& screen, const Box& window);
  void addCell(Entry entry);
  void addSpan(int pixel, const Span& span);
  mesh::Id setShape(Entry entry);
  void resolve(std::span<const Entry> entries);
  void compositeSorted(std::span<const Fragment> fragments);
  void write(Image& image) const;

  const Screen* screen_ = nullptr;
  Box window_;
  double overlap_at_ = 0.0, overlap_slope_ = 0.0;  // of nearness: tolerance = at + slope * nearness
  Pixels pixels_;
  CellShape shape_;
  std::vector<Span> spans_;
  std::vector<Fragment> fragments_;
  TileStats stats_;
};

}  // namespace spillikin::composite::native
