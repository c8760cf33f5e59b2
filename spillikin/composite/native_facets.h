// What of a cell's faces stays with the mesh: in which order a face's corners are to be taken, so that both its cells
// come to the same bits, which quadrilaterals bend inwards, and whether the cell is what the planes of its triangles
// bound.
//
// A cell with inward bends is such a one where a ray crosses the plane of a triangle only once on its way out: take for
// each face the intersection of its triangles' half-spaces, or, where it bends inwards, their union. The cell is the
// intersection of these sets if (a) with the other diagonal in place of each inward one it is convex, and (b) some
// point lies inside the planes of all triangles. For by (a) each set contains the cell: the part of the convex hull
// beyond both planes of an inward bend is the tetrahedron that fills it. And whoever leaves the cell on a straight line
// from the point of (b) leaves the half-space of the triangle passed; an inward bend's other half-space has been left
// before.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::composite::native {

// Three bits for each of six faces: from which place on the face's corners are read, and whether backwards; above them
// a bit for each face that bends inwards.
using FacetCode = std::uint32_t;
inline constexpr unsigned facet_bits = 3;
inline constexpr unsigned inward_shift = 18;
inline constexpr FacetCode not_of_planes = 0xffffffffU;  // the cell must be painted another way

// The faces of a cell type, up to eight, as a vector holds them: the corners' positions in the cell, four bits each and
// round once more, forwards (outward, right hand) and backwards.
struct FacetTable {
  std::array<std::uint32_t, 8> forward{}, backward{};
  unsigned faces = 0;  // a bit for each
  unsigned quads = 0;
  unsigned corners = 0;
};
const FacetTable* facetTables();  // by type, up to the hexahedron

class Facets {
 public:
  // Linear in the cells, on all cores; four bytes a cell. Nothing for a mesh of tetrahedra.
  void set(const mesh::Mesh& mesh);
  FacetCode operator[](mesh::Id cell) const { return code_[cell]; }

 private:
  std::vector<FacetCode> code_;
};

}  // namespace spillikin::composite::native
