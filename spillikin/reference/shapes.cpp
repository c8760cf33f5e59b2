#include "spillikin/reference/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "spillikin/base/error.h"

namespace spillikin::reference {
namespace {

// A cell's surface written as local indices: what two cells of one pattern have in common.
using Key = std::vector<Local>;

// Fills `key` with (number of vertices, then for each triangle its three vertices and its face).
void makeKey(const mesh::Mesh& mesh, mesh::Id cell, const mesh::Surface& surface, Key& key) {
  const auto vertices = mesh.vertices(cell);
  const auto faces = mesh.faces(cell);
  if (vertices.size() > 65535 || faces.size() > 65535) {
    throw Error(fmt::format("{}: cell {} has more than 65535 vertices or faces: cut it up", mesh.name,
                            mesh.cell_file_id[cell]));
  }
  key.clear();
  key.push_back(static_cast<Local>(vertices.size()));
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    for (const mesh::Id id : surface.triangles[t]) {
      key.push_back(static_cast<Local>(std::find(vertices.begin(), vertices.end(), id) - vertices.begin()));
    }
    const auto same = [&](const mesh::FaceUse& use) { return use.packed == surface.face[t].packed; };
    key.push_back(static_cast<Local>(std::find_if(faces.begin(), faces.end(), same) - faces.begin()));
  }
}

Pattern fromKey(const Key& key) {
  std::vector<std::array<Local, 3>> triangles;
  std::vector<Local> faces;
  for (std::size_t n = 1; n + 3 < key.size(); n += 4) {
    triangles.push_back({key[n], key[n + 1], key[n + 2]});
    faces.push_back(key[n + 3]);
  }
  return makePattern(key[0], triangles, faces);
}

}  // namespace

Pattern makePattern(std::size_t vertices, const std::vector<std::array<Local, 3>>& triangles,
                    const std::vector<Local>& faces) {
  Pattern pattern;
  pattern.vertices = vertices;
  std::map<std::array<Local, 2>, Local> edge_of;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    Pattern::Triangle triangle{triangles[t], {}, {}, faces[t]};
    for (std::size_t n = 0; n < 3; ++n) {
      const Local a = triangles[t][n], b = triangles[t][(n + 1) % 3];
      const std::array<Local, 2> edge{std::min(a, b), std::max(a, b)};
      const auto [found, fresh] = edge_of.try_emplace(edge, static_cast<Local>(pattern.edges.size()));
      if (fresh) pattern.edges.push_back(edge);
      triangle.edge[n] = found->second;
      triangle.turn[n] = a < b ? 1 : -1;
    }
    pattern.triangles.push_back(triangle);
  }
  return pattern;
}

Pattern tetrahedronPattern() {
  return makePattern(4, {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}, {0, 0, 0, 0});
}

Shapes::Shapes(const mesh::Mesh& mesh) {
  std::map<Key, std::uint32_t> known;
  mesh::Surface surface;
  Key key, previous;
  std::uint32_t index = 0;
  of_cell.resize(mesh.cell_count());
  for (mesh::Id cell = 0; cell < mesh.cell_count(); ++cell) {
    mesh::surface(mesh, cell, surface);
    makeKey(mesh, cell, surface, key);
    if (key != previous) {
      const auto [found, fresh] = known.try_emplace(key, static_cast<std::uint32_t>(patterns.size()));
      if (fresh) patterns.push_back(fromKey(key));
      index = found->second;
      std::swap(key, previous);
    }
    of_cell[cell] = index;
  }
  for (const Pattern& pattern : patterns) {
    most_vertices = std::max(most_vertices, pattern.vertices);
    most_edges = std::max(most_edges, pattern.edges.size());
  }
}

}  // namespace spillikin::reference
