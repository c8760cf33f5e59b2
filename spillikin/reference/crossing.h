// Where a line crosses the surface of a cell: exact decisions, double-precision places.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/reference/exact.h"
#include "spillikin/reference/shapes.h"

namespace spillikin::reference {

// One triangle crossed: at line.o + t line.d, with the scalar there, linear in the triangle.
struct Crossing {
  double t = 0.0, scalar = 0.0;
  Local face = 0;        // index into Mesh::faces(cell)
  bool leaving = false;  // the line leaves the side that the triangle's normal points away from
};

// Room for one cell, made once per thread.
struct CellScratch {
  std::vector<double> x, y;       // sheared coordinates of the vertices
  std::vector<double> edge;       // x_p y_q - x_q y_p of the edges
  std::vector<double> error;      // bound on the error of `edge`; 0 where it is exact
  std::vector<std::int8_t> side;  // exact sign of the perturbed `edge`
  std::vector<Crossing> crossings;
  void reserve(std::size_t vertices, std::size_t edges);
};

// Fills scratch.crossings with the crossings of the line (in both directions) and the pattern's triangles over
// `vertices`, sorted by t. Which triangles are crossed is decided exactly on the line perturbed as in exact.h: a closed
// surface is crossed an even number of times, and of the cells around an edge or a vertex on the line each loses what
// its neighbour gains. A triangle parallel to the line is never crossed. Barycentric coordinates are accurate to
// barycentric_tolerance, and t and scalar are the same bits from both sides of a shared triangle whose vertices carry
// the same values. `values` is per vertex of the mesh, or null when scalars are not wanted.
inline constexpr double barycentric_tolerance = 1e-10;
void cross(const Line& line, const std::vector<Vec3>& points, std::span<const mesh::Id> vertices,
           const Pattern& pattern, const double* values, CellScratch& scratch);

}  // namespace spillikin::reference
