#include "spillikin/sort/newell.h"

#include <algorithm>

#include "spillikin/sort/splice.h"
#include "spillikin/sort/split_exterior.h"

namespace spillikin::sort {

Newell::Newell(const mesh::Mesh& mesh)
    : matched_(withMatchedDiagonals(mesh)),
      mesh_(matched_ ? *matched_ : mesh),
      windows_(mesh_),
      pairs_(mesh_),
      moved_(mesh_.cell_count()),
      xmpvo_(mesh_) {}

void Newell::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cells.clear();
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.exact = exact();
  windows_(viewpoint);
  pairs_.begin(viewpoint);
  std::fill(moved_.begin(), moved_.end(), std::uint8_t{0});
  pairs_tested_ = 0;
  for (const mesh::Id cell : windows_.cells()) {
    if (windows_.listed(cell) || listFrom(cell, order)) continue;
    xmpvo_(viewpoint, rest_);
    appendUnlisted(rest_, windows_.listedCells(), order);
    return;
  }
}

// Lists the first cell that waits, after all that it hides, after all that these hide. False in a cycle.
bool Newell::listFrom(mesh::Id first, Order& order) {
  head_.clear();
  head_.push_back(windows_.search(first));
  moved_[first] = 1;
  while (!head_.empty()) {
    NewellWindows::Search& search = head_.back();
    const mesh::Id a = search.cell;
    mesh::Id b = windows_.next(search);
    while (b != mesh::none && (++pairs_tested_, !pairs_.hides(a, b)))
      b = windows_.next(search);
    if (b == mesh::none) {
      windows_.list(a);
      order.cells.push_back(a);
      head_.pop_back();
      continue;
    }
    if (moved_[b] != 0) return false;
    moved_[b] = 1;
    head_.push_back(windows_.search(b));
  }
  return true;
}

std::string Newell::why() const {
  return exact() ? "every pair of cells that could hide one another is tested exactly" : xmpvo_.why();
}

std::size_t Newell::bytes() const {
  return (matched_ ? sort::bytes(*matched_) : 0) + windows_.bytes() + pairs_.bytes() + moved_.capacity() +
         head_.capacity() * sizeof(head_[0]) + xmpvo_.bytes();
}

}  // namespace spillikin::sort
