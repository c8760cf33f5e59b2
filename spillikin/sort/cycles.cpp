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
void append(const Order& part, Order& order) {
  const auto shift = static_cast<std::uint32_t>(order.cells.size());
  order.cells.insert(order.cells.end(), part.cells.begin(), part.cells.end());
  for (const std::uint32_t end : part.layer_offset)
    order.layer_offset.push_back(shift + end);
  for (std::size_t i = 0; i < part.cuts.size(); ++i)
    order.cuts.add(part.cuts[i].entry + shift, part.cuts[i].keep);
}

// The nodes that the layered sort left, their strong components, and the order of each that is a cycle.
struct Left {
  std::vector<mesh::Id> node;
  Components components;  // of places in `node`

  void nodes(std::size_t component, std::vector<mesh::Id>& out) const {
    out.clear();
    for (const std::uint32_t i : components[component])
      out.push_back(node[i]);
  }
};

void findComponents(const LayeredSort& layered, const Gaps* gaps, Left& left) {
  std::vector<mesh::Id> index(layered.nodes(), mesh::none);
  for (mesh::Id node = 0; node < layered.nodes(); ++node) {
    if (!layered.left(node)) continue;
    index[node] = static_cast<mesh::Id>(left.node.size());
    left.node.push_back(node);
  }
  left.components = strongComponents(static_cast<std::uint32_t>(left.node.size()), [&](std::uint32_t i, auto&& f) {
    layered.forEachAfter(left.node[i], [&](mesh::Id next) { f(index[next]); });
    if (gaps == nullptr) return;
    for (const mesh::Id next : gaps->edges.after(layered.cell(left.node[i])))
      f(index[next]);
  });
}

// The orders of `count` cycles; nodesOf(i, nodes) gives the nodes of each. They have nothing to do with one another.
template <class NodesOf>
std::vector<Order> cutEach(std::size_t count, const NodesOf& nodesOf, const mesh::Mesh& mesh, const FaceSigns& signs,
                           const LayeredSort& layered, const Gaps* gaps, ProblemCells& problems,
                           const Viewpoint& viewpoint) {
  std::vector<Order> cut(count);
  const auto work = [&](std::size_t begin, std::size_t end) {
    CycleCutter cutter(mesh, signs, viewpoint, gaps, problems, layered.parted());
    std::vector<mesh::Id> nodes;
    for (std::size_t i = begin; i < end; ++i) {
      nodesOf(i, nodes);
      cut[i].exact = cutter(nodes, cut[i]);
    }
  };
  if (problems.subdivides()) {
    work(0, count);  // into pools that all share
  } else {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count),
                      [&](const auto& range) { work(range.begin(), range.end()); });
  }
  return cut;
}

// For all that is to be appended, so that the lists keep no slack of growing by doubling.
void reserveLeft(const LayeredSort& layered, const Left& left, const std::vector<Order>& cut, Order& order) {
  std::size_t cells = order.cells.size() + left.components.size() - cut.size();
  std::size_t cuts = order.cuts.size(), half_spaces = order.cuts.halfSpaces();
  for (const Order& part : cut) {
    cells += part.cells.size();
    cuts += part.cuts.size();
    half_spaces += part.cuts.halfSpaces();
  }
  for (std::uint32_t k = 0; k < left.components.size() && layered.parted() != nullptr; ++k) {
    if (left.components[k].size() > 1) continue;
    const std::size_t n = layered.parted()->halfSpaces(left.node[left.components[k].front()]);
    half_spaces += n;
    cuts += n > 0 ? 1 : 0;
  }
  order.cells.reserve(cells);
  order.layer_offset.reserve(order.layer_offset.size() + cells - order.cells.size());
  order.cuts.reserve(cuts, half_spaces);
}

}  // namespace

