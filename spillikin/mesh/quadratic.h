// Quadratic cells as linear ones. Inside of building a mesh.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "spillikin/mesh/points.h"

namespace spillikin::mesh {

// Nodes of VTK's quadratic cell type; 0 for any other type.
unsigned quadraticNodes(std::uint8_t type);

// Linear cells in ids of the pool.
struct LinearCells {
  std::vector<CellType> type;
  std::vector<Id> offset{0};
  std::vector<Id> vertex;
  std::vector<Id> file_id;
  void add(CellType cell_type, std::span<const Id> vertices, Id file) {
    type.push_back(cell_type);
    vertex.insert(vertex.end(), vertices.begin(), vertices.end());
    offset.push_back(static_cast<Id>(vertex.size()));
    file_id.push_back(file);
  }
};

// Cuts each cell at its nodes: a tetrahedron into 8 tetrahedra, a hexahedron into 8 hexahedra, a wedge into 8 wedges
// (4 when its upright edges are straight), a pyramid into 6 pyramids and 4 tetrahedra. A triangular face becomes 4
// triangles, a quadrilateral one 4 quadrilaterals round its centre, whatever the cell, so that neighbours agree. Nodes
// that the type lacks (centres of faces and of the body) are made by the cell's shape functions, a face's centre from
// the nodes of the face alone and once for both sides.
class QuadraticCells {
 public:
  // `numbering`, of the file's points, decides which faces are the same, and the order of summing, so that centres made
  // from either side of a seam have equal coordinates.
  QuadraticCells(PointPool& pool, const Numbering& numbering) : pool_(pool), numbering_(numbering) {}

  // A centre that the file has: taken by neighbours that lack it. Call for all cells before the first subdivide().
  void knowCentres(std::uint8_t type, std::span<const std::uint32_t> nodes);
  void subdivide(std::uint8_t type, std::span<const std::uint32_t> nodes, Id file_id, LinearCells& out);

 private:
  using Corners = std::array<Id, 4>;
  Corners corners(std::span<const std::uint32_t> nodes, const std::array<std::uint8_t, 4>& local) const;
  Id faceCentre(std::span<const std::uint32_t> nodes, const std::array<std::uint8_t, 4>& corner,
                const std::array<std::uint8_t, 4>& middle);
  Id make(std::vector<Share> shares);
  void hexahedron(std::vector<Id>& nodes, std::uint8_t type, Id file_id, LinearCells& out);
  void wedge(std::vector<Id>& nodes, std::uint8_t type, Id file_id, LinearCells& out);
  void pyramid(std::vector<Id>& nodes, Id file_id, LinearCells& out);
  void tetrahedron(const std::vector<Id>& nodes, Id file_id, LinearCells& out) const;

  PointPool& pool_;
  const Numbering& numbering_;
  struct Hash {
    std::size_t operator()(const Corners& c) const {
      std::uint64_t h = 0;
      for (const Id id : c)
        h = (h ^ id) * 0x9e3779b97f4a7c15ULL, h ^= h >> 29;
      return static_cast<std::size_t>(h);
    }
  };
  std::unordered_map<Corners, Id, Hash> centre_;
};

}  // namespace spillikin::mesh
