// One screen tile: its pixels while cells are composited onto them, and the certificate of their order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/composite/native_bins.h"
#include "spillikin/composite/native_cell.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_pixels.h"
#include "spillikin/composite/native_screen.h"
#include "spillikin/composite/native_whole.h"

namespace spillikin::composite::native {

// Beyond this share of the depth, fragments that have been put in order in double precision still overlap only where
// the cells themselves do.
inline constexpr double resolved_tolerance = 1e-9;

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
  void setView();
  void setClips();
  void composite(std::span<const Entry> entries);
  void addCell(Entry entry);
  void addRay(std::size_t pixel);
  void addSpan(std::size_t pixel, const Span& span);
  mesh::Id setShape(Entry entry);
  void resolve(std::span<const Entry> entries);
  void compositeSorted(std::span<const Fragment> fragments);
  void write(Image& image) const;

  const Screen* screen_ = nullptr;
  Box window_;
  TileView view_;
  Pixels pixels_;
  KernelScratch scratch_;
  CellShape shape_;
  WholeCell whole_;
  std::vector<Span> spans_;
  std::vector<Fragment> fragments_;
  TileStats stats_;
};

}  // namespace spillikin::composite::native
