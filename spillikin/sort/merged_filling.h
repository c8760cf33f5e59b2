// Tetrahedra that fill the outside of a mesh, joined to larger convex cells.
#pragma once

#include <cstddef>
#include <memory>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// Cells from `first` on are tetrahedra, of which nothing but the order matters. Two neighbours become one cell where
// that is convex: no vertex of theirs lies beyond the plane of any triangle around both (exact). A closed surface all
// of whose triangles lie on the convex hull of their corners is that hull. Faces are tried by size, the largest first,
// and what was joined is joined again. Returns a mesh in which these cells are polyhedra with triangles, after the
// others as they were; an order of its cells orders the others as before, with fewer cells and faces to go through.
// Cost: near linear.
std::unique_ptr<mesh::Mesh> mergeFilling(const mesh::Mesh& mesh, std::size_t first);

}  // namespace spillikin::sort
