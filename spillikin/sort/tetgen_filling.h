// Filling what a mesh leaves of its convex hull with tetrahedra. Nothing else in the house sees TetGen.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "spillikin/sort/convexity.h"

namespace spillikin::sort {

// Tetrahedra of positive volume between the exterior triangles and their convex hull, holes and cavities too. Every
// exterior triangle is a face of one of them or lies on the hull. Vertex ids beyond the mesh's are those of `points`.
struct Filling {
  std::vector<Vec3> points;
  std::vector<std::array<mesh::Id, 4>> tetrahedra;
  std::string failure;  // empty, or one sentence's part that says why there is none
};

// TetGen's constrained Delaunay tetrahedralization of the exterior (switches pYYQc), run in a child process: it may
// throw, exit, crash or take longer than `most_seconds` there without harm. The exterior must be of triangles; corners
// at one place count as one.
Filling fillOutside(const mesh::Mesh& mesh, const std::vector<ExteriorTriangle>& exterior, unsigned most_seconds = 120);

}  // namespace spillikin::sort
