#include "spillikin/composite/gl_cells.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "spillikin/base/error.h"

namespace spillikin::composite {

namespace {

using mesh::Id;

constexpr std::size_t grain = 2048;              // cells per task
constexpr std::size_t max_cell_vertices = 1024;  // ten bits each

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

CellTopology::CellTopology(const mesh::Mesh& mesh)
    : tetrahedra_(mesh.tetrahedral()), vertex_offset_(mesh.cell_vertex_offset) {
  const std::size_t cells = mesh.cell_count();
  vertex_.resize(mesh.cell_vertex.size());
  if (!tetrahedra_) {
    triangle_offset_.assign(cells + 1, 0);
  }
  const auto overCells = [&](auto&& body) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells, grain),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        mesh::Surface surface;
                        for (std::size_t c = range.begin(); c < range.end(); ++c) {
                          body(static_cast<Id>(c), surface);
                        }
                      });
  };
  overCells([&](Id c, mesh::Surface& surface) {
    const std::span<const Id> source = mesh.vertices(c);
    Id* sorted = vertex_.data() + vertex_offset_[c];
    std::copy(source.begin(), source.end(), sorted);
    std::sort(sorted, sorted + source.size());
    if (!tetrahedra_) {
      mesh::surface(mesh, c, surface);
      triangle_offset_[c + 1] = static_cast<std::uint32_t>(surface.triangles.size());
    }
  });
  for (std::size_t c = 0; c < cells; ++c) {
    max_vertices_ = std::max<std::size_t>(max_vertices_, vertex_offset_[c + 1] - vertex_offset_[c]);
    if (max_vertices_ > max_cell_vertices) {
      throw Error(
          fmt::format("{}: cell {} has {} vertices, more than the {} that the OpenGL backends number; use "
                      "--backend native",
                      mesh.name, mesh.cell_file_id[c], max_vertices_, max_cell_vertices));
    }
  }
  if (tetrahedra_) {
    return;
  }
  for (std::size_t c = 0; c < cells; ++c) {
    max_triangles_ = std::max<std::size_t>(max_triangles_, triangle_offset_[c + 1]);
    triangle_offset_[c + 1] += triangle_offset_[c];
  }
  triangle_.resize(triangle_offset_.back());
  overCells([&](Id c, mesh::Surface& surface) {
    mesh::surface(mesh, c, surface);
    packTriangles(surface, vertices(c), triangle_.data() + triangle_offset_[c]);
  });
}

std::size_t CellTopology::bytes() const {
  return sizeof(Id) * (vertex_offset_.size() + vertex_.size()) +
         sizeof(std::uint32_t) * (triangle_offset_.size() + triangle_.size());
}

BatchCapacity batchCapacity(const CellTopology& topology) {
  if (topology.tetrahedra()) {
    return {batch_cells, 4 * batch_cells, 0};
  }
  // As for hexahedra, and for at least one cell.
  return {batch_cells, std::max(8 * batch_cells, topology.max_vertices()),
          std::max(12 * batch_cells, topology.max_triangles())};
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
