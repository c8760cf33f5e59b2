#include "spillikin/composite/gl_cells.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "spillikin/base/error.h"

namespace spillikin::composite {

namespace {

using mesh::Id;

constexpr std::size_t grain = 2048;              // cells per task
constexpr std::size_t max_cell_vertices = 1024;  // ten bits each

// VTK's faces of a hexahedron; mesh::surface cuts a face from its smallest vertex.
constexpr std::size_t hexahedron_corners = 8;
constexpr std::array<std::array<std::uint8_t, 4>, 6> hexahedron_faces{
    {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}};

// The corners of a hexahedron among those of a smaller cell.
const std::array<std::uint8_t, hexahedron_corners>& cornersOf(mesh::CellType type) {
  static constexpr std::array<std::array<std::uint8_t, hexahedron_corners>, 4> corners{
      {{0, 1, 2, 2, 3, 3, 3, 3}, {0, 1, 2, 3, 4, 4, 4, 4}, {0, 1, 2, 2, 3, 4, 5, 5}, {0, 1, 2, 3, 4, 5, 6, 7}}};
  static_assert(static_cast<int>(mesh::CellType::tetrahedron) == 0 && static_cast<int>(mesh::CellType::pyramid) == 1 &&
                static_cast<int>(mesh::CellType::wedge) == 2 && static_cast<int>(mesh::CellType::hexahedron) == 3);
  return corners[static_cast<std::size_t>(type)];
}

CellShape shapeOf(const mesh::Mesh& mesh) {
  if (mesh.tetrahedral()) {
    return CellShape::tetrahedra;
  }
  const bool small = std::all_of(mesh.cell_type.begin(), mesh.cell_type.end(),
                                 [](mesh::CellType type) { return type <= mesh::CellType::hexahedron; });
  return small ? CellShape::hexahedra : CellShape::any;
}

double longestChord(const mesh::Mesh& mesh) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.cell_count(), grain), 0.0,
      [&](const tbb::blocked_range<std::size_t>& range, double longest) {
        for (std::size_t c = range.begin(); c < range.end(); ++c) {
          const std::span<const Id> vertices = mesh.vertices(static_cast<Id>(c));
          Vec3 lower = mesh.points[vertices[0]];
          Vec3 upper = lower;
          for (const Id v : vertices) {
            lower = glm::min(lower, mesh.points[v]);
            upper = glm::max(upper, mesh.points[v]);
          }
          longest = std::max(longest, glm::length(upper - lower));
        }
        return longest;
      },
      [](double a, double b) { return std::max(a, b); });
}

template <class Body>
void forEachCell(const mesh::Mesh& mesh, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.cell_count(), grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      mesh::Surface surface;
                      for (std::size_t c = range.begin(); c < range.end(); ++c) {
                        body(static_cast<Id>(c), surface);
                      }
                    });
}

// The triangles of a cell's boundary by the places of their vertices in `sorted`.
void packTriangles(const mesh::Surface& surface, std::span<const Id> sorted, std::uint32_t* out) {
  for (const std::array<Id, 3>& triangle : surface.triangles) {
    std::array<std::uint32_t, 3> place{};
    for (std::size_t i = 0; i < 3; ++i) {
      place[i] =
          static_cast<std::uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), triangle[i]) - sorted.begin());
    }
    std::sort(place.begin(), place.end());
    *out++ = place[0] | place[1] << 10U | place[2] << 20U;
  }
}

}  // namespace

CellTopology::CellTopology(const mesh::Mesh& mesh) : shape_(shapeOf(mesh)), longest_chord_(longestChord(mesh)) {
  switch (shape_) {
    case CellShape::tetrahedra:
      stride_ = 4;
      vertex_ = mesh.cell_vertex;
      break;
    case CellShape::hexahedra:
      takeHexahedra(mesh);
      break;
    case CellShape::any:
      takeAny(mesh);
      break;
  }
}

