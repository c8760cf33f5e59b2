#include "tests/support/mesh_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <set>

namespace spillikin::tests {

using mesh::FaceUse;
using mesh::Id;
using mesh::Mesh;

double volume(const Mesh& mesh, Id cell) {
  mesh::Surface boundary;
  mesh::surface(mesh, cell, boundary);
  const Vec3 origin = mesh.points[mesh.vertices(cell)[0]];
  double sum = 0.0;
  for (const auto& t : boundary.triangles) {
    sum += glm::dot(mesh.points[t[0]] - origin, glm::cross(mesh.points[t[1]] - origin, mesh.points[t[2]] - origin));
  }
  return sum / 6.0;
}

double volume(const Mesh& mesh) {
  double sum = 0.0;
  for (Id cell = 0; cell < mesh.cell_count(); ++cell)
    sum += volume(mesh, cell);
  return sum;
}

namespace {

using Place = std::array<double, 3>;
Place place(const Mesh& mesh, Id v) {
  return {mesh.points[v].x, mesh.points[v].y, mesh.points[v].z};
}

// Rotated so that the smallest comes first: two triangles are the same, and the same way round, when these are equal.
std::array<Place, 3> canonical(const Mesh& mesh, Id a, Id b, Id c) {
  std::array<Place, 3> t{place(mesh, a), place(mesh, b), place(mesh, c)};
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

// The triangles of the face as seen from a side: outward for the cell there.
std::multiset<std::array<Place, 3>> faceTriangles(const Mesh& mesh, Id face, unsigned side) {
  std::multiset<std::array<Place, 3>> result;
  const auto add = [&](Id a, Id b, Id c) {
    result.insert(side == 0 ? canonical(mesh, a, b, c) : canonical(mesh, a, c, b));
  };
  if (face < mesh.triangle_count()) {
    const auto& t = mesh.triangle[face];
    add(t[0], t[1], t[2]);
  } else {
    const auto& q = mesh.quad[face - mesh.triangle_count()];
    add(q[0], q[1], q[2]);
    add(q[0], q[2], q[3]);
  }
  return result;
}

void checkCell(const Mesh& mesh, Id cell) {
  mesh::Surface boundary;
  mesh::surface(mesh, cell, boundary);
  const auto vertices = mesh.vertices(cell);
  std::map<std::pair<Id, Id>, int> edges;
  std::map<Id, std::multiset<std::array<Place, 3>>> triangles;
  std::map<Id, unsigned> side;
  for (std::size_t i = 0; i < boundary.triangles.size(); ++i) {
    const auto& t = boundary.triangles[i];
    for (unsigned k = 0; k < 3; ++k) {
      ASSERT_NE(std::find(vertices.begin(), vertices.end(), t[k]), vertices.end()) << "cell " << cell;
      ++edges[{t[k], t[(k + 1) % 3]}];
    }
    const FaceUse use = boundary.face[i];
    triangles[use.face()].insert(canonical(mesh, t[0], t[1], t[2]));
    side[use.face()] = use.side();
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, (edges[{edge.second, edge.first}])) << "open edge in cell " << cell;
  }
  ASSERT_EQ(triangles.size(), mesh.faces(cell).size()) << "cell " << cell;
  for (const FaceUse use : mesh.faces(cell)) {
    ASSERT_LT(use.face(), mesh.face_count());
    ASSERT_EQ(mesh.cells(use.face())[use.side()], cell);
    ASSERT_EQ(side[use.face()], use.side());
    ASSERT_EQ(triangles[use.face()], faceTriangles(mesh, use.face(), use.side())) << "cell " << cell;
  }
  ASSERT_GT(volume(mesh, cell), 0.0) << "cell " << cell;
}

void checkFaces(const Mesh& mesh) {
  std::map<std::multiset<Place>, Id> seen;  // the same corners come again only where cells overlap
  for (Id face = 0; face < mesh.face_count(); ++face) {
    const bool triangle = face < mesh.triangle_count();
    const Id* v = triangle ? mesh.triangle[face].data() : mesh.quad[face - mesh.triangle_count()].data();
    const std::size_t size = triangle ? 3 : 4;
    ASSERT_EQ(std::min_element(v, v + size), v) << "face " << face;
    const auto cells = mesh.cells(face);
    ASSERT_LT(cells[0], mesh.cell_count());
    ASSERT_EQ(mesh.exterior(face), cells[1] == mesh::none);
    for (unsigned side = 0; side < (mesh.exterior(face) ? 1U : 2U); ++side) {
      const auto uses = mesh.faces(cells[side]);
      ASSERT_EQ(1, std::count_if(uses.begin(), uses.end(),
                                 [&](FaceUse use) { return use.face() == face && use.side() == side; }));
    }
    std::multiset<Place> corners;
    for (std::size_t i = 0; i < size; ++i)
      corners.insert(place(mesh, v[i]));
    const auto [before, fresh] = seen.try_emplace(corners, face);
    ASSERT_TRUE(fresh || (mesh.exterior(face) && mesh.exterior(before->second)))
        << "face " << face << " is there twice";
  }
}

void checkPoints(const Mesh& mesh) {
  ASSERT_EQ(mesh.point_file_id.size(), mesh.points.size());
  std::vector<bool> used(mesh.points.size(), false);
  for (const Id v : mesh.cell_vertex) {
    ASSERT_LT(v, mesh.points.size());
    used[v] = true;
  }
  ASSERT_EQ(std::count(used.begin(), used.end(), false), 0);
  std::map<Place, Id> last;
  for (Id v = 0; v < mesh.points.size(); ++v) {
    const auto found = last.find(place(mesh, v));
    if (found != last.end()) {
      ASSERT_EQ(found->second + 1, v) << "vertices at one point are apart";
    }
    last[place(mesh, v)] = v;
  }
}

}  // namespace

void checkInvariants(const Mesh& mesh) {
  ASSERT_EQ(mesh.cell_vertex_offset.size(), mesh.cell_count() + 1);
  ASSERT_EQ(mesh.cell_face_offset.size(), mesh.cell_count() + 1);
  ASSERT_EQ(mesh.cell_file_id.size(), mesh.cell_count());
  ASSERT_EQ(mesh.triangle_cells.size(), mesh.triangle_count());
  ASSERT_EQ(mesh.quad_cells.size(), mesh.quad_count());
  checkPoints(mesh);
  checkFaces(mesh);
  for (Id cell = 0; cell < mesh.cell_count() && !testing::Test::HasFatalFailure(); ++cell)
    checkCell(mesh, cell);
}

}  // namespace spillikin::tests
