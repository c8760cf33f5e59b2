// Where the pixel centres of a tile's blocks lie, laid out as vectors of a block's pixels.
#pragma once

#include "spillikin/composite/native_pixels.h"

namespace spillikin::composite::native {

// The pixel centres of a block's columns and rows, relative to the tile.
struct Centres {
  alignas(64) float x[block_columns][block_pixels];
  alignas(64) float y[block_columns][block_pixels];
  constexpr Centres() : x{}, y{} {
    for (int b = 0; b < block_columns; ++b) {
      for (int i = 0; i < block_pixels; ++i) {
        x[b][i] = static_cast<float>(4 * b + i % 4) + 0.5F;
        // NOLINTNEXTLINE(bugprone-integer-division): the row of pixel i
        y[b][i] = static_cast<float>(4 * b + i / 4) + 0.5F;
      }
    }
  }
};
inline constexpr Centres centres;

// The centres of the first pixels of a tile's columns of blocks, which are those of its rows, too.
struct BlockCorners {
  alignas(64) float at[block_columns];
  constexpr BlockCorners() : at{} {
    for (int b = 0; b < block_columns; ++b)
      at[b] = static_cast<float>(4 * b) + 0.5F;
  }
};
inline constexpr BlockCorners block_corners;

// The middles of a tile's blocks, relative to the tile, and how far from them pixel centres lie each way.
struct BlockMiddles {
  alignas(64) float x[tile_blocks];
  alignas(64) float y[tile_blocks];
  constexpr BlockMiddles() : x{}, y{} {
    for (int b = 0; b < tile_blocks; ++b) {
      x[b] = static_cast<float>(4 * (b % block_columns)) + 2.0F;
      // NOLINTNEXTLINE(bugprone-integer-division): the row of block b
      y[b] = static_cast<float>(4 * (b / block_columns)) + 2.0F;
    }
  }
};
inline constexpr BlockMiddles block_middles;
inline constexpr float block_reach = 1.5F;

}  // namespace spillikin::composite::native