bool appendLeft(const mesh::Mesh& mesh, const FaceSigns& signs, const LayeredSort& layered, const Gaps* gaps,
                ProblemCells& problems, const Viewpoint& viewpoint, Order& order) {
  Left left;
  findComponents(layered, gaps, left);
  std::vector<std::uint32_t> cyclic;
  for (std::uint32_t k = 0; k < left.components.size(); ++k) {
    if (left.components[k].size() > 1) cyclic.push_back(k);
  }
  std::vector<Order> cut = cutEach(
      cyclic.size(), [&](std::size_t i, auto& nodes) { left.nodes(cyclic[i], nodes); }, mesh, signs, layered, gaps,
      problems, viewpoint);
  reserveLeft(layered, left, cut, order);
  bool right = true;
  std::vector<mesh::Id> nodes;
  std::size_t next = 0;
  for (std::uint32_t k = 0; k < left.components.size(); ++k) {
    const std::span<const std::uint32_t> component = left.components[k];
    if (component.size() > 1) {
      left.nodes(k, nodes);
      nameCycle(nodes, layered, order);
      right = cut[next].exact && right;
      append(cut[next++], order);
      continue;
    }
    const mesh::Id node = left.node[component.front()];
    if (layered.parted() != nullptr) layered.parted()->addCut(node, order);
    order.cells.push_back(layered.cell(node));
    order.layer_offset.push_back(static_cast<std::uint32_t>(order.cells.size()));
  }
  return right;
}

void groupCycles(const mesh::Mesh& mesh, const LayeredSort& layered, const Gaps* gaps, std::vector<mesh::Id>& group) {
  Left left;
  findComponents(layered, gaps, left);
  group.assign(mesh.cell_count(), mesh::none);
  std::vector<mesh::Id> joined(left.components.size());  // an earlier cycle with parts of the same cells, or itself
  const auto first = [&](mesh::Id k) {
    while (joined[k] != k)
      k = joined[k];
    return k;
  };
  std::vector<mesh::Id> nodes;
  for (mesh::Id k = 0; k < left.components.size(); ++k) {
    joined[k] = k;
    left.nodes(k, nodes);
    if (nodes.size() < 2) continue;
    for (const mesh::Id node : nodes) {
      mesh::Id& of = group[layered.cell(node)];
      if (of != mesh::none) joined[std::max(first(of), first(k))] = std::min(first(of), first(k));
      of = of == mesh::none ? k : of;
    }
  }
  for (mesh::Id& of : group)
    of = of == mesh::none ? of : first(of);
}

void tieLeft(const LayeredSort& layered, const Gaps* gaps, Turn* turn, Ties& ties) {
  Left left;
  findComponents(layered, gaps, left);
  ties.of.assign(layered.nodes(), mesh::none);
  std::vector<mesh::Id> nodes;
  for (std::uint32_t k = 0; k < left.components.size(); ++k) {
    left.nodes(k, nodes);
    ties.left.push_back(nodes.front());
    Turn latest = 0;
    for (const mesh::Id node : nodes)
      latest = std::max(latest, turn[node]);
    for (const mesh::Id node : nodes) {
      turn[node] = latest;
      layered.forEachAfter(node, [&](mesh::Id next) { turn[next] = std::max(turn[next], latest); });
      if (gaps == nullptr) continue;
      for (const mesh::Id next : gaps->edges.after(layered.cell(node)))
        turn[next] = std::max(turn[next], latest);
    }
    if (nodes.size() == 1) continue;
    for (const mesh::Id node : nodes)
      ties.of[node] = static_cast<mesh::Id>(ties.nodes.size());
    ties.nodes.push_back(nodes);
  }
}

bool cutTies(const mesh::Mesh& mesh, const FaceSigns& signs, const LayeredSort& layered, const Gaps* gaps,
             ProblemCells& problems, const Viewpoint& viewpoint, Order& order, Ties& ties) {
  std::vector<Order> cuts = cutEach(
      ties.nodes.size(), [&](std::size_t i, auto& nodes) { nodes = ties.nodes[i]; }, mesh, signs, layered, gaps,
      problems, viewpoint);
  bool right = true;
  for (const mesh::Id node : ties.left) {
    const mesh::Id tie = ties.of[node];
    if (tie == mesh::none) {
      order.cells.push_back(node);
      continue;
    }
    nameCycle(ties.nodes[tie], layered, order);
    Order& cut = cuts[tie];
    right = cut.exact && right;
    std::size_t at = 0;
    for (std::uint32_t i = 0; i < cut.cells.size(); ++i) {
      order.cells.push_back(static_cast<mesh::Id>(layered.nodes() + ties.pieces.size()));
      ties.pieces.push_back({cut.cells[i], {}});
      ties.tie_of_piece.push_back(tie);
      if (at == cut.cuts.size() || cut.cuts[at].entry != i) continue;
      const auto keep = cut.cuts[at++].keep;
      ties.pieces.back().keep.assign(keep.begin(), keep.end());
    }
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
