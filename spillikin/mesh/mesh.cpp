#include "spillikin/mesh/mesh.h"

#include <glm/geometric.hpp>

#include "spillikin/mesh/cell_faces.h"

namespace spillikin::mesh {
namespace {

constexpr std::array<LocalFace, 4> tetrahedron_faces{{{3, {0, 1, 3}}, {3, {1, 2, 3}}, {3, {2, 0, 3}}, {3, {0, 2, 1}}}};
constexpr std::array<LocalFace, 5> pyramid_faces{
    {{4, {0, 3, 2, 1}}, {3, {0, 1, 4}}, {3, {1, 2, 4}}, {3, {2, 3, 4}}, {3, {3, 0, 4}}}};
constexpr std::array<LocalFace, 5> wedge_faces{
    {{3, {0, 1, 2}}, {3, {3, 5, 4}}, {4, {0, 3, 4, 1}}, {4, {1, 4, 5, 2}}, {4, {2, 5, 3, 0}}}};
constexpr std::array<LocalFace, 6> hexahedron_faces{
    {{4, {0, 4, 7, 3}}, {4, {1, 2, 6, 5}}, {4, {0, 1, 5, 4}}, {4, {3, 7, 6, 2}}, {4, {0, 3, 2, 1}}, {4, {4, 5, 6, 7}}}};
constexpr std::array<LocalFace, 7> pentagonal_prism_faces{{{5, {0, 4, 3, 2, 1}},
                                                           {5, {5, 6, 7, 8, 9}},
                                                           {4, {0, 1, 6, 5}},
                                                           {4, {1, 2, 7, 6}},
                                                           {4, {2, 3, 8, 7}},
                                                           {4, {3, 4, 9, 8}},
                                                           {4, {4, 0, 5, 9}}}};
constexpr std::array<LocalFace, 8> hexagonal_prism_faces{{{6, {0, 5, 4, 3, 2, 1}},
                                                          {6, {6, 7, 8, 9, 10, 11}},
                                                          {4, {0, 1, 7, 6}},
                                                          {4, {1, 2, 8, 7}},
                                                          {4, {2, 3, 9, 8}},
                                                          {4, {3, 4, 10, 9}},
                                                          {4, {4, 5, 11, 10}},
                                                          {4, {5, 0, 6, 11}}}};

}  // namespace

std::span<const LocalFace> localFaces(CellType type) {
  switch (type) {
    case CellType::tetrahedron:
      return tetrahedron_faces;
    case CellType::pyramid:
      return pyramid_faces;
    case CellType::wedge:
      return wedge_faces;
    case CellType::hexahedron:
      return hexahedron_faces;
    case CellType::pentagonal_prism:
      return pentagonal_prism_faces;
    case CellType::hexagonal_prism:
      return hexagonal_prism_faces;
    case CellType::polyhedron:
      break;
  }
  return {};
}

unsigned vertexCount(CellType type) {
  constexpr std::array<unsigned, cell_type_count> counts{4, 5, 6, 8, 10, 12, 0};
  return counts[static_cast<std::size_t>(type)];
}

const char* name(CellType type) {
  constexpr std::array<const char*, cell_type_count> names{
      "tetrahedron", "pyramid", "wedge", "hexahedron", "pentagonal prism", "hexagonal prism", "polyhedron"};
  return names[static_cast<std::size_t>(type)];
}

void surface(const Mesh& mesh, Id cell, Surface& out) {
  out.triangles.clear();
  out.face.clear();
  const FaceUse* use = mesh.cell_face.data() + mesh.cell_face_offset[cell];
  forEachPolygon(mesh, cell, [&](std::span<const Id> polygon) {
    const bool one_face = polygon.size() <= 4;  // larger polygons are stored triangle by triangle
    forEachTriangle(polygon, [&](Id a, Id b, Id c) {
      out.triangles.push_back({a, b, c});
      out.face.push_back(*use);
      if (!one_face) ++use;
    });
    if (one_face) ++use;
  });
}

double enclosedVolume(const std::vector<Vec3>& points, const Surface& surface) {
  if (surface.triangles.empty()) return 0.0;
  const Vec3& apex = points[surface.triangles.front()[0]];
  double six = 0.0;
  for (const auto& [a, b, c] : surface.triangles)
    six += glm::dot(points[a] - apex, glm::cross(points[b] - apex, points[c] - apex));
  return six / 6.0;
}

}  // namespace spillikin::mesh
