#include "spillikin/sort/gap_turns.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>

namespace spillikin::sort {
namespace {

// Searches after which more rounds cost more than edges do: so many times those of the first round, and some for small
// meshes. Large cycles that lead through gaps are looked at again in every round.
constexpr std::size_t most_searched = 3, few_searches = 1000;
constexpr std::size_t block = 256;  // triangles searched by one task, whose pairs are kept together

}  // namespace

GapTurns::GapTurns(const mesh::Mesh& mesh, GapEdges& gaps, const PartedCells& parted)
    : mesh_(mesh),
      gaps_(gaps),
      parted_(parted),
      alone_(gaps.tree().triangles().size()),
      guess_(alone_.size()),
      turn_(mesh.cell_count()) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, alone_.size(), 256),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t t = range.begin(); t < range.end(); ++t)
                        alone_[t] = gaps_.facesAny(static_cast<std::uint32_t>(t)) ? 0 : 1;
                    });
}

void GapTurns::clear() {
  turn_.resize(parted_.nodes());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, turn_.size(), 1 << 16),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      std::fill(turn_.begin() + static_cast<std::ptrdiff_t>(range.begin()),
                                turn_.begin() + static_cast<std::ptrdiff_t>(range.end()), Turn{0});
                    });
}

void GapTurns::again() {
  clear();
  for (std::uint32_t t = 0; t < guess_.size(); ++t) {
    if (gaps_.sign(t) >= 0 || alone_[t] != 0) continue;
    Turn& turn = turn_[gaps_.tree().triangles()[t].cell];
    turn = std::max(turn, guess_[t]);
  }
}

// Of the parts of a cell.
Turn GapTurns::lastTurn(mesh::Id cell) const {
  Turn last = turn_[cell];
  for (const PartedCells::Sliver& sliver : parted_.slivers(cell))
    last = std::max(last, turn_[parted_.node(sliver)]);
  return last;
}

// May an exit before it come too early?
bool GapTurns::open(std::uint32_t entry) const {
  return gaps_.sign(entry) > 0 && alone_[entry] == 0 && lastTurn(gaps_.tree().triangles()[entry].cell) >= guess_[entry];
}

bool GapTurns::knows(std::uint32_t exit, std::uint32_t entry) const {
  if (known_->empty()) return false;
  const auto& triangles = gaps_.tree().triangles();
  const auto after = known_->after(triangles[entry].cell);
  return std::binary_search(after.begin(), after.end(), triangles[exit].cell);
}

void GapTurns::search(std::uint32_t entry, const Viewpoint& viewpoint, std::vector<std::uint32_t>& scratch,
                      std::vector<Pair>& found) const {
  const auto& triangles = gaps_.tree().triangles();
  const mesh::Id cell = triangles[entry].cell;
  const Turn last = lastTurn(cell);
  scratch.clear();
  gaps_.tree().inFront(entry, 1, viewpoint, guess_[entry], last, scratch);
  for (const std::uint32_t exit : scratch) {
    if (triangles[exit].cell == cell || turn_[triangles[exit].cell] > last) continue;
    if (guess_[exit] < guess_[entry] || knows(exit, entry)) continue;
    if (gaps_.related(exit, entry, viewpoint)) found.emplace_back(exit, entry);
  }
}

void GapTurns::searchAll(const Viewpoint& viewpoint) {
  const std::size_t count = guess_.size(), blocks = (count + block - 1) / block;
  found_.resize(std::max(found_.size(), blocks));
  searches_.resize(blocks);
  tbb::enumerable_thread_specific<std::vector<std::uint32_t>> scratch;
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
    found_[b].clear();
    std::size_t searches = 0;
    for (auto t = static_cast<std::uint32_t>(b * block); t < std::min(count, (b + 1) * block); ++t) {
      if (!open(t)) continue;
      ++searches;
      search(t, viewpoint, scratch.local(), found_[b]);
    }
    searches_[b] = searches;
  });
  for (const std::size_t searches : searches_)
    searched_ += searches;
}

void GapTurns::searchOpen(const Viewpoint& viewpoint) {
  const std::size_t blocks = (open_.size() + block - 1) / block;
  found_.resize(std::max(found_.size(), blocks));
  for (auto& found : found_)
    found.clear();
  tbb::enumerable_thread_specific<std::vector<std::uint32_t>> scratch;
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
    for (std::size_t i = b * block; i < std::min(open_.size(), (b + 1) * block); ++i)
      search(open_[i], viewpoint, scratch.local(), found_[b]);
  });
  searched_ += open_.size();
}

