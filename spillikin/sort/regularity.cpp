#include "spillikin/sort/regularity.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <numeric>
#include <vector>

#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

int crease(const mesh::Mesh& mesh, const Hinge& h, std::span<const double> heights) {
  const mesh::Id* v = mesh.cell_vertex.data() + 4 * std::size_t{h.cell};
  const std::array<mesh::Id, 5> at{v[0], v[1], v[2], v[3], h.apex};
  std::array<Vec3, 5> points;
  for (std::size_t i = 0; i < 5; ++i)
    points[i] = mesh.points[at[i]];
  if (heights.empty()) return mesh::aboveLift(points);
  return mesh::aboveLift(points, {heights[at[0]], heights[at[1]], heights[at[2]], heights[at[3]], heights[at[4]]});
}

// Whether the faces join cells to trees.
bool forest(const mesh::Mesh& mesh, const std::vector<mesh::Id>& faces) {
  std::vector<mesh::Id> parent(faces.empty() ? 0 : mesh.cell_count());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](mesh::Id i) {
    while (parent[i] != i)
      i = parent[i] = parent[parent[i]];
    return i;
  };
  return std::all_of(faces.begin(), faces.end(), [&](mesh::Id f) {
    const mesh::Id a = root(mesh.triangle_cells[f][0]), b = root(mesh.triangle_cells[f][1]);
    parent[a] = b;
    return a != b;
  });
}

}  // namespace

Hinge hinge(const mesh::Mesh& mesh, mesh::Id face) {
  const auto [cell, neighbour] = mesh.triangle_cells[face];
  unsigned slot = 0;
  while (slot < 3 && mesh.cell_face[4 * std::size_t{neighbour} + slot].face() != face)
    ++slot;
  return {cell, neighbour, oppositeVertex(mesh, neighbour, slot)};
}

Regularity regularity(const mesh::Mesh& mesh, std::span<const double> heights, bool ordered_only) {
  Regularity all;
  std::vector<mesh::Id> tied;
  std::mutex join;
  std::atomic<bool> stop{false};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.triangle_count(), 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      if (stop.load(std::memory_order_relaxed)) return;
                      Regularity here;
                      std::vector<mesh::Id> tied_here;
                      for (std::size_t f = range.begin(); f < range.end(); ++f) {
                        if (mesh.triangle_cells[f][1] == mesh::none) continue;
                        const int sign = crease(mesh, hinge(mesh, static_cast<mesh::Id>(f)), heights);
                        here.regular += sign > 0 ? 1 : 0;
                        here.irregular += sign < 0 ? 1 : 0;
                        if (sign == 0) tied_here.push_back(static_cast<mesh::Id>(f));
                      }
                      if (ordered_only && here.irregular > 0) stop.store(true, std::memory_order_relaxed);
                      const std::lock_guard lock(join);
                      all.regular += here.regular;
                      all.irregular += here.irregular;
                      tied.insert(tied.end(), tied_here.begin(), tied_here.end());
                    });
  all.tied = tied.size();
  all.ties_are_trees = forest(mesh, tied);
  return all;
}

}  // namespace spillikin::sort
