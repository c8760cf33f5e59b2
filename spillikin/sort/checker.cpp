#include "spillikin/sort/checker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <tuple>

#include "spillikin/base/error.h"

namespace spillikin::sort {

namespace {

bool deeper(const Inversion& a, const Inversion& b) {
  return std::tie(b.depth, a.y, a.x, a.front, a.back) < std::tie(a.depth, b.y, b.x, b.front, b.back);
}

void keepWorst(std::vector<Inversion>& worst) {
  std::sort(worst.begin(), worst.end(), deeper);
  if (worst.size() > Tally::worst_kept) worst.resize(Tally::worst_kept);
}

void keepFirst(std::vector<Tally::Overlap>& overlaps) {
  std::sort(overlaps.begin(), overlaps.end(),
            [](const auto& a, const auto& b) { return std::tie(a.y, a.x, a.cells) < std::tie(b.y, b.x, b.cells); });
  if (overlaps.size() > Tally::worst_kept) overlaps.resize(Tally::worst_kept);
}

// Pairs i < j with place[i] < place[j], by merge sort; `place` ends sorted.
std::size_t ascendingPairs(std::vector<std::uint32_t>& place, std::vector<std::uint32_t>& scratch, std::size_t from,
                           std::size_t to) {
  if (to - from < 2) return 0;
  const std::size_t middle = from + (to - from) / 2;
  std::size_t count = ascendingPairs(place, scratch, from, middle) + ascendingPairs(place, scratch, middle, to);
  std::size_t i = from;
  std::size_t j = middle;
  for (std::size_t k = from; k < to; ++k) {
    if (i < middle && (j == to || place[i] < place[j])) {
      count += to - j;  // place[i] is below all that is left on the right
      scratch[k] = place[i++];
    } else {
      scratch[k] = place[j++];
    }
  }
  std::copy(scratch.begin() + static_cast<std::ptrdiff_t>(from), scratch.begin() + static_cast<std::ptrdiff_t>(to),
            place.begin() + static_cast<std::ptrdiff_t>(from));
  return count;
}

double tolerance(double enter, double leave) {
  return touch_tolerance * std::max(std::abs(enter), std::abs(leave));
}

bool overlap(double leave, double enter) {
  return enter < leave - tolerance(enter, leave);
}

}  // namespace

void Tally::merge(const Tally& other) {
  rays += other.rays;
  pairs += other.pairs;
  inversions += other.inversions;
  contested += other.contested;
  overlaps += other.overlaps;
  worst.insert(worst.end(), other.worst.begin(), other.worst.end());
  keepWorst(worst);
  first_overlaps.insert(first_overlaps.end(), other.first_overlaps.begin(), other.first_overlaps.end());
  keepFirst(first_overlaps);
}

OrderChecker::OrderChecker(const Order& order, std::size_t cell_count)
    : order_(order), first_entry_(cell_count + 1, 0), entry_(order.cells.size()) {
  for (const mesh::Id c : order.cells)
    ++first_entry_[c + 1];
  for (std::size_t c = 0; c < cell_count; ++c) {
    if (first_entry_[c + 1] == 0) throw Error(fmt::format("cell {} is missing from the visibility order", c));
    first_entry_[c + 1] += first_entry_[c];
  }
  std::vector<std::uint32_t> next(first_entry_.begin(), first_entry_.end() - 1);
  for (std::uint32_t place = 0; place < order.cells.size(); ++place)
    entry_[next[order.cells[place]]++] = place;
}

void OrderChecker::split(const Crossing& crossing, const Vec3& origin, const Vec3& direction,
                         std::vector<Piece>& pieces) const {
  for (std::uint32_t e = first_entry_[crossing.cell]; e < first_entry_[crossing.cell + 1]; ++e) {
    Piece piece{crossing.cell, entry_[e], crossing.enter, crossing.leave};
    const std::size_t cut = order_.cuts.first(piece.place);
    if (cut < order_.cuts.size() && order_.cuts[cut].entry == piece.place) {
      for (const HalfSpace& h : order_.cuts[cut].keep) {
        const double at_origin = glm::dot(h.normal, origin) + h.offset;
        const double slope = glm::dot(h.normal, direction);
        if (slope > 0.0) piece.enter = std::max(piece.enter, -at_origin / slope);
        if (slope < 0.0) piece.leave = std::min(piece.leave, -at_origin / slope);
        if (slope == 0.0 && at_origin < 0.0) piece.leave = piece.enter;
      }
    }
    if (piece.leave - piece.enter > tolerance(piece.enter, piece.leave)) pieces.push_back(piece);
  }
}

std::size_t OrderChecker::contested(std::span<const Piece> pieces) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (std::size_t j = i + 1; j < pieces.size() && pieces[j].enter < pieces[i].leave; ++j)
      count += pieces[i].place < pieces[j].place && overlap(pieces[i].leave, pieces[j].enter) ? 1U : 0U;
  }
  return count;
}

