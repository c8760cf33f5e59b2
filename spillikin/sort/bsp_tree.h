// A binary space partition of the exterior triangles, built once per geometry.
#pragma once

#include <cstdint>
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

  // Calls f(triangle) for every fragment, far before near: of two fragments on one ray the farther comes first. Within
  // one plane triangles turned towards the viewpoint come first. `sign(triangle)` is the viewpoint's side of it.
  template <class Sign, class F>
  void backToFront(const Viewpoint& viewpoint, const Sign& sign, const F& f) const {
    if (nodes_.empty()) return;
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const std::uint32_t entry = stack.back();
      stack.pop_back();
      const Node& node = nodes_[entry & ~in_plane];
      if ((entry & in_plane) != 0) {
        for (const bool towards : {true, false}) {
          for (std::uint32_t i = node.first; i < node.last; ++i) {
            if ((sign(fragments_[i]) > 0) == towards) f(fragments_[i]);
          }
        }
        continue;
      }
      const int side = node.axis < 3 ? axisSide(node, viewpoint) : sign(node.triangle);
      const std::uint32_t near = side >= 0 ? node.above : node.below, far = side >= 0 ? node.below : node.above;
      if (near != nothing) stack.push_back(near);
      stack.push_back(entry | in_plane);
      if (far != nothing) stack.push_back(far);
    }
  }

  std::size_t nodes() const { return nodes_.size(); }
  std::size_t fragments() const { return fragments_.size(); }
  std::uint32_t fragmentsOf(std::uint32_t triangle) const { return count_[triangle]; }
  std::size_t bytes() const;

  static constexpr double thin = 1e-12;

 private:
  static constexpr std::uint32_t nothing = 0x7FFFFFFFU, in_plane = 0x80000000U;
  struct Node {
    double value = 0.0;          // of the coordinate, for a plane across an axis
    std::uint32_t triangle = 0;  // whose plane it is
    std::uint32_t axis = 3;
    std::uint32_t first = 0, last = 0;  // fragments in the plane
    std::uint32_t above = nothing, below = nothing;
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
  Node choose(const std::vector<Fragment>& set) const;
  void split(const Node& node, Fragment&& fragment, std::vector<Fragment>& above, std::vector<Fragment>& below);
  double height(const Node& node, const Vec3& p) const;

  const ExteriorTree& exterior_;
  double tolerance_ = 0.0;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> fragments_;
  std::vector<std::uint32_t> count_;  // fragments of each triangle
};

}  // namespace spillikin::sort
