// Cells by their farthest vertex, in windows of the image.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/radix_sort.h"

namespace spillikin::sort {

// Tests 1, 2 and 3 of Newell, Newell and Sancha 1972: which of the cells not yet listed reach as far from the viewpoint
// as the nearest point of a given one (1), and share some of the image with it (2, 3: the bounding boxes in its two
// directions).
//
// The image is a plane where all of the mesh lies well in front of it or the view is parallel, else the six sides of a
// cube around the eye, so that cells behind the eye have windows as small as those before it. Each side is divided into
// 1, 4, 16, ... windows. A cell is kept in one window of the finest level that has windows no smaller than the cell,
// that of its lower corner; those that may overlap it on a level lie in the windows it overlaps and in those before
// them. Within a window the farthest come first, which no move disturbs.
//
// Extents are widened by the rounding they may have suffered: they only ever spare exact tests. Cost of a view: O(n)
// and what the searches look at; some 120 bytes a cell. Orders do not depend on the number of threads.
class NewellWindows {
 public:
  explicit NewellWindows(const mesh::Mesh& mesh) : mesh_(mesh) {}

  void operator()(const Viewpoint& viewpoint);

  // All cells, farthest vertex first.
  std::span<const mesh::Id> cells() const { return cells_; }
  bool listed(mesh::Id cell) const { return listed_[cell] != 0; }
  const std::vector<std::uint8_t>& listedCells() const { return listed_; }  // nonzero, by cell
  void list(mesh::Id cell);

  // How far a cell's search has come: what it has passed need not be looked at again.
  struct Search {
    mesh::Id cell;
    std::uint32_t at, end;                     // in entries of the window
    std::uint32_t x, y, level;                 // the next window
    std::array<std::uint32_t, 2> first, last;  // windows on this level
    std::uint32_t footprint;                   // of the cell, on this side of the image
  };
  Search search(mesh::Id cell) const;
  // The next cell that tests 1, 2 and 3 do not clear, or none.
  mesh::Id next(Search& search);

  std::size_t bytes() const;

 private:
  // Where a cell is seen, from 0 to 1 across the side in both directions.
  struct Rectangle {
    std::array<float, 2> lower, upper;
  };
  struct Entry {
    Rectangle box;
    std::uint32_t farthest;  // a key: larger is nearer
    mesh::Id cell;
  };
  struct Footprint {
    Rectangle box;
    std::uint8_t side, level;
    std::uint32_t window;
  };
  struct Window {
    std::uint32_t head, end;  // before the head all are listed
  };
  struct Side {
    Vec3 right, up, forward;
    std::array<double, 2> lower, scale;  // of the image, to [0, 1]
  };
  struct Depths {
    double nearest, farthest;
  };

  void chooseSides();
  Side side(const Vec3& forward) const;
  Vec3 fromViewpoint(const Vec3& point) const { return point - origin_; }
  Depths depths(mesh::Id cell) const;
  bool project(const Side& side, mesh::Id cell, Rectangle& box) const;
  void sortByDepth();
  void findFootprints();
  void place(Footprint& footprint) const;
  void fill();
  bool openLevel(Search& search) const;
  bool openWindow(Search& search);

  std::size_t windowsBefore(std::uint32_t level) const { return ((std::size_t{1} << (2 * level)) - 1) / 3; }
  std::size_t windowsOfSide() const { return windowsBefore(levels_); }

  const mesh::Mesh& mesh_;
  bool parallel_ = false;
  Vec3 origin_{0.0}, sight_{0.0};  // the eye, or the middle of the mesh and the direction of sight
  std::vector<Side> sides_;
  std::uint32_t levels_ = 1;
  RadixSort radix_;
  std::vector<mesh::Id> cells_;
  std::vector<std::uint32_t> nearest_;  // keys, by cell
  std::vector<std::uint8_t> seen_on_;   // a bit for each side
  std::vector<std::uint32_t> first_;    // footprint of each cell, and the end
  std::vector<Footprint> footprint_;
  std::vector<Entry> entry_;            // by window
  std::vector<Window> window_;          // by side, level, row
  std::vector<std::uint32_t> waiting_;  // cells not listed, by side and level
  std::vector<std::uint8_t> listed_;
};

}  // namespace spillikin::sort
