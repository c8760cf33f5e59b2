#include "spillikin/sort/xmpvo.h"

namespace spillikin::sort {

Xmpvo::Xmpvo(const mesh::Mesh& mesh, CurvedCells curved) : GapSorter(mesh, curved) {}

void Xmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  begin(viewpoint, order);
  // Sixteen levels of depth are one turn.
  const ExteriorWindows& windows = gaps_.windows();
  turns_.begin([&](std::uint32_t t, int sign) {
    return static_cast<Turn>(1 + (sign < 0 ? windows.greatest(t) : windows.least(t)) / 16);
  });
  finish(viewpoint, order);
}

std::string Xmpvo::why() const {
  if (!exact()) return overlapMessage(mesh_, overlapping_);
  return "every pair of exterior faces that one ray crosses through empty space is ordered exactly";
}

}  // namespace spillikin::sort
