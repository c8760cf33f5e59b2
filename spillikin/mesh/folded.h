// Cells whose faces cross each other.
#pragma once

#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

// The cells whose boundary triangles pass through one another, ascending: folded hexahedra and the like. Such a cell
// overlaps itself or its neighbours, so that its part of a picture means nothing. A cell that its tetrahedra fill
// without one of negative volume is not folded; of the others the triangles are tried in pairs, by exact predicates.
// Cost: linear, on all cores; nothing for tetrahedra.
std::vector<Id> foldedCells(const Mesh& mesh);

}  // namespace spillikin::mesh
