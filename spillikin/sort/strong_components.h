// Strongly connected components of a part of a graph.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace spillikin::sort {

// Groups of nodes, one after the other in one array.
class Components {
 public:
  std::size_t size() const { return begin_.size() - 1; }
  std::span<const std::uint32_t> operator[](std::size_t i) const {  // found last to first
    const std::size_t k = size() - 1 - i;
    return {node_.data() + begin_[k], node_.data() + begin_[k + 1]};
  }
  void add(std::uint32_t node) { node_.push_back(node); }
  void close() {
    if (node_.size() - begin_.back() > 1) std::sort(node_.begin() + begin_.back(), node_.end());
    begin_.push_back(static_cast<std::uint32_t>(node_.size()));
  }

 private:
  std::vector<std::uint32_t> node_, begin_{0};
};

// Tarjan 1972 with one number a node (Pearce 2016), without recursion. Nodes are 0 .. count - 1; edges(node, f) calls
// f(successor) for each of its successors, once for every node. Returns the components with every edge leading from an
// earlier component to a later one or staying inside; the nodes of a component ascend. Linear.
template <class Edges>
Components strongComponents(std::uint32_t count, const Edges& edges) {
  constexpr std::uint32_t unseen = 0, listed = 0xFFFFFFFFU;
  struct Frame {
    std::uint32_t node;
    std::uint32_t number;  // of nodes in the order in which they are come to, from 1
    std::uint32_t begin;   // of this node's successors to be looked at, on top of the stack of successors
  };
  std::vector<std::uint32_t> least(count, unseen);  // number that is known to be reached from a node
  std::vector<std::uint32_t> waiting;               // nodes done with, whose component is not complete
  std::vector<std::uint32_t> successors;
  std::vector<Frame> frames;
  Components components;
  std::uint32_t number = 0;
  const auto open = [&](std::uint32_t node) {
    std::uint32_t low = ++number;
    const auto begin = static_cast<std::uint32_t>(successors.size());
    frames.push_back({node, number, begin});
    least[node] = low;
    edges(node, [&](std::uint32_t next) {
      if (least[next] == unseen) {
        successors.push_back(next);
      } else {
        low = std::min(low, least[next]);
      }
    });
    least[node] = low;
  };
  const auto close = [&](const Frame& frame) {
    if (least[frame.node] != frame.number) {
      waiting.push_back(frame.node);
      return;
    }
    components.add(frame.node);
    least[frame.node] = listed;
    for (; !waiting.empty() && least[waiting.back()] >= frame.number; waiting.pop_back()) {
      components.add(waiting.back());
      least[waiting.back()] = listed;
    }
    components.close();
  };
  for (std::uint32_t root = 0; root < count; ++root) {
    if (least[root] == unseen) open(root);
    while (!frames.empty()) {
      const Frame frame = frames.back();
      if (frame.begin < successors.size()) {
        const std::uint32_t next = successors.back();
        if (least[next] == unseen) {
          open(next);
          continue;
        }
        successors.pop_back();
        least[frame.node] = std::min(least[frame.node], least[next]);
        continue;
      }
      frames.pop_back();
      close(frame);
    }
  }
  return components;
}

}  // namespace spillikin::sort
