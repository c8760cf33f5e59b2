#include "spillikin/composite/native_bins.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_sheets.h"

namespace spillikin::composite::native {

namespace {

constexpr std::size_t chunk_cells = 1 << 16;
constexpr std::size_t max_chunks = 256;
constexpr std::size_t box_grain = 1 << 13;
constexpr std::size_t look_ahead = 32;  // cells; the order jumps about in memory

}  // namespace

bool Bins::fill(const Screen& screen, std::span<const PixelBox> pieces, const Box& region, std::size_t max_entries) {
  columns_ = (region.x1 - region.x0 + tile_size - 1) / tile_size;
  rows_ = (region.y1 - region.y0 + tile_size - 1) / tile_size;
  const std::size_t cells = screen.frame().order.cells.size();
  chunks_ = std::clamp<std::size_t>((cells + chunk_cells - 1) / chunk_cells, 1, max_chunks);
  if (!(boxes_found_ == region)) findBoxes(screen, region);
  boxPieces(screen.frame().order, pieces, region);
  count(screen);
  if (!layOut(max_entries)) return false;
  place(screen);
  return true;
}

TileBox Bins::boxOf(const Screen& screen, mesh::Id cell, const Box& region) const {
  const Box box = pixelBox(screen, screen.mesh().vertices(cell), region);
  if (box.empty()) return no_tiles;
  const auto tile = [](int pixel) { return static_cast<std::uint32_t>(pixel / tile_size); };
  return tileBox(tile(box.x0 - region.x0), tile(box.y0 - region.y0), tile(box.x1 - 1 - region.x0),
                 tile(box.y1 - 1 - region.y0));
}

void Bins::findBoxes(const Screen& screen, const Box& region) {
  const mesh::Mesh& mesh = screen.mesh();
  const Frame& frame = screen.frame();
  const bool all = frame.field.hidden.empty() && frame.clear.empty();
  const bool tetrahedral = mesh.tetrahedral();
  boxes_.resize(mesh.cell_count());
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, mesh.cell_count(), box_grain), [&](const Range& range) {
    std::size_t c = range.begin();
    // What reaches behind the eye is left to the slower way.
    if (tetrahedral) {
      c = boxTetrahedra(screen.places(), mesh.cell_vertex.data(), region, c, range.end(), boxes_.data());
    } else {
      boxCells(screen.places(), mesh.cell_vertex.data(), mesh.cell_vertex_offset.data(), region, c, range.end(),
               boxes_.data());
      c = range.end();
    }
    for (; c != range.end(); ++c)
      boxes_[c] = unknown_tiles;
    for (c = range.begin(); c != range.end(); ++c) {
      const auto cell = static_cast<mesh::Id>(c);
      if (!all && !frame.draws(cell)) boxes_[c] = no_tiles;
      if (boxes_[c] == unknown_tiles) boxes_[c] = boxOf(screen, cell, region);
    }
  });
  boxes_found_ = region;
}

TileBox Bins::boxOf(const PixelBox& piece, TileBox cell, const Box& region) const {
  const int x0 = std::max<int>(piece.x0, region.x0), x1 = std::min<int>(piece.x1, region.x1);
  const int y0 = std::max<int>(piece.y0, region.y0), y1 = std::min<int>(piece.y1, region.y1);
  if (cell == no_tiles || x0 >= x1 || y0 >= y1) return no_tiles;
  const auto tile = [](int pixel) { return static_cast<std::uint32_t>(pixel / tile_size); };
  const auto side = [cell](unsigned shift) { return cell >> shift & 255U; };
  const std::uint32_t a = std::max(tile(x0 - region.x0), side(0)), b = std::max(tile(y0 - region.y0), side(8));
  const std::uint32_t c = std::min(tile(x1 - 1 - region.x0), side(16)),
                      d = std::min(tile(y1 - 1 - region.y0), side(24));
  return a > c || b > d ? no_tiles : tileBox(a, b, c, d);
}

