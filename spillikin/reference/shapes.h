// Cells as triangle surfaces over local vertices. Cells of one make share one pattern, so that a mesh of hexahedra
// needs at most 64 of them (six diagonals) and a mesh of tetrahedra one.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::reference {

using Local = std::uint16_t;  // index into a cell's own vertices, edges or faces

// A closed surface: every edge once, every triangle by its vertices and its edges.
struct Pattern {
  struct Triangle {
    std::array<Local, 3> vertex;
    std::array<Local, 3> edge;        // from vertex n to vertex n + 1
    std::array<std::int8_t, 3> turn;  // 1, or -1 where the edge is stored the other way round
    Local face;                       // index into Mesh::faces(cell)
  };
  std::vector<std::array<Local, 2>> edges;
  std::vector<Triangle> triangles;
  std::size_t vertices = 0;
};

Pattern makePattern(std::size_t vertices, const std::vector<std::array<Local, 3>>& triangles,
                    const std::vector<Local>& faces);

// The pattern of one tetrahedron of four vertices; its faces are numbered 0.
Pattern tetrahedronPattern();

// Every cell's pattern. Throws Error when a cell has more than 65535 vertices or faces. Cost: linear.
struct Shapes {
  explicit Shapes(const mesh::Mesh& mesh);
  std::vector<Pattern> patterns;
  std::vector<std::uint32_t> of_cell;
  std::size_t most_vertices = 4, most_edges = 6;
};

}  // namespace spillikin::reference
