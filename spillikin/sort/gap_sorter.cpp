#include "spillikin/sort/gap_sorter.h"

#include <algorithm>

#include "spillikin/sort/cycles.h"
#include "spillikin/sort/split_exterior.h"

namespace spillikin::sort {
namespace {

// Times that a view may learn edges across gaps, before it asks for all: two for each time that cycles grow together.
constexpr int most_rounds = 8;

}  // namespace

GapSorter::GapSorter(const mesh::Mesh& mesh, CurvedCells curved)
    : matched_(withMatchedDiagonals(mesh)),
      mesh_(matched_ ? *matched_ : mesh),
      signs_(mesh_),
      layered_(mesh_),
      problems_(mesh_, signs_, curved),
      parted_(mesh_, signs_, problems_.faces()),
      gaps_(mesh_, signs_),
      turns_(mesh_, gaps_, parted_),
      overlapping_(gaps_.overlapping()) {}

void GapSorter::begin(const Viewpoint& viewpoint, Order& order) {
  order.cycles.clear();
  order.exact = exact();
  signs_(viewpoint);
  problems_.begin(order);
  if (!problems_.subdivides()) parted_.part();
  gaps_.windows().look(viewpoint);
  turns_.readSigns();
}

void GapSorter::finish(const Viewpoint& viewpoint, Order& order) {
  extra_.offset.clear();
  extra_.successor.clear();
  pairs_.clear();
  for (int round = 0; round < most_rounds; ++round) {
    if (round > 0) turns_.again();
    if (settle(viewpoint, order)) return;
  }
  orderByEdges(mesh_, signs_, layered_, gaps_, problems_, parted_, viewpoint, extra_, order);
  order.exact = order.exact && exact();
}

// Orders by the edges learnt so far and by turns. False when more had to be learnt.
bool GapSorter::settle(const Viewpoint& viewpoint, Order& order) {
  ties_.clear();
  order.cycles.clear();
  const Gaps gaps{gaps_, extra_};
  const Gaps* known = extra_.empty() ? nullptr : &gaps;
  const bool all = layered_(signs_, order, &extra_, turns_.data(), &parted_);
  if (!all) {
    if (known != nullptr && !completeCycles(viewpoint)) return false;
    tieLeft(layered_, known, turns_.data(), ties_);
  }
  if (!turns_.settle(viewpoint, layered_, ties_, extra_)) {
    learn(turns_.wrong());
    return false;
  }
  order.exact = exact();
  if (!all && !cutTies(mesh_, signs_, layered_, known, problems_, viewpoint, order, ties_)) order.exact = false;
  problems_.end();
  turns_.addPieces(ties_);
  by_turn_(turns_.turns(), order.cells);
  parted_.list(order, ties_.pieces);
  order.layer_offset.clear();
  return true;
}

// Are all edges across gaps from a cycle into itself known, so that it can be cut? Learns them if not.
bool GapSorter::completeCycles(const Viewpoint& viewpoint) {
  const Gaps gaps{gaps_, extra_};
  groupCycles(mesh_, layered_, &gaps, group_);
  CellPairs inside;
  gaps_.inside(viewpoint, group_, inside);
  const std::size_t before = pairs_.size();
  learn(inside);
  return pairs_.size() == before;
}

void GapSorter::learn(const CellPairs& pairs) {
  pairs_.insert(pairs_.end(), pairs.begin(), pairs.end());
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  setEdges(pairs_, mesh_.cell_count(), extra_);
}

std::size_t GapSorter::bytes() const {
  return signs_.bytes() + layered_.bytes() + problems_.bytes() + parted_.bytes() + gaps_.bytes() + turns_.bytes() +
         by_turn_.bytes() + 4 * (extra_.offset.capacity() + extra_.successor.capacity() + group_.capacity()) +
         8 * pairs_.capacity() + (matched_ ? sort::bytes(*matched_) : 0);
}

}  // namespace spillikin::sort