void Bins::boxPieces(const sort::Order& order, std::span<const PixelBox> pieces, const Box& region) {
  piece_boxes_.resize(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i)
    piece_boxes_[i] = boxOf(pieces[i], boxes_[order.cells[order.cuts[i].entry]], region);
}

// The order is back to front and the lists are front to back: chunk 0 is the nearest.
Bins::Chunk Bins::chunk(const sort::Order& order, std::size_t index) const {
  const std::size_t cells = order.cells.size();
  return {cells - cells * index / chunks_, cells - cells * (index + 1) / chunks_};
}

namespace {

template <class Visit>
inline void visitTiles(TileBox box, std::size_t columns, const Visit& visit) {
  const std::uint32_t x0 = box & 255U;
  const std::uint32_t x1 = box >> 16U & 255U;
  const std::uint32_t y1 = box >> 24U;
  for (std::uint32_t y = box >> 8U & 255U; y <= y1; ++y) {
    for (std::uint32_t x = x0; x <= x1; ++x)
      visit(y * columns + x);
  }
}

}  // namespace

// The entries of a chunk, nearest first, each with its tiles.
template <class Visit>
void Bins::visitEntries(const sort::Order& order, std::size_t index, const Visit& visit) const {
  const mesh::Id* cells = order.cells.data();
  const Chunk c = chunk(order, index);
  std::size_t cut = order.cuts.first(c.begin);
  for (std::size_t i = c.begin; i-- > c.end;) {
    if (i >= look_ahead) __builtin_prefetch(boxes_.data() + cells[i - look_ahead]);
    if (cut > 0 && order.cuts[cut - 1].entry == i) {
      --cut;
      visit(Entry{static_cast<std::uint32_t>(cut) | Entry::cut_bit}, piece_boxes_[cut]);
    } else {
      visit(Entry{cells[i]}, boxes_[cells[i]]);
    }
  }
}

void Bins::count(const Screen& screen) {
  counts_.assign(chunks_ * tile_count(), 0);
  tbb::parallel_for(std::size_t{0}, chunks_, [&](std::size_t index) {
    std::uint32_t* counts = counts_.data() + index * tile_count();
    const auto columns = static_cast<std::size_t>(columns_);
    visitEntries(screen.frame().order, index,
                 [&](Entry, TileBox box) { visitTiles(box, columns, [counts](std::size_t tile) { ++counts[tile]; }); });
  });
}

bool Bins::layOut(std::size_t max_entries) {
  offset_.assign(tile_count() + 1, 0);
  std::size_t total = 0;
  for (std::size_t t = 0; t < tile_count(); ++t) {
    offset_[t] = total;
    for (std::size_t chunk = 0; chunk < chunks_; ++chunk) {
      std::uint32_t& n = counts_[chunk * tile_count() + t];
      const auto here = static_cast<std::uint32_t>(total);
      total += n;
      n = here;
    }
    if (total > max_entries && tile_count() > 1) return false;
  }
  offset_[tile_count()] = total;
  return true;
}

void Bins::place(const Screen& screen) {
  if (entries_.capacity() < entries()) entries_ = {};  // nothing of the last frame is copied
  entries_.resize(entries());
  tbb::parallel_for(std::size_t{0}, chunks_, [&](std::size_t index) {
    std::uint32_t* next = counts_.data() + index * tile_count();
    Entry* entries = entries_.data();
    const auto columns = static_cast<std::size_t>(columns_);
    visitEntries(screen.frame().order, index, [&](Entry entry, TileBox box) {
      visitTiles(box, columns, [&](std::size_t tile) { entries[next[tile]++] = entry; });
    });
  });
}

std::size_t Bins::bytes() const {
  return (boxes_.capacity() + piece_boxes_.capacity()) * sizeof(TileBox) + counts_.capacity() * sizeof(std::uint32_t) +
         offset_.capacity() * sizeof(std::size_t) + entries_.capacity() * sizeof(Entry);
}

}  // namespace spillikin::composite::native
