// What sorters of nonconvex meshes share: turns by a first guess, proven across empty space, and cycles that are cut.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <utility>

#include "spillikin/sort/cycles.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/gap_turns.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/problem_faces.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// A view is begin(), a guess given to turns_ (gap_turns.h), and finish(); sorters differ in the guess. Exact for every
// mesh whose cells do not overlap; whether exterior triangles cross is decided once.
class GapSorter : public Sorter {
 public:
  bool exact() const override { return overlapping_[0] == mesh::none; }
  std::size_t bytes() const override;
  bool whileSerial(std::function<void()> start) override {
    layered_.whileSerial(std::move(start));
    return true;
  }

  const GapTurns& turns() const { return turns_; }
  std::size_t addedEdges() const { return extra_.successor.size(); }  // in the last view that needed them

 protected:
  GapSorter(const mesh::Mesh& mesh, CurvedCells curved);

  void begin(const Viewpoint& viewpoint, Order& order);   // the signs of all faces
  void finish(const Viewpoint& viewpoint, Order& order);  // the queue, the proof, the sort by turns; or all edges

 private:
  bool settle(const Viewpoint& viewpoint, Order& order);
  bool completeCycles(const Viewpoint& viewpoint);
  void learn(const CellPairs& pairs);

 protected:
  const std::unique_ptr<mesh::Mesh> matched_;  // where diagonals are crossed: they are faces like others here
  const mesh::Mesh& mesh_;                     // that, or the one given
  FaceSigns signs_;
  LayeredSort layered_;
  ProblemCells problems_;
  PartedCells parted_;
  GapEdges gaps_;
  GapTurns turns_;
  TurnSort by_turn_;
  Ties ties_;  // cycles of faces, in the last view
  // Edges across gaps that the last view needed: those that turns could not put right, and all inside cycles; or all.
  ExtraEdges extra_;
  CellPairs pairs_;                      // the same, ascending
  std::vector<mesh::Id> group_;          // of the cells in cycles
  std::array<mesh::Id, 2> overlapping_;  // two cells, or none
};

}  // namespace spillikin::sort
