#include "spillikin/sort/bsp_xmpvo.h"

#include <algorithm>

namespace spillikin::sort {
namespace {

constexpr std::size_t slabs = 256, places = 16;  // of depth, and of the tree's list within each
static_assert(slabs * places < ExteriorWindows::never / 2);

}  // namespace

BspXmpvo::BspXmpvo(const mesh::Mesh& mesh) : GapSorter(mesh, CurvedCells::cut), tree_(gaps_.tree()) {}

void BspXmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  begin(viewpoint, order);
  tree_.place(viewpoint, [&](std::uint32_t t) { return turns_.sign(t); });
  const ExteriorWindows& windows = gaps_.windows();
  // Places of the tree's list to those of a slab, without a division for each.
  const std::uint64_t share = (std::uint64_t{places} << 32) / std::max<std::size_t>(tree_.nodes(), 1);
  turns_.begin([&](std::uint32_t t, int sign) {
    const std::size_t level = sign < 0 ? windows.greatest(t) : windows.least(t);
    const std::uint64_t place = (sign < 0 ? tree_.lastPlace(t) : tree_.firstPlace(t)) * share >> 32;
    return static_cast<Turn>(1 + level * slabs / ExteriorWindows::levels * places + place);
  });
  finish(viewpoint, order);
}

std::string BspXmpvo::why() const {
  if (!exact()) return overlapMessage(mesh_, overlapping_);
  return "a BSP tree of " + std::to_string(tree_.fragments()) +
         " fragments of exterior faces orders what lies across empty space";
}

}  // namespace spillikin::sort
