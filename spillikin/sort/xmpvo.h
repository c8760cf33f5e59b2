// MPVO with edges across empty space.
#pragma once

#include <string>

#include "spillikin/sort/gap_sorter.h"

namespace spillikin::sort {

// Silva, Mitchell and Williams 1998; Max, Williams, Silva 2000, section III: cells are ordered by their faces and,
// where a ray leaves the mesh through one exterior triangle and enters it again through another, by these two. Most
// such pairs are in the right order once the cells have turns by depth, as in MPVONC; only those that are not are
// found, by exact tests, and put right (gap_turns.h). In a cycle they become edges (gap_sorter.h) and cells of it are
// cut.
//
// Exact for every mesh whose cells do not overlap; faces need not match. Cost of a view: that of MPVONC and of proving
// its order; where there are cycles, that of finding the edges, O(b log b + k) for k pairs of b exterior triangles.
class Xmpvo final : public GapSorter {
 public:
  explicit Xmpvo(const mesh::Mesh& mesh, CurvedCells curved = CurvedCells::cut);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::xmpvo; }
  std::string why() const override;
};

}  // namespace spillikin::sort
