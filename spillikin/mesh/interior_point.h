// A point inside a cell from which all of its boundary is seen.
#pragma once

#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

// A place inside a cell as a convex combination of its vertices, whose values therefore have a value there, too.
struct InteriorPoint {
  Vec3 place{0.0};
  std::vector<Id> vertex;  // the cell's, each once
  std::vector<double> weight;
};

// Finds a point that lies strictly, by the exact predicate, behind every boundary triangle of the cell. First the mean
// of the vertices; where some triangle hides it, the point is moved by the multiplicative-weights method for the game
// "a triangle against the vertices" (Freund and Schapire 1999), which finds one whenever the points that see everything
// reach deeper than about a twentieth of the cell's size, and often where they do not. False when none is found: the
// cell is folded, or no point sees it all. Cost: vertices times triangles, up to some hundred times.
bool interiorPoint(const Mesh& mesh, Id cell, const Surface& boundary, InteriorPoint& out);

}  // namespace spillikin::mesh
