#include "spillikin/sort/bsp_xmpvo.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t slabs = 64, places = 256;  // of depth, and of the tree's list within each
static_assert(DepthBands::bands % slabs == 0 && slabs * places < ExteriorTree::never / 2);

}  // namespace

BspXmpvo::BspXmpvo(const mesh::Mesh& mesh) : GapSorter(mesh, CurvedCells::cut), tree_(gaps_.tree()) {}

void BspXmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  begin(viewpoint, order);
  tree_.place(viewpoint, [&](std::uint32_t t) { return gaps_.sign(t); });
  const DepthBands bands(gaps_.tree().lower(), gaps_.tree().upper(), viewpoint);
  turns_.begin([&](std::uint32_t t, int sign) {
    const Triangle corners = gaps_.tree().corners(t);
    const std::size_t slab = (sign < 0 ? bands.latest(corners) : bands.earliest(corners)) / (DepthBands::bands / slabs);
    const std::size_t place = std::size_t{sign < 0 ? tree_.lastPlace(t) : tree_.firstPlace(t)} * places / tree_.nodes();
    return static_cast<Turn>(1 + slab * places + place);
  });
  finish(viewpoint, order);
}

std::string BspXmpvo::why() const {
  if (!exact()) return overlapMessage(mesh_, overlapping_);
  return "a BSP tree of " + std::to_string(tree_.fragments()) +
         " fragments of exterior faces orders what lies across empty space";
}

}  // namespace spillikin::sort