// A quadrilateral that abuts two triangles may lie before or behind them: no guess tells.
void GapTurns::addAbutting(const Viewpoint& viewpoint) {
  if (found_.empty()) return;
  const auto& triangles = gaps_.tree().triangles();
  for (const auto& [a, b] : gaps_.abutting()) {
    for (const auto& [exit, entry] : {std::pair{a, b}, std::pair{b, a}}) {
      if (gaps_.sign(exit) >= 0 || gaps_.sign(entry) <= 0) continue;
      if (turn_[triangles[exit].cell] > lastTurn(triangles[entry].cell)) continue;
      if (!knows(exit, entry) && gaps_.related(exit, entry, viewpoint)) found_.front().emplace_back(exit, entry);
    }
  }
}

// Whether a cycle holds what comes first of the one cell and a part of the other.
bool GapTurns::tied(mesh::Id exit, mesh::Id entry, const Ties& ties) const {
  if (ties.of.empty() || ties.of[exit] == mesh::none) return false;
  const auto with = [&](mesh::Id node) { return ties.of[node] == ties.of[exit]; };
  const auto slivers = parted_.slivers(entry);
  return with(entry) || std::any_of(slivers.begin(), slivers.end(),
                                    [&](const PartedCells::Sliver& s) { return with(parted_.node(s)); });
}

void GapTurns::addPieces(const Ties& ties) {
  for (const mesh::Id tie : ties.tie_of_piece)
    turn_.push_back(turn_[ties.nodes[tie].front()]);
}

void GapTurns::noteFound() {
  const auto& triangles = gaps_.tree().triangles();
  for (const auto& found : found_) {
    for (const auto& [exit, entry] : found)
      wrong_.emplace_back(triangles[entry].cell, triangles[exit].cell);
  }
}

// Puts off the exits found, with all cells before them, and notes which entries are to be looked at again. False when
// turns run out.
bool GapTurns::putOffFound(const LayeredSort& layered, const Ties& ties) {
  const auto& triangles = gaps_.tree().triangles();
  raised_.clear();
  const auto putOne = [&](mesh::Id node, Turn least) {
    if (turn_[node] >= least) return;
    turn_[node] = least;
    raised_.push_back(node);
  };
  const auto put = [&](mesh::Id node, Turn least) {
    if (ties.of.empty() || ties.of[node] == mesh::none) {
      putOne(node, least);
      return;
    }
    for (const mesh::Id with : ties.nodes[ties.of[node]])
      putOne(with, least);
  };
  for (const auto& found : found_) {
    for (const auto& [exit, entry] : found) {
      const Turn turn = lastTurn(triangles[entry].cell);
      if (turn + 1 >= ExteriorTree::never || tied(triangles[exit].cell, triangles[entry].cell, ties)) return false;
      ++put_off_;
      put(triangles[exit].cell, static_cast<Turn>(turn + 1));
    }
  }
  for (std::size_t i = 0; i < raised_.size(); ++i) {  // grows on the way
    const Turn turn = turn_[raised_[i]];
    layered.forEachAfter(raised_[i], [&](mesh::Id next) { put(next, turn); });
    if (known_->empty()) continue;
    for (const mesh::Id next : known_->after(parted_.cell(raised_[i])))
      put(next, turn);
  }
  for (mesh::Id& node : raised_)
    node = parted_.cell(node);
  std::sort(raised_.begin(), raised_.end());
  raised_.erase(std::unique(raised_.begin(), raised_.end()), raised_.end());
  open_.clear();
  for (const mesh::Id cell : raised_) {
    for (const std::uint32_t t : gaps_.trianglesOf(cell)) {
      if (open(t)) open_.push_back(t);
    }
  }
  return true;
}

bool GapTurns::settle(const Viewpoint& viewpoint, const LayeredSort& layered, const Ties& ties,
                      const ExtraEdges& known) {
  const auto& triangles = gaps_.tree().triangles();
  searched_ = put_off_ = 0;
  known_ = &known;
  wrong_.clear();
  // An exit with an earlier guess than the entry is farther on every ray, one whose cell comes later is right.
  gaps_.tree().setTurns(
      [&](std::uint32_t t) {
        return gaps_.sign(t) < 0 && alone_[t] == 0 ? turn_[triangles[t].cell] : ExteriorTree::never;
      },
      [&](std::uint32_t t) { return guess_[t]; });
  searchAll(viewpoint);
  const std::size_t most = most_searched * searched_ + few_searches;
  for (int round = 0; round < most_rounds && searched_ <= most; ++round) {
    addAbutting(viewpoint);
    const bool any = std::any_of(found_.begin(), found_.end(), [](const auto& found) { return !found.empty(); });
    if (!any) return true;
    noteFound();
    if (!putOffFound(layered, ties)) return false;
    searchOpen(viewpoint);
  }
  return false;
}

std::size_t GapTurns::bytes() const {
  std::size_t bytes = alone_.capacity() + 2 * (guess_.capacity() + turn_.capacity()) +
                      4 * (open_.capacity() + raised_.capacity()) + searches_.capacity() * sizeof(std::size_t);
  for (const auto& found : found_)
    bytes += found.capacity() * sizeof(Pair);
  return bytes;
}

}  // namespace spillikin::sort
