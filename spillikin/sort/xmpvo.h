// MPVO with edges across empty space.
#pragma once

#include <string>

#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Silva, Mitchell and Williams 1998; Max, Williams, Silva 2000, section III: for every viewpoint an edge is added for
// each pair of exterior triangles of which the first is turned away from the viewpoint, the second towards it, whose
// projections overlap and of which the first is nearer (gap_edges.h). Exact for every mesh whose cells do not overlap;
// faces need not match. Cost of a view: that of MPVO and of finding the edges.
class Xmpvo final : public Sorter {
 public:
  explicit Xmpvo(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::xmpvo; }
  std::string why() const override;
  bool exact() const override { return true; }
  std::size_t bytes() const override;

  std::size_t addedEdges() const { return extra_.successor.size(); }  // in the last view

 private:
  const mesh::Mesh& mesh_;
  FaceSigns signs_;
  LayeredSort layered_;
  GapEdges gaps_;
  ExtraEdges extra_;
};

}  // namespace spillikin::sort
