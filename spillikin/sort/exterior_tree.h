// The exterior triangles of a mesh in a tree of boxes, and what lies in the shadow of one of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/sort/convexity.h"
#include "spillikin/sort/triangle_order.h"

namespace spillikin::sort {

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

  // Appends to `out` the triangles that may lie in the shadow that triangle t throws away from the viewpoint; leaves
  // out only such that certainly do not. `sign` is the nonzero orientViewpoint of t.
  void inShadow(std::size_t t, int sign, const Viewpoint& viewpoint, std::vector<std::uint32_t>& out) const;
  // The same for a plane-bounded region: those that may meet all of the half-spaces.
  struct Plane {
    Vec3 normal{0.0};
    Vec3 through{0.0};
  };
  void inRegion(const Plane* planes, std::size_t count, std::vector<std::uint32_t>& out) const;

  std::size_t bytes() const;

 private:
  static constexpr std::size_t wide = 8;
  // Eight boxes by centre and half extent, in local coordinates that make the mesh fit into [-1, 1].
  struct Node {
    std::array<float, wide> cx, cy, cz, hx, hy, hz;
  };
  struct Level {
    std::size_t first;  // node
    std::size_t count;  // boxes
  };

  void build();

  const mesh::Mesh& mesh_;
  std::vector<ExteriorTriangle> triangles_;
  Vec3 origin_{0.0};
  double scale_ = 1.0;
  std::vector<Node> nodes_;
  std::vector<Level> levels_;  // from the triangles' own boxes up to the root
};

}  // namespace spillikin::sort
