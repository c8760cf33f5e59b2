#include "spillikin/sort/xmpvo.h"

#include "spillikin/sort/cycles.h"

namespace spillikin::sort {

Xmpvo::Xmpvo(const mesh::Mesh& mesh, CurvedCells curved)
    : mesh_(mesh),
      signs_(mesh),
      layered_(mesh),
      problems_(mesh, signs_, curved),
      gaps_(mesh, signs_),
      turns_(mesh, gaps_),
      overlapping_(gaps_.overlapping()) {}

void Xmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  order.exact = exact();
  signs_(viewpoint);
  problems_.begin(order);
  const DepthBands bands(gaps_.tree().lower(), gaps_.tree().upper(), viewpoint);
  turns_.begin([&](std::uint32_t t, int sign) {
    const Triangle corners = gaps_.tree().corners(t);
    return sign < 0 ? bands.latest(corners) : bands.earliest(corners);
  });
  if (layered_(signs_, order, nullptr, turns_.data()) < mesh_.cell_count() || !turns_.settle(viewpoint, layered_)) {
    orderByEdges(mesh_, signs_, layered_, gaps_, problems_, viewpoint, extra_, order);
    order.exact = order.exact && exact();
    return;
  }
  by_turn_(turns_.turns(), order.cells);
  order.layer_offset.clear();
}

std::string Xmpvo::why() const {
  if (!exact()) return overlapMessage(mesh_, overlapping_);
  return "every pair of exterior faces that one ray crosses through empty space is ordered exactly";
}

std::size_t Xmpvo::bytes() const {
  return signs_.bytes() + layered_.bytes() + problems_.bytes() + gaps_.bytes() + turns_.bytes() + by_turn_.bytes() +
         4 * (extra_.offset.capacity() + extra_.successor.capacity());
}

}  // namespace spillikin::sort
