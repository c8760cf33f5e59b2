// The faces of the fixed cell types, in VTK's vertex order, each outward (right hand) for a cell of positive volume.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

struct LocalFace {
  std::uint8_t size = 0;
  std::array<std::uint8_t, 6> vertex{};  // positions in the cell's vertices
};

// Empty for a polyhedron, whose polygons are in the mesh. Order: the order of Mesh::cell_face, a face of five or six
// vertices standing for its fan of triangles.
std::span<const LocalFace> localFaces(CellType type);

// Vertices of the type; 0 for a polyhedron.
unsigned vertexCount(CellType type);

// Calls visit(polygon) with every face of `cell` as ids of the cell's own vertices, outward, in the order of
// Mesh::cell_face. The span is good during the call only.
template <class Visit>
void forEachPolygon(const Mesh& mesh, Id cell, const Visit& visit) {
  if (mesh.cell_type[cell] == CellType::polyhedron) {
    const Id k = mesh.polyhedron_index[cell];
    for (Id p = mesh.polyhedron_polygons[k]; p < mesh.polyhedron_polygons[k + 1]; ++p) {
      visit(std::span<const Id>(mesh.polygon_vertex.data() + mesh.polygon_offset[p],
                                mesh.polygon_vertex.data() + mesh.polygon_offset[p + 1]));
    }
    return;
  }
  const std::span<const Id> vertices = mesh.vertices(cell);
  std::array<Id, 6> polygon;
  for (const LocalFace& face : localFaces(mesh.cell_type[cell])) {
    for (unsigned i = 0; i < face.size; ++i)
      polygon[i] = vertices[face.vertex[i]];
    visit(std::span<const Id>(polygon.data(), face.size));
  }
}

// Where the smallest id stands in the polygon: the corner that its triangles fan out from.
inline std::size_t smallestCorner(std::span<const Id> polygon) {
  std::size_t smallest = 0;
  for (std::size_t i = 1; i < polygon.size(); ++i) {
    if (polygon[i] < polygon[smallest]) smallest = i;
  }
  return smallest;
}

// Calls visit(a, b, c) with the triangles of a polygon: its fan from the smallest id.
template <class Visit>
void forEachTriangle(std::span<const Id> polygon, const Visit& visit) {
  const std::size_t n = polygon.size();
  const std::size_t start = n == 3 ? 0 : smallestCorner(polygon);
  const auto corner = [&](std::size_t i) { return polygon[start + i < n ? start + i : start + i - n]; };
  for (std::size_t i = 1; i + 1 < n; ++i)
    visit(corner(0), corner(i), corner(i + 1));
}

}  // namespace spillikin::mesh
