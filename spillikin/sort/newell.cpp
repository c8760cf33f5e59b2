#include "spillikin/sort/newell.h"

#include <algorithm>

#include "spillikin/sort/split_exterior.h"

namespace spillikin::sort {

Newell::Newell(const mesh::Mesh& mesh)
    : matched_(withMatchedDiagonals(mesh)),
      mesh_(matched_ ? *matched_ : mesh),
      windows_(mesh_),
      spheres_(mesh_),
      pairs_(mesh_),
      moved_(mesh_.cell_count()),
      lowest_(mesh_.cell_count()),
      xmpvo_(mesh_) {}

void Newell::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cells.clear();
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.problems = {};
  order.exact = exact();
  windows_(viewpoint);
  spheres_.begin(viewpoint);
  pairs_.begin(viewpoint);
  std::fill(moved_.begin(), moved_.end(), 0U);
  moves_ = 0;
  pairs_tested_ = 0;
  cyclic_ = false;
  for (const mesh::Id cell : windows_.cells()) {
    if (!windows_.listed(cell)) listFrom(cell, viewpoint, order);
  }
}

void Newell::move(mesh::Id cell) {
  moved_[cell] = lowest_[cell] = ++moves_;
  head_.push_back(windows_.search(cell));
  waiting_.push_back(cell);
}

// The next cell that a hides and that was not moved yet, or none. Of those that were and that wait still, the earliest
// is noted: all since then are in cycles with a.
mesh::Id Newell::nextHidden(NewellWindows::Search& search) {
  const mesh::Id a = search.cell;
  for (mesh::Id b = windows_.next(search); b != mesh::none; b = windows_.next(search)) {
    if (moved_[b] != 0 && moved_[b] >= lowest_[a]) continue;  // nothing new
    ++pairs_tested_;
    if (spheres_.apart(a, b) || !pairs_.hides(a, b)) continue;
    if (moved_[b] == 0) return b;
    lowest_[a] = moved_[b];
  }
  return mesh::none;
}

// Lists the first cell that is left, after all that it hides, after all that these hide: Tarjan's search for strong
// components, with the head of the list for its stack.
void Newell::listFrom(mesh::Id first, const Viewpoint& viewpoint, Order& order) {
  move(first);
  while (!head_.empty()) {
    const mesh::Id a = head_.back().cell, hidden = nextHidden(head_.back());
    if (hidden != mesh::none) {
      move(hidden);
      continue;
    }
    head_.pop_back();
    if (!head_.empty()) lowest_[head_.back().cell] = std::min(lowest_[head_.back().cell], lowest_[a]);
    if (lowest_[a] == moved_[a]) listSince(a, viewpoint, order);
  }
}

// Lists a and those that were moved after it and wait: alone, or cells of one cycle, whose order is XMPVO's.
void Newell::listSince(mesh::Id a, const Viewpoint& viewpoint, Order& order) {
  auto begin = waiting_.end();
  do {
    windows_.list(*--begin);
  } while (*begin != a);
  if (waiting_.end() - begin == 1) {
    order.cells.push_back(a);
  } else {
    if (!cyclic_) askXmpvo(viewpoint, order);
    excerpts_.append({&*begin, static_cast<std::size_t>(waiting_.end() - begin)}, order);
  }
  waiting_.erase(begin, waiting_.end());
}

void Newell::askXmpvo(const Viewpoint& viewpoint, Order& order) {
  cyclic_ = true;
  xmpvo_(viewpoint, whole_);
  excerpts_.read(whole_, mesh_.cell_count());
  order.cycles = whole_.cycles;
  order.problems = whole_.problems;
  order.exact = order.exact && whole_.exact;
}

std::string Newell::why() const {
  return exact() ? "every pair of cells that could hide one another is tested exactly" : xmpvo_.why();
}

std::size_t Newell::bytes() const {
  return (matched_ ? sort::bytes(*matched_) : 0) + windows_.bytes() + spheres_.bytes() + pairs_.bytes() +
         4 * (moved_.capacity() + lowest_.capacity() + waiting_.capacity()) + head_.capacity() * sizeof(head_[0]) +
         xmpvo_.bytes();
}

}  // namespace spillikin::sort
