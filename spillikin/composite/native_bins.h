// Cells in visibility order, handed out to the screen tiles that they may cover.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/composite/native_cell.h"
#include "spillikin/composite/native_pieces.h"
#include "spillikin/composite/native_screen.h"

namespace spillikin::composite::native {

inline constexpr int tile_shift = 5;
inline constexpr int tile_size = 1 << tile_shift;  // pixels; a tile's state fits the first level of cache
inline constexpr int max_region_tiles = 255;       // per side, so that a cell's tiles fit four bytes

// One cell of a tile's list: a cell's id, or, with the top bit set, an index into the order's cuts.
struct Entry {
  static constexpr std::uint32_t cut_bit = 1U << 31U;
  std::uint32_t packed = 0;
  bool cut() const { return (packed & cut_bit) != 0; }
  std::uint32_t index() const { return packed & ~cut_bit; }
};

// The tiles that a cell may cover, relative to the region, one byte each: first column, first row, last column, last
// row. A cell outside of the region has none.
using TileBox = std::uint32_t;
inline constexpr TileBox no_tiles = 0x00000101U;
inline constexpr TileBox unknown_tiles = 0xffffffffU;
inline constexpr TileBox tileBox(std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1) {
  return x0 | y0 << 8U | x1 << 16U | y1 << 24U;
}

class Bins {
 public:
  // Sorts the order's cells into the tiles of `region` (pixels, its corner a multiple of tile_size, at most
  // max_region_tiles tiles wide and high), nearest first. False, and nothing is kept, when that would take more than
  // `max_entries` and the region has more than one tile. Two passes over the order, each parallel by chunks of it; the
  // lists do not depend on the threads. `pieces` are those of the order's cuts (findPieces); entries of pieces that
  // cover no pixel are left out.
  bool fill(const Screen& screen, std::span<const PixelBox> pieces, const Box& region, std::size_t max_entries);

  // The part of it that needs no order, done beforehand if the next region to be filled is known.
  void findBoxes(const Screen& screen, const Box& region);
  void forgetBoxes() { boxes_found_ = {}; }

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  std::size_t tile_count() const { return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_); }
  std::span<const Entry> tile(std::size_t index) const {
    return {entries_.data() + offset_[index], entries_.data() + offset_[index + 1]};
  }
  std::size_t entries() const { return offset_.empty() ? 0 : offset_.back(); }
  std::size_t bytes() const;

 private:
  TileBox boxOf(const Screen& screen, mesh::Id cell, const Box& region) const;
  TileBox boxOf(const PixelBox& piece, TileBox cell, const Box& region) const;
  void boxPieces(const sort::Order& order, std::span<const PixelBox> pieces, const Box& region);
  template <class Visit>
  void visitEntries(const sort::Order& order, std::size_t index, const Visit& visit) const;
  void count(const Screen& screen);
  bool layOut(std::size_t max_entries);
  void place(const Screen& screen);
  // A run of the order, from its near end: entries begin - 1 down to end.
  struct Chunk {
    std::size_t begin = 0, end = 0;
  };
  Chunk chunk(const sort::Order& order, std::size_t index) const;

  int columns_ = 0, rows_ = 0;
  std::size_t chunks_ = 0;
  Box boxes_found_;                    // the region that boxes_ is of, empty for none
  std::vector<TileBox> boxes_;         // per cell
  std::vector<TileBox> piece_boxes_;   // per cut
  std::vector<std::uint32_t> counts_;  // per chunk and tile; while placing, where the next entry goes
  std::vector<std::size_t> offset_;    // per tile + 1
  std::vector<Entry> entries_;
};

}  // namespace spillikin::composite::native
