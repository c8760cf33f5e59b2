#include "spillikin/sort/bsp_xmpvo.h"

#include <algorithm>

#include "spillikin/sort/cycles.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t most_turns = 16384;  // that places in the tree's list are gathered into

}  // namespace

BspXmpvo::BspXmpvo(const mesh::Mesh& mesh)
    : mesh_(mesh), signs_(mesh), layered_(mesh), gaps_(mesh, signs_), turns_(mesh, gaps_), tree_(gaps_.tree()) {}

void BspXmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  order.exact = true;
  signs_(viewpoint);
  tree_.place(viewpoint, [&](std::uint32_t t) { return gaps_.sign(t); });
  const std::size_t turns = std::min(most_turns, tree_.nodes());
  turns_.begin([&](std::uint32_t t, int sign) {
    const std::size_t place = sign < 0 ? tree_.lastPlace(t) : tree_.firstPlace(t);
    return static_cast<Turn>(1 + place * turns / tree_.nodes());
  });
  if (layered_(signs_, order, nullptr, turns_.data()) < mesh_.cell_count() || !turns_.settle(viewpoint, layered_)) {
    orderByEdges(mesh_, signs_, layered_, gaps_, viewpoint, extra_, order);
    return;
  }
  by_turn_(turns_.turns(), order.cells);
  order.layer_offset.clear();
}

std::string BspXmpvo::why() const {
  return "a BSP tree of " + std::to_string(tree_.fragments()) +
         " fragments of exterior faces orders what lies across empty space";
}

std::size_t BspXmpvo::bytes() const {
  return signs_.bytes() + layered_.bytes() + gaps_.bytes() + turns_.bytes() + tree_.bytes() + by_turn_.bytes() +
         4 * (extra_.offset.capacity() + extra_.successor.capacity());
}

}  // namespace spillikin::sort
