#include "spillikin/sort/xmpvo.h"

namespace spillikin::sort {

Xmpvo::Xmpvo(const mesh::Mesh& mesh, CurvedCells curved) : GapSorter(mesh, curved) {}

void Xmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  begin(viewpoint, order);
  const DepthBands bands(gaps_.tree().lower(), gaps_.tree().upper(), viewpoint);
  turns_.begin([&](std::uint32_t t, int sign) {
    const Triangle corners = gaps_.tree().corners(t);
    return sign < 0 ? bands.latest(corners) : bands.earliest(corners);
  });
  finish(viewpoint, order);
}

std::string Xmpvo::why() const {
  if (!exact()) return overlapMessage(mesh_, overlapping_);
  return "every pair of exterior faces that one ray crosses through empty space is ordered exactly";
}

}  // namespace spillikin::sort
