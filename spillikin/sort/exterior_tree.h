// The exterior triangles of a mesh in a tree of boxes, and what lies near one of them.
#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
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

  // The box of all triangles, lower above upper where there is none.
  const Vec3& lower() const { return lower_; }
  const Vec3& upper() const { return upper_; }

  // Eight to a node, from the triangles themselves up to the root.
  const std::vector<TreeLevel>& levels() const { return levels_; }

  // Only the triangles of which `wanted` is nonzero from now on, in the same sequence.
  void keep(const std::vector<std::uint8_t>& wanted);

  // Whether meets(other) holds for any triangle, of those that may reach to the plane of triangle t or to the side that
  // its normal points to. False is certain; true where too many are there to ask them all. Cost: logarithmic.
  bool anyBeyond(std::size_t t, const std::function<bool(std::uint32_t)>& meets) const;

  // Pairs of triangles that cross each other properly, an edge of one through the inside of the other (exact): cells
  // overlap there. At most `most` of them, the first by index. Cost: as b searches, on all cores.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> crossings(std::size_t most) const;

  std::size_t bytes() const;

 private:
  using Node = TreeNode;
  using Level = TreeLevel;
  static constexpr std::size_t wide = Node::wide;

  void measure();
  void build();
  void crossed(std::size_t t, std::vector<std::pair<std::uint32_t, std::uint32_t>>& out) const;

  const mesh::Mesh& mesh_;
  std::vector<ExteriorTriangle> triangles_;
  Vec3 lower_{std::numeric_limits<double>::infinity()}, upper_{-std::numeric_limits<double>::infinity()};
  Vec3 origin_{0.0};
  double scale_ = 1.0;
  std::vector<Node> nodes_;
  std::vector<Level> levels_;  // from the triangles' own boxes up to the root
};

}  // namespace spillikin::sort
