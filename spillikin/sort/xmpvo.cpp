#include "spillikin/sort/xmpvo.h"

#include "spillikin/sort/cycles.h"

namespace spillikin::sort {

Xmpvo::Xmpvo(const mesh::Mesh& mesh) : mesh_(mesh), signs_(mesh), layered_(mesh), gaps_(mesh, signs_) {}

void Xmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  signs_(viewpoint);
  gaps_(viewpoint, extra_);
  order.exact = true;
  const std::size_t listed = layered_(signs_, order, &extra_);
  if (listed == mesh_.cell_count()) return;
  const Gaps gaps{gaps_, extra_};
  order.exact = appendLeft(mesh_, signs_, layered_, &gaps, viewpoint, order);
}

std::string Xmpvo::why() const {
  return "every pair of exterior faces that one ray crosses through empty space is ordered exactly";
}

std::size_t Xmpvo::bytes() const {
  return signs_.bytes() + layered_.bytes() + gaps_.bytes() +
         4 * (extra_.offset.capacity() + extra_.successor.capacity());
}

}  // namespace spillikin::sort
