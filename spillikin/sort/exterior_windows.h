// Where in a view the exterior triangles lie and how deep, and the search for those in front of one of them.
#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/sort/exterior_tree.h"
#include "spillikin/sort/facing_nodes.h"
#include "spillikin/sort/turns.h"

namespace spillikin::sort {

// Windows of eight triangles or of eight nodes, and the turns in each: the earliest, and the latest guess. A window
// bounds directions from the eye: 16 bits for each component of a unit vector; in a parallel view, for each of a
// place in the plane across the line of sight.
struct WindowNode {
  static constexpr std::size_t wide = 8;
  using Lanes = std::array<std::uint16_t, wide>;
  std::array<Lanes, 3> lower, upper;
  Lanes earliest, latest;
};

// How a view turns a point p into 16-bit numbers: u = (p - origin) / |p - origin|, its distance the length; or, in a
// parallel view, u = p - origin less its height along `sight`, its distance minus the height. Then (u - low) * scale,
// give or take `room`, and (farthest - distance) * level_scale, give or take `level_room`.
struct WindowFrame {
  bool parallel = false;
  Vec3 origin{0.0}, sight{0.0}, low{0.0};
  double scale = 0.0, room = 0.0;
  double farthest = 0.0, level_scale = 0.0, level_room = 0.0;
};

// Kernels, compiled for every SIMD target and chosen at run time.
//
// The numbers of `count` points, a multiple of eight: four each, u and the level of depth, as they may be at least and
// at most. A point in the eye has every direction.
void lookAtPoints(const double* x, const double* y, const double* z, std::size_t count, const WindowFrame& frame,
                  std::uint16_t* lower, std::uint16_t* upper);
// The windows of `count` nodes of triangles and the levels of depth of the triangles: the least of the farthest point,
// the greatest of the nearest. `corner`: of each triangle its three points.
void lookAtTriangles(const std::array<std::uint32_t, 3>* corner, const std::uint16_t* lower, const std::uint16_t* upper,
                     const WindowFrame& frame, std::size_t count, WindowNode* nodes, std::uint16_t* least,
                     std::uint16_t* greatest);
// What lane j of a node holds: all of its child that has a turn.
void uniteWindows(const WindowNode* children, std::size_t count, WindowNode& node);
// A triangle, and what is asked about it: others with a guess of at least `first` and a turn of at most `last`.
struct WindowQuery {
  std::uint32_t triangle;
  Turn first, last;
};
struct WindowPair {
  std::uint32_t found, by;  // triangles: what a query found, and whose query
};
// Appends the triangles whose windows meet those of the queries, which are of one node. The tree is gone through once,
// for all of them together. `facing`, which may be null: that node's bytes (facing_nodes.h).
void searchWindows(const WindowNode* nodes, const TreeLevel* levels, std::size_t level_count,
                   const std::uint8_t* facing, std::span<const WindowQuery> queries, std::vector<WindowPair>& out);

// For the triangles of an ExteriorTree, in its order and with its levels; both must outlive it. Two triangles that a
// ray crosses have windows that meet. A triangle's window is that of its corners, widened for what a triangle on the
// sphere rises above its chords: unit vectors no farther than L apart have no mean shorter than sqrt(1 - L^2 / 3).
class ExteriorWindows {
 public:
  ExteriorWindows(const mesh::Mesh& mesh, const ExteriorTree& tree, const FacingNodes::MayFace& mayFace);

  // For this viewpoint from now on; does nothing where it was so already. Linear, on all cores: some 10 ns a triangle.
  void look(const Viewpoint& viewpoint);

  // Levels of depth: greatest(a) >= least(b) when a point of a lies on a ray no farther than a point of b. Small ones
  // are far.
  static constexpr std::uint16_t levels = 65520;
  std::uint16_t least(std::size_t triangle) const { return least_[triangle]; }
  std::uint16_t greatest(std::size_t triangle) const { return greatest_[triangle]; }

  static constexpr Turn never = std::numeric_limits<Turn>::max();

  // What the searches of this view may find: triangles by their turn(t), `never` for those that none may, and guess(t),
  // which is no later. Linear, on all cores.
  template <class TurnOf, class GuessOf>
  void setTurns(const TurnOf& turn, const GuessOf& guess) {
    if (tree_levels_.empty()) return;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodesAt(0), grain),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t n = range.begin(); n < range.end(); ++n) {
                          const std::size_t boxes = std::min(wide, tree_levels_[0].count - wide * n);
                          for (std::size_t j = 0; j < boxes; ++j) {
                            const auto t = static_cast<std::uint32_t>(wide * n + j);
                            nodes_[n].earliest[j] = turn(t);
                            nodes_[n].latest[j] = nodes_[n].earliest[j] == never ? Turn{0} : guess(t);
                          }
                        }
                      });
    unite();
  }

  // Appends to `out` the triangles that setTurns gave a turn of at most `last` and a guess of at least `first` and that
  // a ray through the triangle of a query may cross; leaves out only such that certainly none does, or that certainly
  // do not face it. Queries of
  // neighbours in sequence, at most WindowNode::wide of which share a node, are answered together.
  void meeting(std::span<const WindowQuery> queries, std::vector<WindowPair>& out) const;

  std::size_t bytes() const;

 private:
  static constexpr std::size_t wide = WindowNode::wide, grain = 512;  // nodes worth a task

  std::size_t nodesAt(std::size_t level) const { return (tree_levels_[level].count + wide - 1) / wide; }
  bool aim(const Viewpoint& viewpoint);
  void seeNothing();
  void unite();

  Vec3 lower_{0.0}, upper_{0.0};
  std::vector<TreeLevel> tree_levels_;
  std::vector<std::array<std::uint32_t, 3>> corner_;  // per triangle, among the points
  std::vector<double> x_, y_, z_;                     // of the points
  std::vector<std::uint16_t> point_lower_, point_upper_;
  std::vector<WindowNode> nodes_;
  FacingNodes facing_;
  std::vector<std::uint16_t> least_, greatest_;
  WindowFrame frame_;
  Viewpoint viewpoint_{std::numeric_limits<double>::quiet_NaN()};
};

}  // namespace spillikin::sort
