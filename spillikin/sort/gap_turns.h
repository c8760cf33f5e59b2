// Turns that are right across empty space: those that a first guess gave are proven or put off.
#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "spillikin/sort/cycles.h"
#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/turns.h"

namespace spillikin::sort {

// Instead of finding every pair of cells that lie behind one another across empty space, as GapEdges does, a guess is
// proven. It gives every exit (an exterior triangle turned away from the viewpoint) and every entry (turned towards it)
// a turn, such that an exit that lies before an entry on some ray has no earlier turn. A cell takes the turn of its
// exits and of all cells behind it (LayeredSort). Then:
//
// 1. An entry whose cell has an earlier turn than the entry itself comes before every exit in front of it: nothing is
//    to be done. These are nearly all.
// 2. For any other, exits that may be in front of it are searched for by their windows, but only those whose cells do
//    not come later than its own. What the exact test confirms is put off to a later turn, with all cells before it,
//    and the entries of the cells that were put off are looked at again.
//
// The parts of a cell (PartedCells) each have a turn. As an exit the cell has that of what comes first of it, as an
// entry the latest of them.
//
// When nothing is left to look at, the order by turns, and within one turn by faces, is right. In a cycle turns would
// grow for ever: after `most_rounds` it gives up, and what it found becomes edges (GapSorter).
//
// Cost of a view: linear in the exterior triangles, and the searches, on all cores; what is put off, serial.
class GapTurns {
 public:
  static constexpr int most_rounds = 16;

  GapTurns(const mesh::Mesh& mesh, GapEdges& gaps, const PartedCells& parted);

  // Reads the signs of the view; first of all. On which side of each exterior triangle the viewpoint is.
  void readSigns();
  int sign(std::uint32_t t) const { return sign_[t]; }

  // The first turn of every cell, whose parts the view knows. `guess(t, sign)` is that of exterior triangle t, whose
  // nonzero sign is given: of an exit at least that of any entry behind it, below ExteriorWindows::never / 2.
  template <class Guess>
  void begin(const Guess& guess) {
    clear();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, guess_.size(), grain),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (auto t = static_cast<std::uint32_t>(range.begin()); t < range.end(); ++t) {
                          const std::int8_t s = sign_[t];
                          if (s == 0) continue;
                          guess_[t] = guess(t, s);
                          if (s < 0) raise(turn_[cell_[t]], guess_[t]);
                        }
                      });
  }
  // For the queue, which passes turns on; then for the sort by turns.
  Turn* data() { return turn_.data(); }
  const std::vector<Turn>& turns() const { return turn_; }

  // The first turns once more.
  void again();

  // After the queue has listed all cells: makes the turns right. `ties`: cycles, whose nodes keep a common turn.
  // `known`: edges across gaps, ascending, that the queue and the ties heeded. False when it gave up; then wrong() has
  // pairs of cells that are not known.
  bool settle(const Viewpoint& viewpoint, const LayeredSort& layered, const Ties& ties, const ExtraEdges& known);
  const CellPairs& wrong() const { return wrong_; }
  // The turns of the pieces of cycles, after those of the nodes.
  void addPieces(const Ties& ties);

  std::size_t searched() const { return searched_; }  // entries, in the last view
  std::size_t putOff() const { return put_off_; }     // pairs that were in the wrong order, in the last view
  std::size_t bytes() const;

 private:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;  // exit, entry: triangles
  static constexpr std::size_t grain = 4096;             // triangles whose turns are worth a task

  void clear();
  Turn lastTurn(mesh::Id cell) const;
  bool open(std::uint32_t entry) const;
  bool knows(std::uint32_t exit, std::uint32_t entry) const;
  void search(std::span<const std::uint32_t> entries, const Viewpoint& viewpoint, std::vector<Pair>& found) const;
  void findOpen();
  void searchOpen(const Viewpoint& viewpoint);
  bool tied(mesh::Id exit, mesh::Id entry, const Ties& ties) const;
  void noteFound();
  bool putOffFound(const LayeredSort& layered, const Ties& ties);
  void addAbutting(const Viewpoint& viewpoint);

  const mesh::Mesh& mesh_;
  GapEdges& gaps_;
  const PartedCells& parted_;
  std::vector<mesh::Id> cell_;     // per exterior triangle
  std::vector<std::int8_t> sign_;  // per exterior triangle
  std::vector<Turn> guess_;        // per exterior triangle that has a sign
  std::vector<Turn> turn_;         // per cell, and per sliver
  std::vector<std::vector<Pair>> found_;
  std::vector<std::uint32_t> open_;    // entries to look at
  std::vector<mesh::Id> raised_;       // cells and slivers put off in a round
  const ExtraEdges* known_ = nullptr;  // while settling
  CellPairs wrong_;                    // found while settling
  std::size_t searched_ = 0, put_off_ = 0;
};

}  // namespace spillikin::sort
