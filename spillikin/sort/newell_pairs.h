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
  explicit NewellPairs(const mesh::Mesh& mesh) : mesh_(mesh), facets_(mesh) {}

  // The viewpoint's side of every facet, once a view, exact.
  void begin(const Viewpoint& viewpoint);
  // Does some ray pass through a and then through b, in a beam wider than a sliver? Cost: some 50 to 300 ns; exact
  // tests of all pairs of their triangles where nothing else decides. Consecutive calls with one a are cheaper.
  bool hides(mesh::Id a, mesh::Id b);

  std::size_t bytes() const { return facets_.bytes() + sign_.capacity(); }

 private:
  // Some corner of a cell and a plane through the viewpoint and an edge at it: seen from there, the cell lies on its
  // positive side.
  struct Edge {
    std::array<mesh::Id, 2> ends;
    Vec3 normal;
    double bound;  // on the error of normal . w, relative to |w|_1
  };
  // What is kept of a cell while it is tested against others.
  struct Cell {
    mesh::Id id = mesh::none;
    std::vector<Vec3> points;
    std::vector<std::uint32_t> towards,
        away;  // facets that support it and are turned towards the viewer, away, or edge-on
    bool outlined = false;
    std::vector<Edge> outline;
  };
  enum class Verdict : std::uint8_t { apart, open, not_apart };

  void take(mesh::Id id, Cell& cell) const;
  Verdict before(std::uint32_t facet, const Cell& cell) const;
  bool beforeExactly(std::uint32_t facet, mesh::Id cell) const;
  bool shareSeenFace(const Cell& a, const Cell& b) const;
  void findOutline(Cell& cell) const;
  bool outlineParts(Cell& a, const Cell& b) const;
  bool trianglesHide(mesh::Id a, mesh::Id b) const;
  Triangle triangle(std::uint32_t facet) const;

  const mesh::Mesh& mesh_;
  const CellFacets facets_;
  Viewpoint viewpoint_{0.0};
  std::vector<std::int8_t> sign_;  // by facet
  Cell a_, b_;
  std::vector<std::uint32_t> open_a_, open_b_;  // facets that rounding leaves undecided
};

}  // namespace spillikin::sort
