// Strongly connected components of a part of a graph.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace spillikin::sort {

// Tarjan 1972, without recursion. Nodes are 0 .. count - 1; edges(node, f) calls f(successor) for each of its
// successors and must do so in the same order each time. Returns the components with every edge leading from an earlier
// component to a later one or staying inside; the nodes of a component ascend. Linear.
template <class Edges>
std::vector<std::vector<std::uint32_t>> strongComponents(std::uint32_t count, const Edges& edges) {
  constexpr std::uint32_t unseen = 0xFFFFFFFFU;
  struct Frame {
    std::uint32_t node;
    std::uint32_t next;   // index into `successors` of the next to look at
    std::uint32_t begin;  // of this node's successors, which lie on top of the stack of successors
  };
  std::vector<std::uint32_t> index(count, unseen), low(count), stack, successors;
  std::vector<std::uint8_t> on_stack(count, 0);
  std::vector<Frame> frames;
  std::vector<std::vector<std::uint32_t>> components;
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
      auto& component = components.emplace_back();
      std::uint32_t member = unseen;
      while (member != node) {
        member = stack.back();
        stack.pop_back();
        on_stack[member] = 0;
        component.push_back(member);
      }
      std::sort(component.begin(), component.end());
    }
  }
  std::reverse(components.begin(), components.end());
  return components;
}

}  // namespace spillikin::sort
