// Which nodes of a tree of exterior triangles can face one another, from any viewpoint.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "spillikin/sort/exterior_tree.h"

namespace spillikin::sort {

// For every node of eight triangles a bit for each node of the tree: whether any triangle of the one may face any of
// the other. In a thin wall the two sides never do, however near they are to one another. Kept as a byte for each node
// above the first level: its children. Decided once; memory and time grow with the square of the nodes, so that it is
// for exteriors of at most `most` triangles, and empty for larger ones.
class FacingNodes {
 public:
  static constexpr std::size_t most = 16384;
  using MayFace = std::function<bool(std::uint32_t, std::uint32_t)>;

  // mayFace(a, b) is symmetric; false where triangles a and b certainly never face each other. A box that does not
  // reach beyond any of a node's planes is not asked for.
  FacingNodes(const ExteriorTree& tree, const MayFace& mayFace);

  // The bytes of a node of triangles, one for each node of levels 1 and above, by level; null where there are none.
  const std::uint8_t* of(std::size_t node) const { return bytes_.empty() ? nullptr : bytes_.data() + node * row_; }
  std::size_t bytes() const { return bytes_.capacity(); }

 private:
  std::size_t row_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace spillikin::sort
