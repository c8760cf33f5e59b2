// Cells on their way from the file to the mesh: vertices numbered, order still the file's. Inside of building a mesh.
#pragma once

#include <vector>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/points.h"

namespace spillikin::mesh {

struct RawCells {
  std::vector<CellType> type;
  std::vector<Id> offset;  // type.size() + 1
  std::vector<Id> vertex;
  std::vector<Id> file_id;
  std::vector<std::uint8_t> dropped;  // empty, or nonzero where the cell is not to become part of the mesh
};

// Turns over the cells of negative volume and drops those of zero volume, both exactly, with counts.
void orient(const PointPool& pool, const Numbering& numbering, RawCells& cells, BuildReport& report);

// The mesh without its faces: cells ordered by their smallest vertices, points that no cell uses dropped. Empties
// `cells`.
Mesh arrange(const PointPool& pool, const Numbering& numbering, RawCells& cells);

}  // namespace spillikin::mesh
