// Consistent subdivision into tetrahedra by the smallest-vertex rule (Max, Williams, Silva 2000, section IV).
#pragma once

#include <array>
#include <vector>

#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

using Tetrahedron = std::array<Id, 4>;  // vertex ids, positive volume where the cell is convex

// The tetrahedra of one cell: 2 for a pyramid, 3 for a wedge, 5 or 6 for a hexahedron; a prism or convex polyhedron is
// coned from its smallest vertex. Neighbours agree on every shared diagonal without connectivity. `out` is overwritten.
void tetrahedra(const Mesh& mesh, Id cell, std::vector<Tetrahedron>& out);

// The whole mesh as tetrahedra, with faces matched, and the cell each came from. cell_file_id is kept through the
// parent, the tables of made points are those of the mesh. A cell that its own tetrahedra do not fill, because some
// come out with negative volume, is coned from a point inside it that sees all of its boundary triangles, so that its
// neighbours notice nothing; `unfilled` lists the cells without such a point, whose tetrahedra overlap. Zero-volume
// tetrahedra are dropped. Cost: linear.
struct Tetrahedralization {
  Mesh mesh;
  std::vector<Id> parent;  // per tetrahedron: the cell of the mesh it was cut from
  // Vertices beyond those of the mesh: number `k` of them is the sum of centre_weight[i] times vertex centre_vertex[i],
  // i in [centre_offset[k], centre_offset[k + 1]), and so are its values. Its point_file_id is none.
  std::vector<Id> centre_offset{0};
  std::vector<Id> centre_vertex;
  std::vector<double> centre_weight;
  std::vector<Id> unfilled;  // cells, ascending
};
Tetrahedralization tetrahedralize(const Mesh& mesh);

// A field of the mesh on its tetrahedra: cells inherit, points inside cells take their weighted sum. Cost: linear.
Field tetrahedraField(const Tetrahedralization& tetrahedra, const Field& field);

}  // namespace spillikin::mesh
