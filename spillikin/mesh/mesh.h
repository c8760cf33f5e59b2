// The mesh every room works on: points, cells, faces and who touches whom, as structure of arrays with 32-bit ids.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/mesh/source.h"

namespace spillikin::mesh {

using Id = std::uint32_t;
inline constexpr Id none = std::numeric_limits<Id>::max();

// The cells that are drawn. Voxels, collapsed, quadratic and convex-point-set cells have become one of these.
enum class CellType : std::uint8_t {
  tetrahedron,
  pyramid,
  wedge,
  hexahedron,
  pentagonal_prism,
  hexagonal_prism,
  polyhedron
};
inline constexpr std::size_t cell_type_count = 7;
const char* name(CellType type);

// A cell's way to one of its faces: the face's id and on which side of it the cell lies. Side 0 is the cell that the
// face's normal (right hand along its vertices) points away from.
struct FaceUse {
  Id packed = 0;
  Id face() const { return packed >> 1; }
  unsigned side() const { return packed & 1U; }
};

// Vertices, cells and faces are numbered along a space-filling curve; file ids are kept for messages and outputs.
//
// Corners. Cell c has the vertices cell_vertex[cell_vertex_offset[c] .. cell_vertex_offset[c + 1]), in VTK's order for
// its type and with positive volume (a polyhedron: each vertex once, ascending). Two vertices may lie at one point when
// their values differ; they then have neighbouring ids and equal coordinates, and faces match by place, not by id.
// Values therefore belong to the vertices that a cell names, not to those that a shared face names; any rule that
// compares ids (the smallest vertex of a face) gives the same answer from both sides.
//
// Faces. Triangles come first, then quadrilaterals: face f < triangle_count() is triangle f, the rest quadrilateral
// f - triangle_count(). A quadrilateral starts at its smallest vertex, so that its diagonal is vertices 0 to 2 and its
// triangles are (0,1,2) and (0,2,3). A face of five or more vertices is stored as the fan of triangles from its
// smallest vertex. cells[0] lies on side 0, cells[1] on side 1; an exterior face has cells[1] == none.
struct Mesh {
  std::string name;  // the file, for messages

  std::vector<Vec3> points;
  std::vector<Id> point_file_id;  // for each vertex, the file's; for a made one, see made_offset

  std::vector<CellType> cell_type;
  std::vector<Id> cell_vertex_offset;  // cell_count() + 1
  std::vector<Id> cell_vertex;
  std::vector<Id> cell_file_id;  // for each cell, the file's; several cells may come from one (subdivided quadratics)

  std::vector<std::array<Id, 3>> triangle;
  std::vector<std::array<Id, 2>> triangle_cells;
  std::vector<std::array<Id, 4>> quad;
  std::vector<std::array<Id, 2>> quad_cells;

  // Cell c uses the faces cell_face[cell_face_offset[c] .. cell_face_offset[c + 1]).
  std::vector<Id> cell_face_offset;  // cell_count() + 1
  std::vector<FaceUse> cell_face;

  // For polyhedra alone: the polygons of cell c, outward, as the cell's own vertices, in the order of cell_face. Cell
  // c's polygons are polygon_offset[polyhedron_polygons[k] .. polyhedron_polygons[k + 1]), k = polyhedron_index[c].
  std::vector<Id> polyhedron_index;     // per cell, or empty when the mesh has no polyhedra; none for other types
  std::vector<Id> polyhedron_polygons;  // per polyhedron + 1
  std::vector<Id> polygon_offset;       // per polygon + 1
  std::vector<Id> polygon_vertex;

  // Vertices made on the way: nodes that quadratic cells lack. Vertex v with point_file_id[v] == the file's number of
  // points + k is the sum of made_weight[i] times file point made_point[i], i in [made_offset[k], made_offset[k + 1]),
  // and so are its values. All empty when there are none.
  std::vector<Id> made_offset;
  std::vector<Id> made_point;
  std::vector<double> made_weight;

  std::size_t cell_count() const { return cell_type.size(); }
  std::size_t triangle_count() const { return triangle.size(); }
  std::size_t quad_count() const { return quad.size(); }
  std::size_t face_count() const { return triangle.size() + quad.size(); }
  bool tetrahedral() const { return cell_vertex.size() == 4 * cell_count() && !has_polyhedra(); }
  bool has_polyhedra() const { return !polyhedron_index.empty(); }

  std::span<const Id> vertices(Id cell) const {
    return {cell_vertex.data() + cell_vertex_offset[cell], cell_vertex.data() + cell_vertex_offset[cell + 1]};
  }
  std::span<const FaceUse> faces(Id cell) const {
    return {cell_face.data() + cell_face_offset[cell], cell_face.data() + cell_face_offset[cell + 1]};
  }
  std::array<Id, 2> cells(Id face) const {
    return face < triangle.size() ? triangle_cells[face] : quad_cells[face - triangle.size()];
  }
  bool exterior(Id face) const { return cells(face)[1] == none; }
  // The cell on the other side, or none.
  Id neighbour(FaceUse use) const { return cells(use.face())[1U - use.side()]; }
};

// The boundary of one cell as triangles, outward, in the cell's own vertices: a quadrilateral gives the two of its
// diagonal, a polygon its fan, so that the cells on both sides have the same triangles. Reused from cell to cell, it
// stops allocating.
struct Surface {
  std::vector<std::array<Id, 3>> triangles;
  std::vector<FaceUse> face;  // of each triangle, the face it is (part of)
};

// Fills `out` with the boundary of `cell`. Cost: linear in the faces of the cell.
void surface(const Mesh& mesh, Id cell, Surface& out);

// The volume inside a closed surface whose vertices lie at `points`: the sum of the cones from one vertex, so that it
// is right for any shape; negative where the triangles face inward. In double, not exact. 0 without triangles.
double enclosedVolume(const std::vector<Vec3>& points, const Surface& surface);

}  // namespace spillikin::mesh
