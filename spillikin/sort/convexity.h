// Whether a mesh fills a convex region, decided exactly.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// A triangle of the mesh's exterior, outward, and the face it is (half of).
struct ExteriorTriangle {
  std::array<mesh::Id, 3> corner;
  mesh::Id face = 0;
  mesh::Id cell = 0;
};
// By face id; a quadrilateral gives its two halves, first half first. Cost: linear in the faces.
std::vector<ExteriorTriangle> exteriorTriangles(const mesh::Mesh& mesh);

struct Convexity {
  bool convex = false;
  std::string why;  // when not: what was found, part of a sentence
};

// Convex: the exterior triangles form one closed surface with two triangles at every edge and the Euler characteristic
// of a sphere, and no triangle rises above the plane of a neighbour (exact orientation tests). A closed surface that is
// convex at every edge bounds a convex body; and since every cell has positive volume and neighbours lie on different
// sides of their face, every point inside is covered once. Cost: sorting the exterior's edges.
Convexity convexity(const mesh::Mesh& mesh, const std::vector<ExteriorTriangle>& exterior);

}  // namespace spillikin::sort
