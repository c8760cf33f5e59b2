// Cells on their way from the file to the mesh: vertices numbered, order still the file's. Inside of building a mesh.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/points.h"
#include "spillikin/mesh/polygons.h"

namespace spillikin::mesh {

struct RawCells {
  std::vector<CellType> type;
  std::vector<Id> offset;  // type.size() + 1
  std::vector<Id> vertex;
  std::vector<Id> file_id;
  std::vector<std::uint8_t> dropped;  // nonzero where the cell is not to become part of the mesh
  // Polyhedra: as in Mesh. Their polygons need not be outward yet, but agree on their edges.
  std::vector<Id> polyhedron_index;  // empty, or per cell
  std::vector<Id> polyhedron_polygons{0};
  Polygons polygons;

  void add(CellType cell_type, std::span<const Id> vertices, Id file);
  void addPolyhedron(const Polygons& around, Id file);
  std::span<Id> vertices(std::size_t cell) { return {vertex.data() + offset[cell], vertex.data() + offset[cell + 1]}; }
  std::span<const Id> vertices(std::size_t cell) const {
    return {vertex.data() + offset[cell], vertex.data() + offset[cell + 1]};
  }

  // Calls visit(polygon) with each polygon around the cell.
  template <class Visit>
  void forEachPolygon(std::size_t cell, const Visit& visit) const {
    if (type[cell] == CellType::polyhedron) {
      const Id k = polyhedron_index[cell];
      for (Id p = polyhedron_polygons[k]; p < polyhedron_polygons[k + 1]; ++p)
        visit(polygons[p]);
      return;
    }
    const std::span<const Id> own = vertices(cell);
    std::array<Id, 6> polygon;
    for (const LocalFace& face : localFaces(type[cell])) {
      for (unsigned i = 0; i < face.size; ++i)
        polygon[i] = own[face.vertex[i]];
      visit(std::span<const Id>(polygon.data(), face.size));
    }
  }
};

// Cells without a fixed form become those that they are. A polygon's corners are vertices of the numbering.
class IrregularCells {
 public:
  IrregularCells(const Numbering& numbering, RawCells& cells, BuildReport& report)
      : numbering_(numbering), cells_(cells), report_(report) {}

  // Whether two of the vertices lie at one place.
  bool collapsed(std::span<const Id> vertices) const;
  // A cell of a fixed type with vertices at one place: what its faces still enclose, or nothing.
  void addCollapsed(std::size_t cell);
  // Polygons in any round, from the file. Those that do not close are left out with a count.
  void addPolyhedron(const Polygons& polygons, Id file_id);

 private:
  // The number of cells that the closed polygons became.
  std::size_t addParts(const Polygons& polygons, Id file_id);
  std::size_t add(const Polygons& polygons, Id file_id);

  const Numbering& numbering_;
  RawCells& cells_;
  BuildReport& report_;
};

// Turns over the cells of negative volume and drops those of zero volume, both exactly, with counts.
void orient(const PointPool& pool, const Numbering& numbering, RawCells& cells, BuildReport& report);

// The mesh without its faces: cells ordered by their smallest vertices, points that no cell uses dropped. Empties
// `cells`.
Mesh arrange(const PointPool& pool, const Numbering& numbering, RawCells& cells);

}  // namespace spillikin::mesh
