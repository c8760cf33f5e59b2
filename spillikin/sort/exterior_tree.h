// The exterior triangles of a mesh in a tree of boxes, and what lies before one of them.
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
#include "spillikin/sort/turns.h"

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
// The turns in each box of a node: the earliest, and the latest guess.
struct TreeTurns {
  std::array<Turn, TreeNode::wide> earliest, latest;
};
// The search, compiled for every SIMD target and chosen at run time: appends the boxes of level 0 that reach into all
// four half-spaces and hold a turn of at most `last` and a guess of at least `first`.
void searchTree(const TreeNode* nodes, const TreeTurns* turns, const TreeLevel* levels, std::size_t level_count,
                const TreePlane planes[4], Turn first, Turn last, std::vector<std::uint32_t>& out);

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

  // The box of all triangles; meant for meshes, which have some.
  const Vec3& lower() const { return lower_; }
  const Vec3& upper() const { return upper_; }

  static constexpr Turn never = std::numeric_limits<Turn>::max();

  // What the searches may find: triangles by their turn(t), `never` for those that none may, and guess(t), which is no
  // later. Linear, on all cores.
  template <class TurnOf, class GuessOf>
  void setTurns(const TurnOf& turn, const GuessOf& guess) {
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      const TreeTurns* below = l == 0 ? nullptr : turns_.data() + levels_[l - 1].first;
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (levels_[l].count + wide - 1) / wide, 512),
                        [&](const tbb::blocked_range<std::size_t>& range) {
                          for (std::size_t node = range.begin(); node < range.end(); ++node) {
                            TreeTurns& turns = turns_[levels_[l].first + node];
                            turns.earliest.fill(never);
                            turns.latest.fill(0);
                            const std::size_t boxes = std::min(wide, levels_[l].count - wide * node);
                            for (std::size_t j = 0; j < boxes; ++j) {
                              const std::size_t box = wide * node + j;
                              if (below != nullptr) {
                                const auto &earliest = below[box].earliest, &latest = below[box].latest;
                                turns.earliest[j] = *std::min_element(earliest.begin(), earliest.end());
                                turns.latest[j] = *std::max_element(latest.begin(), latest.end());
                                continue;
                              }
                              turns.earliest[j] = turn(static_cast<std::uint32_t>(box));
                              if (turns.earliest[j] != never) turns.latest[j] = guess(static_cast<std::uint32_t>(box));
                            }
                          }
                        });
    }
  }

  // Appends to `out` the triangles that setTurns gave a turn of at most `last` and a guess of at least `first` and that
  // may lie between the viewpoint and triangle t; leaves out only such that certainly do not. `sign` is the nonzero
  // orientViewpoint of t.
  void inFront(std::size_t t, int sign, const Viewpoint& viewpoint, Turn first, Turn last,
               std::vector<std::uint32_t>& out) const;

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

  void build();
  void crossed(std::size_t t, std::vector<std::pair<std::uint32_t, std::uint32_t>>& out) const;

  const mesh::Mesh& mesh_;
  std::vector<ExteriorTriangle> triangles_;
  Vec3 lower_{std::numeric_limits<double>::infinity()}, upper_{-std::numeric_limits<double>::infinity()};
  Vec3 origin_{0.0};
  double scale_ = 1.0;
  std::vector<Node> nodes_;
  std::vector<TreeTurns> turns_;  // per node
  std::vector<Level> levels_;     // from the triangles' own boxes up to the root
};

}  // namespace spillikin::sort
