#include "spillikin/sort/gap_turns.h"

#include <algorithm>

namespace spillikin::sort {
namespace {

// Searches after which more rounds cost more than edges do: so many times those of the first round, and some for small
// meshes. Large cycles that lead through gaps are looked at again in every round.
constexpr std::size_t most_searched = 3, few_searches = 1000;
constexpr std::size_t block = 512;  // triangles searched by one task, whose pairs are kept together

}  // namespace

GapTurns::GapTurns(const mesh::Mesh& mesh, GapEdges& gaps, const PartedCells& parted)
    : mesh_(mesh),
      gaps_(gaps),
      parted_(parted),
      sign_(gaps.tree().triangles().size()),
      guess_(sign_.size()),
      turn_(mesh.cell_count()) {
  cell_.reserve(sign_.size());
  for (const ExteriorTriangle& t : gaps.tree().triangles())
    cell_.push_back(t.cell);
}

void GapTurns::readSigns() {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, sign_.size(), grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (auto t = static_cast<std::uint32_t>(range.begin()); t < range.end(); ++t)
                        sign_[t] = static_cast<std::int8_t>(gaps_.sign(t));
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
    if (sign_[t] < 0) turn_[cell_[t]] = std::max(turn_[cell_[t]], guess_[t]);
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
  return sign_[entry] > 0 && lastTurn(cell_[entry]) >= guess_[entry];
}

bool GapTurns::knows(std::uint32_t exit, std::uint32_t entry) const {
  if (known_->empty()) return false;
  const auto after = known_->after(cell_[entry]);
  return std::binary_search(after.begin(), after.end(), cell_[exit]);
}

void GapTurns::search(std::span<const std::uint32_t> entries, const Viewpoint& viewpoint,
                      std::vector<Pair>& found) const {
  thread_local std::vector<WindowQuery> queries;
  thread_local std::vector<WindowPair> candidates;
  queries.clear();
  candidates.clear();
  for (const std::uint32_t entry : entries)
    queries.push_back({entry, guess_[entry], lastTurn(cell_[entry])});
  gaps_.windows().meeting(queries, candidates);
  for (const auto& [exit, entry] : candidates) {
    // Turns may have grown since the windows got theirs.
    if (cell_[exit] == cell_[entry] || turn_[cell_[exit]] > lastTurn(cell_[entry]) || knows(exit, entry)) continue;
    if (gaps_.related(exit, entry, viewpoint)) found.emplace_back(exit, entry);
  }
}

// Linear; serial, for it does next to nothing.
void GapTurns::findOpen() {
  open_.clear();
  for (std::uint32_t t = 0; t < sign_.size(); ++t) {
    if (open(t)) open_.push_back(t);
  }
}

void GapTurns::searchOpen(const Viewpoint& viewpoint) {
  const std::size_t blocks = (open_.size() + block - 1) / block;
  found_.resize(std::max(found_.size(), blocks));
  for (auto& found : found_)
    found.clear();
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
    const std::size_t first = b * block, count = std::min(open_.size() - first, block);
    search(std::span(open_).subspan(first, count), viewpoint, found_[b]);
  });
  searched_ += open_.size();
}

// A quadrilateral that abuts two triangles may lie before or behind them: no guess tells.
void GapTurns::addAbutting(const Viewpoint& viewpoint) {
  if (gaps_.abutting().empty()) return;
  found_.resize(std::max<std::size_t>(found_.size(), 1));
  for (const auto& [a, b] : gaps_.abutting()) {
    for (const auto& [exit, entry] : {std::pair{a, b}, std::pair{b, a}}) {
      if (sign_[exit] >= 0 || sign_[entry] <= 0) continue;
      if (turn_[cell_[exit]] > lastTurn(cell_[entry])) continue;
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
  for (const auto& found : found_) {
    for (const auto& [exit, entry] : found)
      wrong_.emplace_back(cell_[entry], cell_[exit]);
  }
}

// Puts off the exits found, with all cells before them, and notes which entries are to be looked at again. False when
// turns run out.
bool GapTurns::putOffFound(const LayeredSort& layered, const Ties& ties) {
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
      const Turn turn = lastTurn(cell_[entry]);
      if (turn + 1 >= ExteriorWindows::never || tied(cell_[exit], cell_[entry], ties)) return false;
      ++put_off_;
      put(cell_[exit], static_cast<Turn>(turn + 1));
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
  searched_ = put_off_ = 0;
  known_ = &known;
  wrong_.clear();
  findOpen();
  if (open_.empty() && gaps_.abutting().empty()) return true;
  // An exit with an earlier guess than the entry is farther on every ray, one whose cell comes later is right.
  gaps_.windows().setTurns([&](std::uint32_t t) { return sign_[t] < 0 ? turn_[cell_[t]] : ExteriorWindows::never; },
                           [&](std::uint32_t t) { return guess_[t]; });
  searchOpen(viewpoint);
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
  std::size_t bytes = sign_.capacity() + 2 * (guess_.capacity() + turn_.capacity()) +
                      4 * (cell_.capacity() + open_.capacity() + raised_.capacity());
  for (const auto& found : found_)
    bytes += found.capacity() * sizeof(Pair);
  return bytes;
}

}  // namespace spillikin::sort
