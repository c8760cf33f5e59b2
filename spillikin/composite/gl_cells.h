// The cells of a batch as the shaders read them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spillikin/composite/gl_hull.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::composite {

// What of a mesh the shaders need and what does not change with the view: the vertices of each cell by ascending id,
// and, unless all cells are tetrahedra, its boundary triangles as three numbers of those, ascending.
class CellTopology {
 public:
  // Throws Error for a cell of more vertices or triangles than can be numbered. Cost: linear, in parallel.
  explicit CellTopology(const mesh::Mesh& mesh);

  bool tetrahedra() const { return tetrahedra_; }
  std::span<const mesh::Id> vertices(mesh::Id cell) const {
    return {vertex_.data() + vertex_offset_[cell], vertex_.data() + vertex_offset_[cell + 1]};
  }
  std::span<const std::uint32_t> triangles(mesh::Id cell) const {
    return tetrahedra_ ? std::span<const std::uint32_t>{}
                       : std::span<const std::uint32_t>{triangle_.data() + triangle_offset_[cell],
                                                        triangle_.data() + triangle_offset_[cell + 1]};
  }
  std::size_t max_vertices() const { return max_vertices_; }
  std::size_t max_triangles() const { return max_triangles_; }
  std::size_t bytes() const;

 private:
  bool tetrahedra_ = true;
  std::vector<mesh::Id> vertex_offset_, vertex_;
  std::vector<std::uint32_t> triangle_offset_, triangle_;
  std::size_t max_vertices_ = 4, max_triangles_ = 4;
};

// One cell of a batch; the shaders' struct Cell.
struct CellRecord {
  Cover cover;
  std::array<float, 4> paint{};
  std::array<std::uint32_t, 4> at{};  // first vertex, first triangle, triangles, planes (first << 8 | count)
};
static_assert(sizeof(CellRecord) == 64);

inline constexpr std::size_t max_planes_of_cell = 255;

// A run of the order that one task fills and one call draws.
struct Chunk {
  std::size_t first = 0, end = 0;  // entries of the order
  std::size_t record = 0;          // where its records, vertices and triangles begin in the batch
  std::size_t vertex = 0, triangle = 0;
  std::size_t kept = 0;  // records filled
};

// How much one batch holds.
struct BatchCapacity {
  std::size_t cells = 0, vertices = 0, triangles = 0;
};

inline constexpr std::size_t batch_cells = 16384;
inline constexpr std::size_t chunk_cells = 512;

BatchCapacity batchCapacity(const CellTopology& topology);

// Lays entries from `first` on into the chunks of one batch, as many as fit; returns the entry after the last.
std::size_t planBatch(const CellTopology& topology, const std::vector<mesh::Id>& cells, std::size_t first,
                      const BatchCapacity& capacity, std::vector<Chunk>& chunks);

}  // namespace spillikin::composite
