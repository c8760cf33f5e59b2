#include "spillikin/sort/facing_nodes.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace spillikin::sort {
namespace {

constexpr std::size_t wide = TreeNode::wide;

// Of the eight triangles of a node; of those that there are not, nothing reaches beyond the plane.
struct NodePlanes {
  std::array<float, wide> x{}, y{}, z{}, w{};

  NodePlanes(const ExteriorTree& tree, std::size_t node) {
    w.fill(std::numeric_limits<float>::infinity());
    for (std::size_t t = wide * node; t < std::min(tree.triangles().size(), wide * (node + 1)); ++t) {
      const TreePlane plane = tree.plane(t);
      x[t % wide] = plane.x;
      y[t % wide] = plane.y;
      z[t % wide] = plane.z;
      w[t % wide] = plane.w;
    }
  }
};

// Fills the bytes of one node of triangles.
class RowOfNode {
 public:
  RowOfNode(const ExteriorTree& tree, const std::vector<NodePlanes>& planes, const FacingNodes::MayFace& mayFace,
            std::size_t node, std::uint8_t* row)
      : tree_(tree), planes_(planes), mayFace_(mayFace), node_(node), row_(row) {}

  // Whether any triangle below a node of a level may face any of this one.
  bool look(std::size_t level, std::size_t node) {
    if (level == 0) return faces(node);
    const std::size_t end = std::min(tree_.levels()[level].count, wide * (node + 1));
    unsigned bits = 0;
    for (std::size_t box = wide * node; box < end; ++box)
      bits |= (reaching(node_, level, box) != 0 && look(level - 1, box) ? 1U : 0U) << (box % wide);
    row_[tree_.levels()[level].first + node - tree_.levels()[1].first] = static_cast<std::uint8_t>(bits);
    return bits != 0;
  }

 private:
  // Bit j: a box of a level may reach beyond the plane of triangle j of a node.
  unsigned reaching(std::size_t node, std::size_t level, std::size_t box) const {
    const TreeNode& boxes = tree_.node(level, box / wide);
    const std::size_t at = box % wide;
    const NodePlanes& p = planes_[node];
    std::array<float, wide> top;
    for (std::size_t j = 0; j < wide; ++j) {
      top[j] = p.x[j] * boxes.cx[at] + p.y[j] * boxes.cy[at] + p.z[j] * boxes.cz[at] + std::abs(p.x[j]) * boxes.hx[at] +
               std::abs(p.y[j]) * boxes.hy[at] + std::abs(p.z[j]) * boxes.hz[at] - p.w[j];
    }
    unsigned bits = 0;
    for (std::size_t j = 0; j < wide; ++j)
      bits |= (top[j] > -ExteriorTree::margin ? 1U : 0U) << j;
    return bits;
  }
  bool faces(std::size_t other) const {
    const unsigned mine = reaching(node_, 1, other), theirs = mine == 0 ? 0 : reaching(other, 1, node_);
    for (unsigned a = mine; a != 0; a &= a - 1) {
      for (unsigned b = theirs; b != 0; b &= b - 1) {
        if (mayFace_(static_cast<std::uint32_t>(wide * node_) + static_cast<std::uint32_t>(std::countr_zero(a)),
                     static_cast<std::uint32_t>(wide * other) + static_cast<std::uint32_t>(std::countr_zero(b)))) {
          return true;
        }
      }
    }
    return false;
  }

  const ExteriorTree& tree_;
  const std::vector<NodePlanes>& planes_;
  const FacingNodes::MayFace& mayFace_;
  std::size_t node_;
  std::uint8_t* row_;
};

}  // namespace

FacingNodes::FacingNodes(const ExteriorTree& tree, const MayFace& mayFace) {
  const auto& levels = tree.levels();
  const std::size_t count = tree.triangles().size();
  if (count > most || levels.size() < 2) return;
  const std::size_t nodes = (count + wide - 1) / wide;
  row_ = levels.back().first + 1 - levels[1].first;
  bytes_.resize(nodes * row_);
  std::vector<NodePlanes> planes;
  planes.reserve(nodes);
  for (std::size_t n = 0; n < nodes; ++n)
    planes.emplace_back(tree, n);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes, 8), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      RowOfNode row(tree, planes, mayFace, n, bytes_.data() + n * row_);
      row.look(levels.size() - 1, 0);
    }
  });
}

}  // namespace spillikin::sort
