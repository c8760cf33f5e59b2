// MPVO with edges across empty space.
#pragma once

#include <array>
#include <string>

#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/gap_turns.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/problem_faces.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Silva, Mitchell and Williams 1998; Max, Williams, Silva 2000, section III: cells are ordered by their faces and,
// where a ray leaves the mesh through one exterior triangle and enters it again through another, by these two. Most
// such pairs are in the right order once the cells have turns by depth, as in MPVONC; only those that are not are
// found, by exact tests, and put right (gap_turns.h). In a cycle all edges are found (gap_edges.h) and cells of it are
// cut.
//
// Exact for every mesh whose cells do not overlap; faces need not match. Cost of a view: that of MPVONC and of proving
// its order; where there are cycles, that of finding the edges, O(b log b + k) for k pairs of b exterior triangles.
class Xmpvo final : public Sorter {
 public:
  explicit Xmpvo(const mesh::Mesh& mesh, CurvedCells curved = CurvedCells::cut);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::xmpvo; }
  std::string why() const override;
  bool exact() const override { return overlapping_[0] == mesh::none; }
  std::size_t bytes() const override;

  const GapTurns& turns() const { return turns_; }
  std::size_t addedEdges() const { return extra_.successor.size(); }  // in the last view that needed them

 private:
  const mesh::Mesh& mesh_;
  FaceSigns signs_;
  LayeredSort layered_;
  ProblemCells problems_;
  GapEdges gaps_;
  GapTurns turns_;
  TurnSort by_turn_;
  ExtraEdges extra_;
  std::array<mesh::Id, 2> overlapping_;  // two cells, or none
};

}  // namespace spillikin::sort
