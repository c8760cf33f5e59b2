#include "spillikin/sort/gap_sorter.h"

#include "spillikin/sort/cycles.h"

namespace spillikin::sort {

GapSorter::GapSorter(const mesh::Mesh& mesh, CurvedCells curved)
    : mesh_(mesh),
      signs_(mesh),
      layered_(mesh),
      problems_(mesh, signs_, curved),
      parted_(mesh, signs_, problems_.faces()),
      gaps_(mesh, signs_),
      turns_(mesh, gaps_, parted_),
      overlapping_(gaps_.overlapping()) {}

void GapSorter::begin(const Viewpoint& viewpoint, Order& order) {
  order.cycles.clear();
  order.exact = exact();
  signs_(viewpoint);
  problems_.begin(order);
  if (!problems_.subdivides()) parted_.part();
}

void GapSorter::finish(const Viewpoint& viewpoint, Order& order) {
  ties_.clear();
  bool right = exact();
  if (!layered_(signs_, order, nullptr, turns_.data(), &parted_)) {
    right = tieLeft(mesh_, signs_, layered_, problems_, viewpoint, turns_.data(), order, ties_) && right;
  }
  if (!turns_.settle(viewpoint, layered_, ties_)) {
    orderByEdges(mesh_, signs_, layered_, gaps_, problems_, parted_, viewpoint, extra_, order);
    order.exact = order.exact && exact();
    return;
  }
  problems_.end();
  order.exact = right;
  turns_.addPieces(ties_);
  by_turn_(turns_.turns(), order.cells);
  parted_.list(order, ties_.pieces);
  order.layer_offset.clear();
}

std::size_t GapSorter::bytes() const {
  return signs_.bytes() + layered_.bytes() + problems_.bytes() + parted_.bytes() + gaps_.bytes() + turns_.bytes() +
         by_turn_.bytes() + 4 * (extra_.offset.capacity() + extra_.successor.capacity());
}

}  // namespace spillikin::sort
