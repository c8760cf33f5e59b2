// Consistent subdivision into tetrahedra by the smallest-vertex rule (Max, Williams, Silva 2000, section IV).
#pragma once

#include <array>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

using Tetrahedron = std::array<Id, 4>;  // vertex ids, positive volume where the cell is convex

// The tetrahedra of one cell: 2 for a pyramid, 3 for a wedge, 5 or 6 for a hexahedron; a prism or convex polyhedron is
// coned from its smallest vertex. Neighbours agree on every shared diagonal without connectivity. `out` is overwritten.
void tetrahedra(const Mesh& mesh, Id cell, std::vector<Tetrahedron>& out);

// The whole mesh as tetrahedra, with faces matched, and the cell each came from. Zero-volume tetrahedra are dropped.
// cell_file_id is kept through the parent. Cost: linear.
struct Tetrahedralization {
  Mesh mesh;
  std::vector<Id> parent;  // per tetrahedron: the cell of the mesh it was cut from
};
Tetrahedralization tetrahedralize(const Mesh& mesh);

}  // namespace spillikin::mesh
