// Proves a visibility order right or wrong, ray by ray.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// One cell on a ray: the distances at which the ray enters and leaves it, in world units.
struct Crossing {
  mesh::Id cell = mesh::none;
  double enter = 0.0, leave = 0.0;
};

// `front` is nearer than `back` by `depth` world units on the ray of pixel (x, y), but composited before it.
struct Inversion {
  int x = 0, y = 0;
  mesh::Id front = mesh::none, back = mesh::none;
  double depth = 0.0;
};

// What the rays added so far have shown. Tallies of several threads are merged; the result does not depend on how the
// rays were shared out.
struct Tally {
  static constexpr std::size_t worst_kept = 10;

  std::size_t rays = 0;          // that meet at least one cell
  std::size_t pairs = 0;         // of pieces on a common ray
  std::size_t inversions = 0;    // pairs in the wrong order: the nearer ends before the farther begins
  std::size_t contested = 0;     // pairs that overlap, the one that begins first composited first: no order is right
  std::size_t overlaps = 0;      // pieces that begin before another has ended
  std::vector<Inversion> worst;  // deepest first
  struct Overlap {
    int x = 0, y = 0;
    std::array<mesh::Id, 2> cells{};
  };
  std::vector<Overlap> first_overlaps;  // by pixel, row by row

  void merge(const Tally& other);
};

// Two crossings touch when they overlap by no more than this fraction of their distance, and a crossing shorter than
// that is a ray along an edge or through a vertex: it holds no light and has no place in an order. The bound is what
// double rounding of an intersection can amount to.
inline constexpr double touch_tolerance = 1e-9;

class OrderChecker {
 public:
  // The order must outlive the checker. Throws Error when a cell below `cell_count` is missing from it.
  OrderChecker(const Order& order, std::size_t cell_count);

  // All pairs of the crossings of one ray, given in any sequence; `origin` and the unit vector `direction` say where
  // the pieces of cut cells begin and end. Cost: k log k for k crossings.
  void add(int x, int y, const Vec3& origin, const Vec3& direction, std::span<const Crossing> crossings,
           Tally& tally) const;

 private:
  struct Piece {
    mesh::Id cell;
    std::uint32_t place;
    double enter, leave;
  };
  // Of pieces by `enter`, in the order of `places`: pairs that overlap and ascend.
  static std::size_t contested(std::span<const Piece> pieces);
  static void addWorst(int x, int y, std::span<const Piece> pieces, bool overlaps, Tally& tally);
  void split(const Crossing& crossing, const Vec3& origin, const Vec3& direction, std::vector<Piece>& pieces) const;

  const Order& order_;
  std::vector<std::uint32_t> first_entry_;  // per cell + 1: where its entries begin in entry_
  std::vector<std::uint32_t> entry_;        // places in the order, by cell
};

}  // namespace spillikin::sort
