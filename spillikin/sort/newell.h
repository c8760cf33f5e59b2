// The list algorithm of Newell, Newell and Sancha, for cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "spillikin/sort/newell_pairs.h"
#include "spillikin/sort/newell_spheres.h"
#include "spillikin/sort/newell_windows.h"
#include "spillikin/sort/sort.h"
#include "spillikin/sort/splice.h"
#include "spillikin/sort/xmpvo.h"

namespace spillikin::sort {

// Newell, Newell, Sancha 1972; Stein et al. 1994; Williams et al. 1998; Max, Williams, Silva 2000, section III. Cells
// are listed by their farthest vertex. The farthest is tested against those that follow, up to the first that lies
// nearer than all of it, and listed if it hides none; one that it hides is moved before it and marked, and a cell that
// comes back to the head of the list goes on where it was left. The tests, from cheap to dear: depth (1), windows and
// bounding boxes on the image plane (2, 3; newell_windows.h), planes of faces (4, 5), the edges of what is seen of a
// cell, and the definitive one: a triangle of the first turned away and one of the second turned towards the viewpoint
// whose projections overlap, exactly (newell_pairs.h). Cones over bounding spheres and the spheres themselves (1', 2';
// newell_spheres.h) come third; they part fewer than one in a hundred of the pairs whose boxes overlap.
//
// A cell that hides one moved before it is in a cycle with all that were moved since. The cells of a cycle are listed
// together, after all that they hide, in the sequence and the pieces that XMPVO gives them.
//
// The list needs no adjacency and is exact for cells that do not overlap; whether exterior triangles cross is decided
// once. Cost: O(n log n) and the pairs of cells that share some of the image and are not told apart by depth, 10 to 150
// a cell on the meshes at hand, at some 0.1 us each, 1 us where faces are curved; up to n^2. The list is serial, what
// comes before it runs on all cores. About 360 bytes a tetrahedron beside XMPVO's.
class Newell final : public Sorter {
 public:
  explicit Newell(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::newell; }
  std::string why() const override;
  bool exact() const override { return xmpvo_.exact(); }
  std::size_t bytes() const override;

  std::size_t pairsTested() const { return pairs_tested_; }  // in the last view, beyond tests 1, 2 and 3

 private:
  void move(mesh::Id cell);
  mesh::Id nextHidden(NewellWindows::Search& search);
  void listFrom(mesh::Id first, const Viewpoint& viewpoint, Order& order);
  void listSince(mesh::Id a, const Viewpoint& viewpoint, Order& order);
  void askXmpvo(const Viewpoint& viewpoint, Order& order);

  const std::unique_ptr<mesh::Mesh> matched_;  // where diagonals are crossed, so that no cells overlap there
  const mesh::Mesh& mesh_;                     // that, or the one given
  NewellWindows windows_;
  NewellSpheres spheres_;
  NewellPairs pairs_;
  std::vector<NewellWindows::Search> head_;  // cells moved before the rest of the list, the first last
  std::vector<mesh::Id> waiting_;            // those and others in cycles with them, as they were moved
  std::vector<std::uint32_t> moved_;         // the mark: a number in the sequence of moves, 0 before
  std::vector<std::uint32_t> lowest_;        // the earliest move of a cell that is in a cycle with this one
  std::uint32_t moves_ = 0;
  std::size_t pairs_tested_ = 0;
  Xmpvo xmpvo_;  // also knows whether exterior triangles cross
  bool cyclic_ = false;
  Order whole_;  // XMPVO's, of a view with cycles
  Excerpts excerpts_;
};

}  // namespace spillikin::sort
