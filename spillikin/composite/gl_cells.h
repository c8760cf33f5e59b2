// The cells of a batch as the shaders read them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spillikin/composite/gl_hull.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::composite {

// What the cells of a mesh are drawn as.
enum class CellShape : std::uint8_t {
  tetrahedra,  // all are
  hexahedra,   // of at most eight corners: pyramids, wedges and tetrahedra with several corners in one place
  any,         // by their boundary triangles
};

// What of a mesh the shaders need and what does not change with the view: the vertices of each cell (for `any` by
// ascending id, for `hexahedra` eight of them in VTK's order), the diagonals of a hexahedron's faces, and for `any` the
// boundary triangles as three numbers of the cell's vertices, ascending.
class CellTopology {
 public:
  // Throws Error for a cell of more vertices than can be numbered. Cost: linear, in parallel.
  explicit CellTopology(const mesh::Mesh& mesh);

  CellShape shape() const { return shape_; }
  std::span<const mesh::Id> vertices(mesh::Id cell) const {
    const std::size_t begin = stride_ > 0 ? stride_ * cell : vertex_offset_[cell];
    const std::size_t end = stride_ > 0 ? begin + stride_ : vertex_offset_[cell + 1];
    return {vertex_.data() + begin, vertex_.data() + end};
  }
  std::span<const std::uint32_t> triangles(mesh::Id cell) const {
    return shape_ != CellShape::any ? std::span<const std::uint32_t>{}
                                    : std::span<const std::uint32_t>{triangle_.data() + triangle_offset_[cell],
                                                                     triangle_.data() + triangle_offset_[cell + 1]};
  }
  // Bit i: face i, in VTK's order, is cut from its second to its fourth corner.
  std::uint32_t diagonals(mesh::Id cell) const { return diagonals_.empty() ? 0U : diagonals_[cell]; }
  std::size_t max_vertices() const { return max_vertices_; }
  std::size_t max_triangles() const { return max_triangles_; }
  // The longest diagonal of a cell's bounding box: no ray is longer in any cell.
  double longest_chord() const { return longest_chord_; }
  std::size_t bytes() const;

 private:
  void takeHexahedra(const mesh::Mesh& mesh);
  void takeAny(const mesh::Mesh& mesh);

  CellShape shape_ = CellShape::tetrahedra;
  std::size_t stride_ = 0;  // vertices of each cell, or 0 where they differ
  std::vector<mesh::Id> vertex_offset_, vertex_;
  std::vector<std::uint8_t> diagonals_;
  std::vector<std::uint32_t> triangle_offset_, triangle_;
  std::size_t max_vertices_ = 4, max_triangles_ = 4;
  double longest_chord_ = 0.0;
};

// One cell of a batch; the shaders' struct Cell.
struct CellRecord {
  Cover cover;
  std::array<float, 4> paint{};
  std::array<std::uint32_t, 4>
      at{};  // first vertex, first triangle or diagonals, triangles, planes (first << 8 | count)
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

// `max_texels`: of one buffer, as the driver has it.
BatchCapacity batchCapacity(const CellTopology& topology, std::size_t max_texels);

// Lays entries from `first` on into the chunks of one batch, as many as fit; returns the entry after the last.
std::size_t planBatch(const CellTopology& topology, const std::vector<mesh::Id>& cells, std::size_t first,
                      const BatchCapacity& capacity, std::vector<Chunk>& chunks);

}  // namespace spillikin::composite
