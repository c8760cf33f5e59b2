// Whole cells as the vector kernel wants them: the surfaces by which rays enter and leave, each one plane or two that
// meet at a diagonal.
//
// A ray enters where the last of the sheets it enters by is crossed and leaves at the first it leaves by, as with the
// faces of a tetrahedron. On the sheet of a quadrilateral a, b, c, d (a of the smallest id, b the smaller of its
// neighbours) the nearness is plane + fold * e and the scalar a's value + (rate + bend * e) * depth, where e is what is
// above 0 of a form that vanishes on the diagonal a, c and grows towards d: two planes to the price of less than two,
// and which one the ray meets is told by the diagonal, however little they differ. All coefficients come from the
// corners in that order, so that both cells of a face get the same bits. A quadrilateral entered by one triangle and
// left by the other makes two sheets; one that bends inwards then makes a gap, which a ray may cross inside of the
// cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_cell.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_whole.h"

namespace spillikin::composite::native {

struct SheetCell {
  static constexpr std::size_t most = 16;  // face f is sheet f; what is left of it by its second triangle sheet 8 + f
  static constexpr std::size_t second = 8;
  using Coefficient = float[most];
  alignas(64) Coefficient plane[3];  // nearness, as a form of x, y and 1
  Coefficient side[3];               // e, where it is above 0
  Coefficient fold;
  Coefficient base;
  Coefficient rate[3];  // in perspective of the scalar over inverse depth; in a parallel view of the scalar itself
  Coefficient bend;

  std::uint8_t entered[most], left[most];  // sheets; up to the eighth filled up with the first
  struct Gap {
    std::uint8_t leaves, enters;  // first out, then in again
    float rounding;               // of nearness on both in float, anywhere on the tile
  };
  Gap gap[6];
  unsigned entered_count, left_count, gap_count;
  bool folded;          // by more than float can tell
  std::uint32_t steep;  // a bit for each sheet that is so steep that rays which meet it go one by one

  Box blocks;                // half-open
  std::uint64_t block_bits;  // of these, those that rays may meet the cell in, a bit each by index; not of a piece
  Look look;
  Piece line;   // what the look may show
  Care care;    // edge_on: to be handed back
  bool linear;  // the field is, as good as: shaded by SheetBatch::field, and the scalar's coefficients are not set
};

// Cells that are set up together.
struct SheetBatch {
  static constexpr std::size_t size = 16;
  static constexpr std::size_t corners = 8;  // of a cell, at most
  SheetCell cell[size];

  // Scratch. The corners as in Screen; what of them is wanted by the faces: places, relative to the tile and (in a
  // parallel view) to the middle depth, and scalars; and what their range is wanted of.
  alignas(64) double record[size][4 * corners];
  alignas(64) double at[size][4][corners];
  enum Ranged : std::uint8_t { x, y, depth, scalar, ranged_count };
  alignas(64) float ranged[ranged_count][size * corners];
  alignas(64) std::int32_t piece[size * corners];
  alignas(64) float lo[ranged_count][size], hi[ranged_count][size];
  alignas(64) std::int32_t first_piece[size], last_piece[size];
  alignas(64) std::int32_t block_x0[size], block_y0[size], block_x1[size], block_y1[size];
  alignas(64) double corner[corners][4 * size];  // the records by corner, of any type as of a hexahedron

  CellBatch field;  // of the cells, as if they were tetrahedra (see native_linear-inl.h)
};

// The fragments of one cell on one tile before they are shaded, vector by vector.
struct SheetCoverage {
  // Arrays of a vector: where its rays enter and leave, by which sheets, and, of a folded cell, e on these.
  static constexpr std::size_t width = 6;
  alignas(64) float vector[width * tile_pixels];
  std::uint32_t pixel[tile_pixels + 1];  // index of the vector's first pixel
};

// The tiles of `region` that the cells first <= c < last may cover, into boxes[c]; unknown_tiles for one that reaches
// behind the eye. A cell's vertices are `corners` from offset[c] to offset[c + 1].
void boxCells(const Place* places, const mesh::Id* corners, const mesh::Id* offset, const Box& region,
              std::size_t first, std::size_t last, TileBox* boxes);

// What the kernel works with between cells; one per thread.
struct SheetScratch {
  SheetBatch batch;
  SheetCoverage covered;
  std::vector<WholeCell::Bound> bounds;   // of a piece of a cell
  std::vector<std::uint16_t> one_by_one;  // pixels
};

// Composites cells and pieces of cells, nearest first, of a mesh that is not of tetrahedra. In its turn a cell that is
// not what planes bound (see Facets), or that float cannot place, is handed back, and so are the pixels on which a cell
// has two intervals or a steep sheet is met. Returns the fragments drawn. Stops early where every pixel is opaque and
// the order is trusted.
std::size_t paintSheets(const TileView& view, std::span<const Entry> entries, Pixels& pixels, SheetScratch& scratch);

// Shades the cells' fragments on the pixels `wanted` and appends them to `out`. False, with part of them in `out`, once
// there are more than `most` of them. Overwrites Pixels::live.
bool collectSheets(const TileView& view, std::span<const Entry> entries, const PixelMask& wanted, Pixels& pixels,
                   SheetScratch& scratch, Pixels& blank, std::size_t most, std::vector<Fragment>& out);

}  // namespace spillikin::composite::native
