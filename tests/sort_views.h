// Viewpoints that sorts are tried from.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {

// Viewpoints of every kind: outside, inside, far, parallel, on a vertex, on an edge, in a face's plane.
inline std::vector<Viewpoint> viewpoints(const mesh::Mesh& mesh, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Viewpoint> views;
  for (int i = 0; i < 6; ++i)
    views.emplace_back(3.0 * unit(random), 3.0 * unit(random), 3.0 * unit(random), 1.0);
  for (int i = 0; i < 3; ++i)
    views.emplace_back(0.5 + 0.4 * unit(random), 0.5, 0.5 + 0.4 * unit(random), 1.0);
  for (int i = 0; i < 3; ++i)
    views.emplace_back(unit(random), unit(random), unit(random), 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    Viewpoint v(0.0);
    v[axis] = axis == 1 ? -1.0 : 1.0;
    views.push_back(v);
  }
  views.emplace_back(1e12, -3e11, 2e12, 1.0);
  views.emplace_back(1e-200, 1.0, 0.0, 0.0);
  const auto point = [&] { return mesh.points[random() % mesh.points.size()]; };
  views.emplace_back(point(), 1.0);
  const auto& t = mesh.cell_vertex;
  views.emplace_back(0.5 * mesh.points[t[0]] + 0.5 * mesh.points[t[1]], 1.0);
  views.emplace_back(mesh.points[t[0]] + mesh.points[t[1]] - mesh.points[t[2]], 1.0);
  views.emplace_back(mesh.points[t[1]] - mesh.points[t[2]], 0.0);
  return views;
}

inline int exactSign(const mesh::Mesh& mesh, mesh::Id a, mesh::Id b, mesh::Id c, const Viewpoint& v) {
  return mesh::orientViewpoint(mesh.points[a], mesh.points[b], mesh.points[c], v);
}

}  // namespace spillikin::sort
