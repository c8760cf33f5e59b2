// Whether a mesh of tetrahedra is (part of) a Delaunay or regular triangulation, decided exactly.
#pragma once

#include <cstddef>
#include <span>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// Interior faces by what lifting the vertices does to them: to their squared length (Delaunay), or to given heights.
// A face is regular when the linear functions of its two tetrahedra meet in a convex crease, that is, when neither
// circumsphere holds the other's opposite vertex; tied when there is no crease (five vertices on a sphere).
struct Regularity {
  std::size_t regular = 0, tied = 0, irregular = 0;
  // No cells around a tied edge: the tied faces join cells to trees. A cycle of cells, each in front of the next, would
  // have to run through tied faces alone, since the lifted distance changes strictly across the others.
  bool ties_are_trees = true;

  // From every viewpoint the cells on either side of interior faces, and those beyond, have an order without cycles
  // in which the lifted distance decreases (Edelsbrunner 1989).
  bool ordered() const { return irregular == 0 && ties_are_trees; }
};

// The mesh is of tetrahedra; `heights` is empty (Delaunay) or has one for each vertex, equal for vertices at one place.
// Exact: an insphere test a face, on all cores, 0.1 us each. Stops early, with partial counts, where `ordered_only` and
// it is not.
Regularity regularity(const mesh::Mesh& mesh, std::span<const double> heights = {}, bool ordered_only = false);

// The vertex of a tetrahedron across its `slot`-th face, in the order of Mesh::cell_face.
inline mesh::Id oppositeVertex(const mesh::Mesh& mesh, mesh::Id cell, unsigned slot) {
  constexpr unsigned opposite[4] = {2, 0, 1, 3};
  return mesh.cell_vertex[4 * std::size_t{cell} + opposite[slot]];
}

// The interior face's tetrahedra, the first on its side 0, and the vertex of the second that the first has not.
struct Hinge {
  mesh::Id cell = 0, neighbour = 0;
  mesh::Id apex = 0;
};
Hinge hinge(const mesh::Mesh& mesh, mesh::Id face);

}  // namespace spillikin::sort
