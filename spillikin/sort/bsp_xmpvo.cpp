#include "spillikin/sort/bsp_xmpvo.h"

#include "spillikin/sort/cycles.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t slabs = 64, places = 256;  // of depth, and of the tree's list within each
static_assert(DepthBands::bands % slabs == 0 && slabs * places < ExteriorTree::never / 2);

}  // namespace

BspXmpvo::BspXmpvo(const mesh::Mesh& mesh)
    : mesh_(mesh),
      signs_(mesh),
      layered_(mesh),
      problems_(mesh, signs_, CurvedCells::cut),
      gaps_(mesh, signs_),
      turns_(mesh, gaps_),
      tree_(gaps_.tree()),
      overlapping_(gaps_.overlapping()) {}

void BspXmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  order.exact = exact();
  signs_(viewpoint);
  problems_.begin(order);
  tree_.place(viewpoint, [&](std::uint32_t t) { return gaps_.sign(t); });
  const DepthBands bands(gaps_.tree().lower(), gaps_.tree().upper(), viewpoint);
  turns_.begin([&](std::uint32_t t, int sign) {
    const Triangle corners = gaps_.tree().corners(t);
    const std::size_t slab = (sign < 0 ? bands.latest(corners) : bands.earliest(corners)) / (DepthBands::bands / slabs);
    const std::size_t place = std::size_t{sign < 0 ? tree_.lastPlace(t) : tree_.firstPlace(t)} * places / tree_.nodes();
    return static_cast<Turn>(1 + slab * places + place);
  });
  if (layered_(signs_, order, nullptr, turns_.data()) < mesh_.cell_count() || !turns_.settle(viewpoint, layered_)) {
    orderByEdges(mesh_, signs_, layered_, gaps_, problems_, viewpoint, extra_, order);
    order.exact = order.exact && exact();
    return;
  }
  by_turn_(turns_.turns(), order.cells);
  order.layer_offset.clear();
}

std::string BspXmpvo::why() const {
  if (!exact()) return overlapMessage(mesh_, overlapping_);
  return "a BSP tree of " + std::to_string(tree_.fragments()) +
         " fragments of exterior faces orders what lies across empty space";
}

std::size_t BspXmpvo::bytes() const {
  return signs_.bytes() + layered_.bytes() + problems_.bytes() + gaps_.bytes() + turns_.bytes() + tree_.bytes() +
         by_turn_.bytes() + 4 * (extra_.offset.capacity() + extra_.successor.capacity());
}

}  // namespace spillikin::sort
