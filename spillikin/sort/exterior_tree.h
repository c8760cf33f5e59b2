// The exterior triangles of a mesh in a tree of boxes, and what lies in the shadow of one of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/sort/convexity.h"
#include "spillikin/sort/triangle_order.h"

namespace spillikin::sort {

// Eight boxes by centre and half extent, in local coordinates that make the mesh fit into [-1, 1].
struct TreeNode {
  static constexpr std::size_t wide = 8;
  std::array<float, wide> cx, cy, cz, hx, hy, hz;
};
struct TreeLevel {
  std::size_t first;  // node
  std::size_t count;  // boxes
};
// A half-space x X + y Y + z Z + w >= 0 in local coordinates, the rounding allowed for in w.
struct TreePlane {
  float x, y, z, w;
};
// The search, compiled for every SIMD target and chosen at run time: appends the boxes of level 0 that reach into all
// four half-spaces, as far as `wanted` has their bit.
void searchTree(const TreeNode* nodes, const std::uint8_t* wanted, const TreeLevel* levels, std::size_t level_count,
                const TreePlane planes[4], std::vector<std::uint32_t>& out);

// Built once per geometry. Triangles are renumbered along a space-filling curve; `triangles()` is in that order and so
// are all indices. The tree is implicit and eight wide.
class ExteriorTree {
 public:
  ExteriorTree(const mesh::Mesh& mesh, std::vector<ExteriorTriangle> exterior);

  const std::vector<ExteriorTriangle>& triangles() const { return triangles_; }
  Triangle corners(std::size_t triangle) const {
    const auto& c = triangles_[triangle].corner;
    return {mesh_.points[c[0]], mesh_.points[c[1]], mesh_.points[c[2]]};
  }

  // What the searches of a view may find: triangles whose sign is positive. Linear in the triangles.
  template <class Sign>
  void lookFor(const Sign& sign) {
    const auto mark = [&](const Level& level, const auto& wanted) {
      for (std::size_t i = 0; i < level.count; i += wide) {
        unsigned bits = 0;
        for (std::size_t j = i; j < std::min(level.count, i + wide); ++j)
          bits |= (wanted(j) ? 1U : 0U) << (j - i);
        wanted_[level.first + i / wide] = static_cast<std::uint8_t>(bits);
      }
    };
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      if (l == 0) {
        mark(levels_[0], [&](std::size_t t) { return sign(static_cast<std::uint32_t>(t)) > 0; });
      } else {
        mark(levels_[l], [&](std::size_t node) { return wanted_[levels_[l - 1].first + node] != 0; });
      }
    }
  }

  // Appends to `out` the triangles looked for that may lie in the shadow that triangle t throws away from the
  // viewpoint; leaves out only such that certainly do not. `sign` is the nonzero orientViewpoint of t.
  void inShadow(std::size_t t, int sign, const Viewpoint& viewpoint, std::vector<std::uint32_t>& out) const;

  std::size_t bytes() const;

 private:
  using Node = TreeNode;
  using Level = TreeLevel;
  static constexpr std::size_t wide = Node::wide;

  void build();

  const mesh::Mesh& mesh_;
  std::vector<ExteriorTriangle> triangles_;
  Vec3 origin_{0.0};
  double scale_ = 1.0;
  std::vector<Node> nodes_;
  std::vector<std::uint8_t> wanted_;  // per node: which of its boxes hold what is looked for
  std::vector<Level> levels_;         // from the triangles' own boxes up to the root
};

}  // namespace spillikin::sort
