// From a source to a mesh: cells oriented, cleaned and renumbered, faces matched.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

// What was found and done on the way; `spillikin info` prints it.
struct BuildReport {
  std::size_t source_points = 0, source_cells = 0;
  std::size_t merged_points = 0;      // points at exactly equal coordinates, with equal values, that became one
  std::size_t coincident_points = 0;  // at equal coordinates but with different values: kept apart, matched by place
  std::size_t unused_points = 0;
  std::size_t left_out = 0;         // ghost, blanked, hidden
  std::size_t lower_dimension = 0;  // vertices, lines, surface cells
  std::size_t unsupported = 0;      // 3D cells of a type that is not drawn
  std::map<int, std::size_t> unsupported_types;
  std::size_t quadratic = 0;          // subdivided into linear cells
  std::size_t collapsed = 0;          // with repeated ids, became the cell that they are
  std::size_t degenerate = 0;         // of zero volume, dropped
  std::size_t unclosed = 0;           // polyhedra whose faces do not close, left out
  std::size_t inverted = 0;           // negative volume as read, turned over
  std::vector<std::string> warnings;  // one line each
};

// Builds the mesh. Points that no cell uses are dropped. Points at exactly equal coordinates become one when all point
// arrays agree there. Every cell is oriented by its volume. Linear in the size of the source, in parallel.
// Throws Error: coordinates that are not finite in a used point (count and first file ids), connectivity out of range,
// a face of more than two cells (the cells' file ids), no three-dimensional cell at all, more than 2^31 faces.
Mesh build(const Source& source, BuildReport* report = nullptr);

// Orders, for a mesh whose points, cell_type, cell_vertex* and polyhedron tables are filled, its faces and adjacency.
// Same errors for faces of more than two cells. build() calls it; so does whoever makes a mesh from a mesh. Two cells
// that lie on the same side of their common face overlap; each then keeps the face as an exterior one of its own, and
// the number of such faces is returned. Linear, in parallel.
std::size_t matchFaces(Mesh& mesh);

// What is quickly counted. Cost: a look at every cell and face.
struct Counts {
  std::array<std::size_t, cell_type_count> cells_by_type{};
  std::size_t exterior_faces = 0;
  std::size_t bytes = 0;  // held by the mesh
};
Counts count(const Mesh& mesh);

// What only a look at the finished mesh tells; for `spillikin info`. Linear, apart from the components (near linear).
struct Inspection : Counts {
  std::size_t components = 0;           // of cells joined by faces
  std::size_t nonplanar_faces = 0;      // quadrilaterals whose two triangles do not lie exactly in one plane
  std::size_t fanned_faces = 0;         // polygons of five and more corners, drawn as the fan of triangles
  std::size_t nonplanar_fans = 0;       // those whose corners do not lie in one plane, beyond rounding
  std::size_t nonconvex_cells = 0;      // a vertex lies outside the plane of a boundary triangle, beyond rounding
  std::size_t nonconvex_polyhedra = 0;  // those of them without a fixed form
  std::size_t folded_cells = 0;         // whose faces cross each other (folded.h)
  std::size_t nonmatching_faces = 0;    // exterior quadrilaterals that two exterior triangles cover, corner to corner
  Vec3 lower{0.0}, upper{0.0};          // bounding box
  double volume = 0.0;                  // sum over cells
};
Inspection inspect(const Mesh& mesh);

}  // namespace spillikin::mesh
