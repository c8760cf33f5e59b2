#include "spillikin/sort/cycles.h"

#include <algorithm>

#include "spillikin/sort/strong_components.h"

namespace spillikin::sort {
namespace {

// Farthest mean vertex first.
void sortByDepth(const mesh::Mesh& mesh, const Viewpoint& viewpoint, std::vector<mesh::Id>& cells) {
  std::vector<std::pair<double, mesh::Id>> keyed;
  for (const mesh::Id cell : cells) {
    Vec3 mean(0.0);
    for (const mesh::Id v : mesh.vertices(cell))
      mean += mesh.points[v];
    mean /= static_cast<double>(mesh.vertices(cell).size());
    const Vec3 away = viewpoint.w == 0.0 ? mean : mean - Vec3(viewpoint);
    const Vec3 along = viewpoint.w == 0.0 ? Vec3(viewpoint) : -away;
    keyed.emplace_back(away.x * along.x + away.y * along.y + away.z * along.z, cell);
  }
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t i = 0; i < cells.size(); ++i)
    cells[i] = keyed[i].second;
}

}  // namespace

bool appendLeft(const mesh::Mesh& mesh, const LayeredSort& layered, const ExtraEdges* extra, const Viewpoint& viewpoint,
                Order& order) {
  std::vector<mesh::Id> left, index(mesh.cell_count(), mesh::none);
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    if (!layered.left(c)) continue;
    index[c] = static_cast<mesh::Id>(left.size());
    left.push_back(c);
  }
  const auto components = strongComponents(static_cast<std::uint32_t>(left.size()), [&](std::uint32_t i, auto&& f) {
    layered.forEachAfter(left[i], [&](mesh::Id next) { f(index[next]); });
    if (extra == nullptr || extra->empty()) return;
    for (const mesh::Id next : extra->after(left[i]))
      f(index[next]);
  });
  bool acyclic = true;
  std::vector<mesh::Id> cells;
  for (const auto& component : components) {
    cells.clear();
    for (const std::uint32_t i : component)
      cells.push_back(left[i]);
    if (cells.size() > 1) {
      acyclic = false;
      order.cycles.push_back(cells);
      sortByDepth(mesh, viewpoint, cells);
    }
    for (const mesh::Id cell : cells) {
      order.cells.push_back(cell);
      order.layer_offset.push_back(static_cast<std::uint32_t>(order.cells.size()));
    }
  }
  return acyclic;
}

}  // namespace spillikin::sort
