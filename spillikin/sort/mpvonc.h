// MPVO for nonconvex meshes by the depth of the boundary.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/problem_faces.h"
#include "spillikin/sort/sort.h"
#include "spillikin/sort/turns.h"

namespace spillikin::sort {

// Williams 1992; Max, Williams, Silva 2000, section III, turned round so that it runs on all cores: not the cells where
// rays enter the mesh are sorted by depth, each listed after all behind it by a depth-first search, but every cell
// where a ray leaves the mesh waits for the depth of its face (turns.h), and with it all that lies before it. The queue
// of MPVO finds the turns on its way, a counting sort by turn ends it. Faces are ordered as in MPVO; across empty space
// depths alone decide, which may err. Cells of a cycle are listed by the distance of
// their means, uncut.
//
// Cost of a view: linear; the queue mostly on one core, all else on all.
class Mpvonc final : public Sorter {
 public:
  explicit Mpvonc(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::mpvonc; }
  std::string why() const override { return "across empty space the depth of faces decides, which may err"; }
  bool exact() const override { return false; }
  std::size_t bytes() const override;
  bool whileSerial(std::function<void()> start) override {
    layered_.whileSerial(std::move(start));
    return true;
  }

 private:
  void firstTurns(const Viewpoint& viewpoint);
  double nearness(mesh::Id cell, const Viewpoint& viewpoint) const;
  void appendLeft(const Viewpoint& viewpoint, Order& order);

  const mesh::Mesh& mesh_;
  FaceSigns signs_;
  LayeredSort layered_;
  ProblemCells problems_;
  TurnSort by_turn_;
  std::vector<ExteriorTriangle> exterior_;
  std::vector<std::size_t> row_;  // of signs_, for each exterior triangle
  Vec3 lower_{0.0}, upper_{0.0};
  std::vector<Turn> turn_;
};

}  // namespace spillikin::sort
