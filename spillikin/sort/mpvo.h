// The meshed polyhedra visibility ordering: a topological sort by face signs.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "spillikin/sort/convexity.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/problem_faces.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Williams 1992; Max, Williams, Silva 2000, section III. Exact for convex meshes: every ray then runs from cell to cell
// through shared faces, and each of these orders its two cells by the exact side of the viewpoint. Cost of a view:
// linear in cells and faces. Kept: 16 bytes a triangle, 24 bytes a tetrahedron.
class Mpvo final : public Sorter {
 public:
  Mpvo(const mesh::Mesh& mesh, Convexity convexity, CurvedCells curved = CurvedCells::cut);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::mpvo; }
  std::string why() const override;
  bool exact() const override { return convexity_.convex; }
  std::size_t bytes() const override { return signs_.bytes() + layered_.bytes() + problems_.bytes() + parted_.bytes(); }
  bool whileSerial(std::function<void()> start) override {
    layered_.whileSerial(std::move(start));
    return true;
  }

 private:
  const mesh::Mesh& mesh_;
  Convexity convexity_;
  FaceSigns signs_;
  LayeredSort layered_;
  ProblemCells problems_;
  PartedCells parted_;
};

}  // namespace spillikin::sort
