#include "spillikin/composite/native_bins.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

namespace spillikin::composite::native {

namespace {

constexpr std::size_t chunk_cells = 1 << 16;
constexpr std::size_t max_chunks = 256;
constexpr std::size_t box_grain = 1 << 13;

}  // namespace

bool Bins::fill(const Screen& screen, const Box& region, std::size_t max_entries) {
  columns_ = (region.x1 - region.x0 + tile_size - 1) / tile_size;
  rows_ = (region.y1 - region.y0 + tile_size - 1) / tile_size;
  const std::size_t cells = screen.frame().order.cells.size();
  chunks_ = std::clamp<std::size_t>((cells + chunk_cells - 1) / chunk_cells, 1, max_chunks);
  findBoxes(screen, region);
  count(screen);
  if (!layOut(max_entries)) return false;
  place(screen);
  return true;
}

void Bins::findBoxes(const Screen& screen, const Box& region) {
  const mesh::Mesh& mesh = screen.mesh();
  const std::vector<std::uint8_t>& hidden = screen.frame().field.hidden;
  boxes_.resize(mesh.cell_count());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.cell_count(), box_grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t c = range.begin(); c != range.end(); ++c) {
                        boxes_[c] = {};
                        if (!hidden.empty() && hidden[c] != 0) continue;
                        const Box box = pixelBox(screen, mesh.vertices(static_cast<mesh::Id>(c)), region);
                        if (box.empty()) continue;
                        const auto tile = [](int pixel) { return static_cast<std::uint8_t>(pixel / tile_size); };
                        boxes_[c] = {tile(box.x0 - region.x0), tile(box.y0 - region.y0), tile(box.x1 - 1 - region.x0),
                                     tile(box.y1 - 1 - region.y0)};
                      }
                    });
}

// The order is back to front and the lists are front to back: chunk 0 is the nearest.
template <class Visit>
void Bins::visitChunk(const Screen& screen, std::size_t chunk, const Visit& visit) const {
  const sort::Order& order = screen.frame().order;
  const std::size_t cells = order.cells.size();
  const std::size_t begin = cells - cells * chunk / chunks_;
  const std::size_t end = cells - cells * (chunk + 1) / chunks_;
  auto cut = std::lower_bound(order.cuts.begin(), order.cuts.end(), begin,
                              [](const sort::Cut& c, std::size_t entry) { return c.entry < entry; });
  for (std::size_t i = begin; i-- > end;) {
    const mesh::Id cell = order.cells[i];
    Entry entry{cell};
    if (cut != order.cuts.begin() && std::prev(cut)->entry == i) {
      --cut;
      entry.packed = static_cast<std::uint32_t>(cut - order.cuts.begin()) | Entry::cut_bit;
    }
    const TileBox box = boxes_[cell];
    for (unsigned y = box.y0; y <= box.y1; ++y) {
      for (unsigned x = box.x0; x <= box.x1; ++x) {
        visit(y * static_cast<unsigned>(columns_) + x, entry);
      }
    }
  }
}

void Bins::count(const Screen& screen) {
  counts_.assign(chunks_ * tile_count(), 0);
  tbb::parallel_for(std::size_t{0}, chunks_, [&](std::size_t chunk) {
    std::uint32_t* counts = counts_.data() + chunk * tile_count();
    visitChunk(screen, chunk, [counts](unsigned tile, Entry) { ++counts[tile]; });
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
  entries_.resize(entries());
  tbb::parallel_for(std::size_t{0}, chunks_, [&](std::size_t chunk) {
    std::uint32_t* next = counts_.data() + chunk * tile_count();
    Entry* entries = entries_.data();
    visitChunk(screen, chunk, [next, entries](unsigned tile, Entry entry) { entries[next[tile]++] = entry; });
  });
}

std::size_t Bins::bytes() const {
  return boxes_.capacity() * sizeof(TileBox) + counts_.capacity() * sizeof(std::uint32_t) +
         offset_.capacity() * sizeof(std::size_t) + entries_.capacity() * sizeof(Entry);
}

}  // namespace spillikin::composite::native
