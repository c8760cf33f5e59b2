// A mesh whose exterior is of triangles that do not lie on one another.
#pragma once

#include <cstddef>
#include <memory>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// A copy with the same cells, whose outside can be filled with tetrahedra. Cells that are changed become polyhedra:
// - Every exterior quadrilateral becomes two triangles. The diagonal is the one from the smallest vertex (mesh.h), but
//   where two exterior triangles of other cells lie against it with the other diagonal it is theirs, so that all match.
// - Where two exterior triangles lie against two others on the same four points with the other diagonal, and leave no
// gap
//   (they lie in one plane, or overlap by what is between the diagonals), all four are halved at a point between the
//   diagonals, so that the halves match.
// Faces that match now are joined. Only what an order needs is filled in: points, cells, faces. `crossed` is how many
// quadrilaterals had the one diagonal on one side and the other on the other: what lies between the two counts as
// nothing.
//
// Cost: a copy, and sorting the exterior.
mesh::Mesh withFillableOutside(const mesh::Mesh& mesh, std::size_t& crossed);

// A copy in which only quadrilaterals that lie against two triangles and faces with crossed diagonals are changed, as
// above, so that they match; null where there are none, and for tetrahedra alone. Cost: that of sorting the exterior
// triangles and their edges, where cells are of several kinds.
std::unique_ptr<mesh::Mesh> withMatchedDiagonals(const mesh::Mesh& mesh);

// What such a copy takes.
std::size_t bytes(const mesh::Mesh& mesh);

}  // namespace spillikin::sort
