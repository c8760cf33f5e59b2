// The exterior triangles of a mesh in a tree of boxes, and what lies near one of them.
#pragma once

#include <array>
#include <cmath>
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
// A plane x X + y Y + z Z = w in the same coordinates, of unit normal; all zero for triangles too thin to have one.
struct TreePlane {
  float x, y, z, w;
};
struct TreeLevel {
  std::size_t first;  // node
  std::size_t count;  // boxes
};
// Built once per geometry. Triangles are renumbered along a space-filling curve, those of a coarse part of it by the
// side that they point to; `triangles()` is in that order and so are all indices. The tree is implicit and eight wide.
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

  TreePlane plane(std::size_t triangle) const;
  // Eight boxes of a level.
  const TreeNode& node(std::size_t level, std::size_t node) const { return nodes_[levels_[level].first + node]; }
  // In local units, where the mesh spans [-1, 1]: above the rounding of six float products and of the plane itself. A
  // box that reaches as far below a plane certainly does not reach beyond it.
  static constexpr float margin = 0x1p-17F;

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

  std::uint64_t code(std::size_t triangle) const;
  void measure();
  void build();
  // How far the box reaches over the plane.
  float top(std::size_t level, std::size_t box, const TreePlane& plane) const {
    const Node& n = nodes_[levels_[level].first + box / wide];
    const std::size_t j = box % wide;
    return plane.x * n.cx[j] + plane.y * n.cy[j] + plane.z * n.cz[j] + std::abs(plane.x) * n.hx[j] +
           std::abs(plane.y) * n.hy[j] + std::abs(plane.z) * n.hz[j] - plane.w;
  }
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