// For each piece the worst that is composited before it though it lies in front; where pieces overlap, of those that
// end before it begins.
void OrderChecker::addWorst(int x, int y, std::span<const Piece> pieces, bool overlaps, Tally& tally) {
  std::size_t lowest = 0;
  for (std::size_t j = 1; j < pieces.size(); ++j) {
    std::size_t front = lowest;
    if (overlaps) {
      front = j;
      for (std::size_t i = 0; i < j; ++i) {
        if (pieces[i].place < pieces[front].place && !overlap(pieces[i].leave, pieces[j].enter)) front = i;
      }
    }
    if (pieces[front].place < pieces[j].place)
      tally.worst.push_back({x, y, pieces[front].cell, pieces[j].cell, pieces[j].enter - pieces[front].enter});
    if (pieces[j].place < pieces[lowest].place) lowest = j;
  }
  if (tally.worst.size() > 8 * Tally::worst_kept) keepWorst(tally.worst);
}

void OrderChecker::add(int x, int y, const Vec3& origin, const Vec3& direction, std::span<const Crossing> crossings,
                       Tally& tally) const {
  thread_local std::vector<Piece> pieces;
  thread_local std::vector<std::uint32_t> places;
  thread_local std::vector<std::uint32_t> scratch;
  pieces.clear();
  for (const Crossing& c : crossings)
    split(c, origin, direction, pieces);
  if (pieces.empty()) return;
  std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    return std::tie(a.enter, a.leave, a.place) < std::tie(b.enter, b.leave, b.place);
  });
  ++tally.rays;
  tally.pairs += pieces.size() * (pieces.size() - 1) / 2;

  const std::size_t overlaps_before = tally.overlaps;
  std::size_t farthest = 0;  // the piece that reaches deepest so far
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const Piece& before = pieces[farthest];
    if (overlap(before.leave, pieces[i].enter)) {
      ++tally.overlaps;
      tally.first_overlaps.push_back({x, y, {before.cell, pieces[i].cell}});
      if (tally.first_overlaps.size() > 8 * Tally::worst_kept) keepFirst(tally.first_overlaps);
    }
    if (pieces[i].leave > before.leave) farthest = i;
  }

  // Front to back, places must descend: the nearest piece is composited last.
  places.resize(pieces.size());
  scratch.resize(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i)
    places[i] = pieces[i].place;
  const std::size_t ascending = ascendingPairs(places, scratch, 0, places.size());
  if (ascending == 0) return;
  const bool any_overlap = tally.overlaps != overlaps_before;
  const std::size_t in_overlap = any_overlap ? contested(pieces) : 0;
  tally.contested += in_overlap;
  tally.inversions += ascending - in_overlap;
  if (ascending != in_overlap) addWorst(x, y, pieces, any_overlap, tally);
}

}  // namespace spillikin::sort