void CellTopology::takeHexahedra(const mesh::Mesh& mesh) {
  stride_ = hexahedron_corners;
  max_vertices_ = hexahedron_corners;
  vertex_.resize(stride_ * mesh.cell_count());
  diagonals_.resize(mesh.cell_count());
  forEachCell(mesh, [&](Id c, mesh::Surface&) {
    const std::span<const Id> source = mesh.vertices(c);
    Id* const corner = vertex_.data() + stride_ * c;
    const std::array<std::uint8_t, hexahedron_corners>& from = cornersOf(mesh.cell_type[c]);
    for (std::size_t i = 0; i < stride_; ++i) {
      corner[i] = source[from[i]];
    }
    for (std::size_t f = 0; f < hexahedron_faces.size(); ++f) {
      const std::array<std::uint8_t, 4>& face = hexahedron_faces[f];
      const Id even = std::min(corner[face[0]], corner[face[2]]);
      const Id odd = std::min(corner[face[1]], corner[face[3]]);
      diagonals_[c] = static_cast<std::uint8_t>(diagonals_[c] | (odd < even ? 1U << f : 0U));
    }
  });
}

void CellTopology::takeAny(const mesh::Mesh& mesh) {
  const std::size_t cells = mesh.cell_count();
  vertex_offset_ = mesh.cell_vertex_offset;
  vertex_.resize(mesh.cell_vertex.size());
  triangle_offset_.assign(cells + 1, 0);
  forEachCell(mesh, [&](Id c, mesh::Surface& surface) {
    const std::span<const Id> source = mesh.vertices(c);
    Id* sorted = vertex_.data() + vertex_offset_[c];
    std::copy(source.begin(), source.end(), sorted);
    std::sort(sorted, sorted + source.size());
    mesh::surface(mesh, c, surface);
    triangle_offset_[c + 1] = static_cast<std::uint32_t>(surface.triangles.size());
  });
  for (std::size_t c = 0; c < cells; ++c) {
    max_vertices_ = std::max<std::size_t>(max_vertices_, vertex_offset_[c + 1] - vertex_offset_[c]);
    if (max_vertices_ > max_cell_vertices) {
      throw Error(
          fmt::format("{}: cell {} has {} vertices, more than the {} that the OpenGL backends number; use "
                      "--backend native",
                      mesh.name, mesh.cell_file_id[c], max_vertices_, max_cell_vertices));
    }
    max_triangles_ = std::max<std::size_t>(max_triangles_, triangle_offset_[c + 1]);
    triangle_offset_[c + 1] += triangle_offset_[c];
  }
  triangle_.resize(triangle_offset_.back());
  forEachCell(mesh, [&](Id c, mesh::Surface& surface) {
    mesh::surface(mesh, c, surface);
    packTriangles(surface, vertices(c), triangle_.data() + triangle_offset_[c]);
  });
}

std::size_t CellTopology::bytes() const {
  return sizeof(Id) * (vertex_offset_.size() + vertex_.size()) + diagonals_.size() +
         sizeof(std::uint32_t) * (triangle_offset_.size() + triangle_.size());
}

BatchCapacity batchCapacity(const CellTopology& topology, std::size_t max_texels) {
  // Vertices and triangles as for hexahedra, and for at least one cell.
  const bool any = topology.shape() == CellShape::any;
  const std::size_t vertices =
      any ? std::max<std::size_t>(8 * batch_cells, topology.max_vertices()) : topology.max_vertices() * batch_cells;
  const std::size_t triangles = any ? std::max<std::size_t>(12 * batch_cells, topology.max_triangles()) : 0;
  constexpr std::size_t texels_per_cell = sizeof(CellRecord) / 16;
  return {std::min(batch_cells, max_texels / texels_per_cell), std::min(vertices, max_texels),
          std::min(triangles, max_texels)};
}

std::size_t planBatch(const CellTopology& topology, const std::vector<Id>& cells, std::size_t first,
                      const BatchCapacity& capacity, std::vector<Chunk>& chunks) {
  chunks.clear();
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t entry = first;
  for (; entry < cells.size() && entry - first < capacity.cells; ++entry) {
    const std::size_t more_vertices = topology.vertices(cells[entry]).size();
    const std::size_t more_triangles = topology.triangles(cells[entry]).size();
    if (vertices + more_vertices > capacity.vertices || triangles + more_triangles > capacity.triangles) {
      break;
    }
    if ((entry - first) % chunk_cells == 0) {
      chunks.push_back({entry, entry, entry - first, vertices, triangles, 0});
    }
    chunks.back().end = entry + 1;
    vertices += more_vertices;
    triangles += more_triangles;
  }
  return entry;
}

}  // namespace spillikin::composite
