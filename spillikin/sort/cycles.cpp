#include "spillikin/sort/cycles.h"

#include "spillikin/sort/cycle_cutter.h"
#include "spillikin/sort/strong_components.h"

namespace spillikin::sort {

bool appendLeft(const mesh::Mesh& mesh, const FaceSigns& signs, const LayeredSort& layered, const Gaps* gaps,
                ProblemCells& problems, const Viewpoint& viewpoint, Order& order) {
  std::vector<mesh::Id> left, index(mesh.cell_count(), mesh::none);
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    if (!layered.left(c)) continue;
    index[c] = static_cast<mesh::Id>(left.size());
    left.push_back(c);
  }
  const auto components = strongComponents(static_cast<std::uint32_t>(left.size()), [&](std::uint32_t i, auto&& f) {
    layered.forEachAfter(left[i], [&](mesh::Id next) { f(index[next]); });
    if (gaps == nullptr) return;
    for (const mesh::Id next : gaps->edges.after(left[i]))
      f(index[next]);
  });
  bool right = true;
  CycleCutter cutter(mesh, signs, viewpoint, gaps, problems);
  std::vector<mesh::Id> cells;
  for (const auto& component : components) {
    cells.clear();
    for (const std::uint32_t i : component)
      cells.push_back(left[i]);
    if (cells.size() > 1) {
      order.cycles.push_back(cells);
      right = cutter(cells, order) && right;
      continue;
    }
    order.cells.push_back(cells.front());
    order.layer_offset.push_back(static_cast<std::uint32_t>(order.cells.size()));
  }
  return right;
}

void orderByEdges(const mesh::Mesh& mesh, const FaceSigns& signs, LayeredSort& layered, GapEdges& finder,
                  ProblemCells& problems, const Viewpoint& viewpoint, ExtraEdges& edges, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  finder(viewpoint, edges);
  order.exact = true;
  if (layered(signs, order, &edges) == mesh.cell_count()) return;
  const Gaps gaps{finder, edges};
  order.exact = appendLeft(mesh, signs, layered, &gaps, problems, viewpoint, order);
  problems.end();
}

}  // namespace spillikin::sort
