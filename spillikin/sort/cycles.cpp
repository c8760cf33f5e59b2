#include "spillikin/sort/cycles.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "spillikin/sort/cycle_cutter.h"
#include "spillikin/sort/strong_components.h"

namespace spillikin::sort {

namespace {

void nameCycle(const std::vector<mesh::Id>& nodes, const LayeredSort& layered, Order& order) {
  auto& cycle = order.cycles.emplace_back();
  for (const mesh::Id node : nodes)
    cycle.push_back(layered.cell(node));
  std::sort(cycle.begin(), cycle.end());
  cycle.erase(std::unique(cycle.begin(), cycle.end()), cycle.end());
}

// What the cutter made of a cycle, where it comes in the order.
void append(Order&& part, Order& order) {
  const auto shift = static_cast<std::uint32_t>(order.cells.size());
  order.cells.insert(order.cells.end(), part.cells.begin(), part.cells.end());
  for (const std::uint32_t end : part.layer_offset)
    order.layer_offset.push_back(shift + end);
  for (Cut& cut : part.cuts) {
    cut.entry += shift;
    order.cuts.push_back(std::move(cut));
  }
}

}  // namespace

bool appendLeft(const mesh::Mesh& mesh, const FaceSigns& signs, const LayeredSort& layered, const Gaps* gaps,
                ProblemCells& problems, const Viewpoint& viewpoint, Order& order) {
  std::vector<mesh::Id> left, index(layered.nodes(), mesh::none);
  for (mesh::Id node = 0; node < layered.nodes(); ++node) {
    if (!layered.left(node)) continue;
    index[node] = static_cast<mesh::Id>(left.size());
    left.push_back(node);
  }
  const auto components = strongComponents(static_cast<std::uint32_t>(left.size()), [&](std::uint32_t i, auto&& f) {
    layered.forEachAfter(left[i], [&](mesh::Id next) { f(index[next]); });
    if (gaps == nullptr) return;
    for (const mesh::Id next : gaps->edges.after(layered.cell(left[i])))
      f(index[next]);
  });
  const auto forNodes = [&](std::size_t k, std::vector<mesh::Id>& nodes) {
    nodes.clear();
    for (const std::uint32_t i : components[k])
      nodes.push_back(left[i]);
  };
  // Cycles have nothing to do with one another.
  std::vector<std::uint32_t> cyclic;
  for (std::uint32_t k = 0; k < components.size(); ++k) {
    if (components[k].size() > 1) cyclic.push_back(k);
  }
  std::vector<Order> cut(cyclic.size());
  const auto work = [&](std::size_t begin, std::size_t end) {
    CycleCutter cutter(mesh, signs, viewpoint, gaps, problems, layered.parted());
    std::vector<mesh::Id> nodes;
    for (std::size_t i = begin; i < end; ++i) {
      forNodes(cyclic[i], nodes);
      cut[i].exact = cutter(nodes, cut[i]);
    }
  };
  if (problems.subdivides()) {
    work(0, cyclic.size());  // into pools that all share
  } else {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cyclic.size()),
                      [&](const auto& range) { work(range.begin(), range.end()); });
  }
  bool right = true;
  std::vector<mesh::Id> nodes;
  std::size_t next = 0;
  for (std::uint32_t k = 0; k < components.size(); ++k) {
    forNodes(k, nodes);
    if (nodes.size() > 1) {
      nameCycle(nodes, layered, order);
      right = cut[next].exact && right;
      append(std::move(cut[next++]), order);
      continue;
    }
    if (layered.parted() != nullptr) layered.parted()->addCut(nodes.front(), order);
    order.cells.push_back(layered.cell(nodes.front()));
    order.layer_offset.push_back(static_cast<std::uint32_t>(order.cells.size()));
  }
  return right;
}

void orderByEdges(const mesh::Mesh& mesh, const FaceSigns& signs, LayeredSort& layered, GapEdges& finder,
                  ProblemCells& problems, const PartedCells& parted, const Viewpoint& viewpoint, ExtraEdges& edges,
                  Order& order) {
  order.cycles.clear();
  finder(viewpoint, edges);
  order.exact = true;
  const bool all = layered(signs, order, &edges, nullptr, &parted);
  parted.list(order);
  if (all) return;
  const Gaps gaps{finder, edges};
  order.exact = appendLeft(mesh, signs, layered, &gaps, problems, viewpoint, order);
  problems.end();
}

}  // namespace spillikin::sort
