// MPVO with edges across empty space.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "spillikin/sort/exterior_tree.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Silva, Mitchell and Williams 1998; Max, Williams, Silva 2000, section III. A ray that leaves the mesh through an
// exterior face of one cell and enters it again through one of another orders the two: for every viewpoint an edge is
// added for each pair of exterior triangles, the first turned away from the viewpoint and the second towards it, whose
// projections overlap and of which the first is nearer. Candidates come from a tree of boxes, searched with the shadow
// of each triangle; exact predicates decide. Exact for every mesh whose cells do not overlap; faces need not match.
//
// Cost of a view: that of MPVO and O(b log b + k), b exterior triangles, k pairs that lie behind one another.
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
  void findEdges(const Viewpoint& viewpoint);

  const mesh::Mesh& mesh_;
  FaceSigns signs_;
  LayeredSort layered_;
  ExteriorTree tree_;
  std::vector<std::size_t> row_;                                   // of FaceSigns, for each triangle of the tree
  std::vector<std::int8_t> sign_;                                  // of the viewpoint, for each triangle of the tree
  std::vector<std::vector<std::pair<mesh::Id, mesh::Id>>> found_;  // by fixed block of triangles: (behind, front) cells
  ExtraEdges extra_;
};

}  // namespace spillikin::sort
