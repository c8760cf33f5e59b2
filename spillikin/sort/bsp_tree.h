// A binary space partition of the exterior triangles, built once per geometry.
#pragma once

#include <oneapi/tbb/parallel_invoke.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "spillikin/sort/exterior_tree.h"

namespace spillikin::sort {

// Comba et al. 1999; Max, Williams, Silva 2000, section III. Every node holds a plane, the fragments that lie in it and
// the two sides. Large sets are split by planes across an axis, so that a convex part of the surface does not become a
// list; small ones by the planes of their own triangles. A triangle that was never cut is classified by exact
// predicates; a cut one by its corners in double, where parts thinner than `thin` of the exterior's extent are dropped.
class BspTree {
 public:
  explicit BspTree(const ExteriorTree& exterior);

  // The order of a view, far before near: of two fragments on one ray the farther has the earlier place, or they lie in
  // one plane and have the same. `sign(triangle)` is the viewpoint's side of it. Linear in the nodes, on all cores.
  template <class Sign>
  void place(const Viewpoint& viewpoint, const Sign& sign) {
    if (!nodes_.empty()) placeFrom(0, 0, viewpoint, sign);
  }
  // The first and the last of the places of a triangle's fragments, as of the last call of place(); below nodes(). Of a
  // triangle too thin to have any, the first and the last place of all.
  std::uint32_t firstPlace(std::uint32_t triangle) const {
    std::uint32_t place = nothing;
    for (std::uint32_t i = offset_[triangle]; i < offset_[triangle + 1]; ++i)
      place = std::min(place, place_[node_of_[i]]);
    return place == nothing ? 0 : place;
  }
  std::uint32_t lastPlace(std::uint32_t triangle) const {
    if (offset_[triangle] == offset_[triangle + 1]) return static_cast<std::uint32_t>(nodes_.size() - 1);
    std::uint32_t place = 0;
    for (std::uint32_t i = offset_[triangle]; i < offset_[triangle + 1]; ++i)
      place = std::max(place, place_[node_of_[i]]);
    return place;
  }

  std::size_t triangles() const { return offset_.empty() ? 0 : offset_.size() - 1; }
  std::size_t nodes() const { return nodes_.size(); }
  std::size_t fragments() const { return node_of_.size(); }
  std::size_t bytes() const;

  static constexpr double thin = 1e-12;

 private:
  static constexpr std::uint32_t nothing = 0xFFFFFFFFU;
  static constexpr std::uint32_t large_part = 4096;  // nodes, from which on both sides are worth tasks of their own
  struct Node {
    double value = 0.0;          // of the coordinate, for a plane across an axis
    std::uint32_t triangle = 0;  // whose plane it is
    std::uint32_t axis = 3;
    std::uint32_t above = nothing, below = nothing;
    std::uint32_t size = 1;  // nodes from here on
  };
  struct Fragment {
    std::uint32_t triangle;
    std::vector<Vec3> polygon;  // empty: the whole triangle
  };
  struct Task {
    std::vector<Fragment> set;
    std::uint32_t parent;
    bool above;
  };

  static int axisSide(const Node& node, const Viewpoint& viewpoint) {
    const int k = static_cast<int>(node.axis);
    const double d = viewpoint.w == 0.0 ? viewpoint[k] : viewpoint[k] - node.value;
    return d > 0.0 ? 1 : d < 0.0 ? -1 : 0;
  }
  // Gives the places from `first` on to a node and all under it.
  template <class Sign>
  void placeFrom(std::uint32_t root, std::uint32_t first, const Viewpoint& viewpoint, const Sign& sign) {
    struct Entry {
      std::uint32_t node, first;
    };
    thread_local std::vector<Entry> stacks;
    std::vector<Entry> stack;
    stack.swap(stacks);  // a task that waits may take up another
    stack.assign(1, {root, first});
    while (!stack.empty()) {
      const Entry entry = stack.back();
      stack.pop_back();
      const Node& node = nodes_[entry.node];
      const int side = node.axis < 3 ? axisSide(node, viewpoint) : sign(node.triangle);
      const std::uint32_t near = side >= 0 ? node.above : node.below, far = side >= 0 ? node.below : node.above;
      const std::uint32_t own = entry.first + (far == nothing ? 0 : nodes_[far].size);
      place_[entry.node] = own;
      if (near != nothing && far != nothing && node.size >= large_part) {
        tbb::parallel_invoke([&] { placeFrom(far, entry.first, viewpoint, sign); },
                             [&] { placeFrom(near, own + 1, viewpoint, sign); });
        continue;
      }
      if (near != nothing) stack.push_back({near, own + 1});
      if (far != nothing) stack.push_back({far, entry.first});
    }
    stack.swap(stacks);
  }

  Node choose(const std::vector<Fragment>& set) const;
  void split(const Node& node, std::uint32_t index, Fragment&& fragment, std::vector<Fragment>& above,
             std::vector<Fragment>& below);
  double height(const Node& node, const Vec3& p) const;

  const ExteriorTree& exterior_;
  double tolerance_ = 0.0;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> place_;                             // per node, in the last view
  std::vector<std::uint32_t> offset_;                            // per triangle + 1: where its fragments begin
  std::vector<std::uint32_t> node_of_;                           // the node in whose plane a fragment lies
  std::vector<std::pair<std::uint32_t, std::uint32_t>> placed_;  // triangle, node; while building
};

}  // namespace spillikin::sort
