// One screen tile: its pixels while cells are composited onto them, and the certificate of their order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "spillikin/composite/native_bins.h"
#include "spillikin/composite/native_cell.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_pixels.h"
#include "spillikin/composite/native_screen.h"
#include "spillikin/composite/native_sheets.h"
#include "spillikin/composite/native_whole.h"
#include "spillikin/integrate/segment.h"

namespace spillikin::composite::native {

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
  // Composites the cells of `entries`, nearest first, of cut ones what lies in the boxes of their pieces, onto the
  // pixels of `window`, which lies in one tile, and writes them to `image`.
  TileStats paint(const Screen& screen, std::span<const Entry> entries, std::span<const PixelBox> pieces,
                  const Box& window, Image& image);

 private:
  void begin(const Screen& screen, const Box& window);
  void setView();
  void setClips();
  void composite(std::span<const Entry> entries);
  void addCell(Entry entry);
  void addRays(Entry entry, std::span<const std::uint16_t> pixels);
  void addRay(std::size_t pixel);
  void addSpan(std::size_t pixel, const Span& span);
  mesh::Id cellOf(Entry entry) const;
  void setShape(Entry entry);
  integrate::Radiance radiance(std::size_t pixel, const Span& span) const;
  void resolve(std::span<const Entry> entries);
  void resolvePart(std::span<const Entry> entries, std::span<const std::uint16_t> pixels);
  bool collect(std::span<const Entry> entries, std::size_t most);
  void collectCell(Entry entry);
  void collectRays(Entry entry, std::span<const std::uint16_t> pixels);
  void collectRay(std::size_t pixel);
  bool wantedIn(const Box& blocks) const;
  void compositeSorted(std::span<Fragment> fragments);
  void write(Image& image) const;

  const Screen* screen_ = nullptr;
  Box window_;
  TileView view_;
  Pixels pixels_;
  // The limit of the eye that the pixels' clip ranges hold, and nothing else; not a number where they hold more.
  float unclipped_ = std::numeric_limits<float>::quiet_NaN();
  KernelScratch scratch_;
  SheetScratch sheets_;
  CellShape shape_;
  WholeCell whole_;
  std::vector<Span> spans_;
  PixelMask wanted_{};
  std::vector<std::uint16_t> flagged_;
  std::vector<Fragment> fragments_, by_pixel_;
  std::vector<std::uint32_t> next_;
  TileStats stats_;
};

}  // namespace spillikin::composite::native
