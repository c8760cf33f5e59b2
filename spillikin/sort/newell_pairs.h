// Whether one cell hides another, from cheap tests to the definitive one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/newell_facets.h"
#include "spillikin/sort/triangle_order.h"

namespace spillikin::sort {

// For cells whose depths and bounding boxes overlap (tests 1 to 3, newell_windows.h): tests 4 and 5 of Newell, Newell
// and Sancha 1972 and the definitive test, of Stein et al. 1994 for cells (Max, Williams, Silva 2000, section III). All
// but the last decide from filtered arithmetic over prepared planes, so that exact predicates are left to few pairs.
// Nothing is allocated for a pair once the scratch space has grown.
class NewellPairs {
 public:
  explicit NewellPairs(const mesh::Mesh& mesh) : mesh_(mesh), tetrahedral_(mesh.tetrahedral()), facets_(mesh) {}

  // The viewpoint's side of every facet, once a view, exact.
  void begin(const Viewpoint& viewpoint);
  // Does some ray pass through a and then through b, in a beam wider than a sliver? Cost: some 50 to 300 ns; exact
  // tests of all pairs of their triangles where nothing else decides. Consecutive calls with one a are cheaper.
  bool hides(mesh::Id a, mesh::Id b);

  std::size_t bytes() const { return facets_.bytes() + turned_.capacity(); }

 private:
  // What a facet is good for in this view.
  enum Turned : std::uint8_t {
    towards = 1,  // it supports its cell, and the viewpoint does not lie behind it
    away = 2,     // it supports its cell, and the viewpoint does not lie before it
    entry = 4,    // rays enter the cell through it
    exit = 8,     // rays leave it
  };
  // An edge of the outline of a cell as seen: the cell lies on the positive side of the plane through the viewpoint.
  struct Edge {
    std::array<mesh::Id, 2> ends;
    Vec3 normal;
    double bound;  // on the error of normal . (p - first end), relative to its components' sum
  };
  struct Cell {
    mesh::Id id = mesh::none;
    std::uint32_t shared = 0;  // of its first 32 vertices, those that are the other cell's too
    bool outlined = false;
    std::vector<Edge> outline;
  };
  enum class Verdict : std::uint8_t { apart, open, not_apart };

  bool is(std::uint32_t facet, unsigned turned) const { return (turned_[facet] & turned) != 0; }
  // N vertices a cell, or 0 where cells differ.
  template <std::size_t N>
  std::span<const mesh::Id> vertices(const Cell& cell) const;
  template <std::size_t N>
  void findShared();
  template <std::size_t N>
  Verdict before(std::uint32_t facet, const Cell& own, const Cell& other) const;
  template <std::size_t N>
  bool anyParts(const Cell& own, Turned turned, const Cell& other, std::vector<std::uint32_t>& open) const;
  bool anyPartsExactly(std::span<const std::uint32_t> open, const Cell& other) const;
  bool shareSeenFace() const;
  void findOutline(Cell& cell) const;
  bool outlineParts(Cell& own, const Cell& other) const;
  bool behind(std::uint32_t other, std::uint32_t facet) const;
  bool trianglesHide() const;
  template <std::size_t N>
  bool hides();
  Triangle triangle(std::uint32_t facet) const;

  const mesh::Mesh& mesh_;
  const bool tetrahedral_;
  const CellFacets facets_;
  Viewpoint viewpoint_{0.0};
  std::vector<std::uint8_t> turned_;  // by facet
  Cell a_, b_;
  std::vector<std::uint32_t> open_a_, open_b_;  // facets that rounding leaves undecided
};

}  // namespace spillikin::sort
