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

// Tarjan 1972, without recursion. Nodes are 0 .. count - 1; edges(node, f) calls f(successor) for each of its
// successors and must do so in the same order each time. Returns the components with every edge leading from an earlier
// component to a later one or staying inside; the nodes of a component ascend. Linear.
template <class Edges>
Components strongComponents(std::uint32_t count, const Edges& edges) {
  constexpr std::uint32_t unseen = 0xFFFFFFFFU;
  struct Frame {
    std::uint32_t node;
    std::uint32_t next;   // index into `successors` of the next to look at
    std::uint32_t begin;  // of this node's successors, which lie on top of the stack of successors
  };
  std::vector<std::uint32_t> index(count, unseen), low(count), stack, successors;
  std::vector<std::uint8_t> on_stack(count, 0);
  std::vector<Frame> frames;
  Components components;
  std::uint32_t clock = 0;
  const auto open = [&](std::uint32_t node) {
    index[node] = low[node] = clock++;
    stack.push_back(node);
    on_stack[node] = 1;
    const auto begin = static_cast<std::uint32_t>(successors.size());
    edges(node, [&](std::uint32_t next) { successors.push_back(next); });
    frames.push_back({node, begin, begin});
  };
  for (std::uint32_t root = 0; root < count; ++root) {
    if (index[root] != unseen) continue;
    open(root);
    while (!frames.empty()) {
      Frame& frame = frames.back();
      const std::uint32_t node = frame.node;
      if (frame.next < successors.size()) {
        const std::uint32_t next = successors[frame.next++];
        if (index[next] == unseen) {
          open(next);
        } else if (on_stack[next] != 0) {
          low[node] = std::min(low[node], index[next]);
        }
        continue;
      }
      successors.resize(frame.begin);
      frames.pop_back();
      if (!frames.empty()) low[frames.back().node] = std::min(low[frames.back().node], low[node]);
      if (low[node] != index[node]) continue;
      std::uint32_t member = unseen;
      while (member != node) {
        member = stack.back();
        stack.pop_back();
        on_stack[member] = 0;
        components.add(member);
      }
      components.close();
    }
  }
  return components;
}

}  // namespace spillikin::sort
