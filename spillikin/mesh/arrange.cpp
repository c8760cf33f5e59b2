// Cells along the curve: in the order of their two smallest vertices, which the points' curve has numbered.
#include <algorithm>
#include <atomic>

#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/raw_cells.h"

namespace spillikin::mesh {
namespace {

std::vector<std::uint32_t> cellOrder(const RawCells& cells, std::size_t vertices) {
  std::vector<std::uint32_t> order;
  order.reserve(cells.type.size());
  for (std::size_t c = 0; c < cells.type.size(); ++c) {
    if (cells.dropped[c] == 0) order.push_back(static_cast<std::uint32_t>(c));
  }
  std::vector<std::uint64_t> keys(order.size());
  parallelFor(order.size(), [&](std::size_t i) {
    Id first = none, second = none;
    for (Id k = cells.offset[order[i]]; k < cells.offset[order[i] + 1]; ++k) {
      const Id v = cells.vertex[k];
      second = std::min(second, std::max(first, v));
      first = std::min(first, v);
    }
    keys[i] = static_cast<std::uint64_t>(first) * vertices + second;
  });
  radixSort(keys, order);
  return order;
}

// The vertices' new ids when those that no cell uses are dropped; empty when all are used.
std::vector<Id> keepUsed(const RawCells& cells, const std::vector<std::uint32_t>& order, std::size_t vertices,
                         std::vector<Id>& kept) {
  std::vector<std::uint8_t> used(vertices, 0);
  parallelFor(order.size(), [&](std::size_t i) {
    for (Id k = cells.offset[order[i]]; k < cells.offset[order[i] + 1]; ++k) {
      std::atomic_ref<std::uint8_t>(used[cells.vertex[k]]).store(1, std::memory_order_relaxed);
    }
  });
  std::vector<Id> renumbered(vertices, none);
  for (std::size_t v = 0; v < vertices; ++v) {
    if (used[v] == 0) continue;
    renumbered[v] = static_cast<Id>(kept.size());
    kept.push_back(static_cast<Id>(v));
  }
  return renumbered;
}

void arrangePolyhedra(const RawCells& cells, const std::vector<std::uint32_t>& order, const std::vector<Id>& renumbered,
                      Mesh& mesh) {
  if (cells.polyhedron_index.empty()) return;
  mesh.polyhedron_index.assign(order.size(), none);
  mesh.polyhedron_polygons.assign(1, 0);
  mesh.polygon_offset.assign(1, 0);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (cells.type[order[i]] != CellType::polyhedron) continue;
    mesh.polyhedron_index[i] = static_cast<Id>(mesh.polyhedron_polygons.size() - 1);
    cells.forEachPolygon(order[i], [&](std::span<const Id> polygon) {
      for (const Id v : polygon)
        mesh.polygon_vertex.push_back(renumbered[v]);
      mesh.polygon_offset.push_back(static_cast<Id>(mesh.polygon_vertex.size()));
    });
    mesh.polyhedron_polygons.push_back(static_cast<Id>(mesh.polygon_offset.size() - 1));
  }
  if (mesh.polyhedron_polygons.size() > 1) return;
  mesh.polyhedron_index.clear();  // all of them were dropped
  mesh.polyhedron_polygons.clear();
  mesh.polygon_offset.clear();
}

void keepShares(const PointPool& pool, Mesh& mesh) {
  if (pool.made() == 0) return;
  mesh.made_offset.assign(1, 0);
  for (std::size_t i = pool.fromFile(); i < pool.size(); ++i) {
    for (const Share& share : pool.shares(i)) {
      mesh.made_point.push_back(share.point);
      mesh.made_weight.push_back(share.weight);
    }
    mesh.made_offset.push_back(static_cast<Id>(mesh.made_point.size()));
  }
}

}  // namespace

Mesh arrange(const PointPool& pool, const Numbering& numbering, RawCells& cells) {
  const std::vector<std::uint32_t> order = cellOrder(cells, numbering.point.size());
  std::vector<Id> kept;
  const std::vector<Id> renumbered = keepUsed(cells, order, numbering.point.size(), kept);

  Mesh mesh;
  mesh.points.resize(kept.size());
  mesh.point_file_id.resize(kept.size());
  parallelFor(kept.size(), [&](std::size_t v) {
    mesh.point_file_id[v] = numbering.point[kept[v]];
    mesh.points[v] = pool[mesh.point_file_id[v]];
  });

  const std::size_t n = order.size();
  mesh.cell_type.resize(n);
  mesh.cell_file_id.resize(n);
  mesh.cell_vertex_offset.resize(n + 1);
  Id total = 0;  // cannot overflow: the raw cells' offsets did not
  for (std::size_t i = 0; i < n; ++i) {
    mesh.cell_vertex_offset[i] = total;
    total += cells.offset[order[i] + 1] - cells.offset[order[i]];
  }
  mesh.cell_vertex_offset[n] = total;
  mesh.cell_vertex.resize(total);
  parallelFor(n, [&](std::size_t i) {
    const Id c = order[i];
    mesh.cell_type[i] = cells.type[c];
    mesh.cell_file_id[i] = cells.file_id[c];
    Id to = mesh.cell_vertex_offset[i];
    for (Id k = cells.offset[c]; k < cells.offset[c + 1]; ++k)
      mesh.cell_vertex[to++] = renumbered[cells.vertex[k]];
  });
  arrangePolyhedra(cells, order, renumbered, mesh);
  keepShares(pool, mesh);
  cells = {};
  return mesh;
}

}  // namespace spillikin::mesh
