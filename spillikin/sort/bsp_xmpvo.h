// MPVO merged with the traversal of a BSP tree of the exterior.
#pragma once

#include <string>

#include "spillikin/sort/bsp_tree.h"
#include "spillikin/sort/gap_sorter.h"

namespace spillikin::sort {

// Comba et al. 1999; Max, Williams, Silva 2000, section III. The tree lists the fragments of exterior triangles from
// far to near. A cell waits for its neighbours, as in MPVO, and until every fragment of it turned away from the
// viewpoint has come by: all that lies behind it across empty space has then come by as well. Here the queue of MPVO
// runs once, on all cores, and the place of a fragment in the tree's list is the turn (turns.h) of its cell. Cells of
// which a fragment turned towards the viewpoint comes by before the cell itself can be listed are partially projected
// (Comba's term): these are the entries that gap_turns.h searches, and the exits before them are put off.
//
// The tree decides within slabs of depth; depth decides between them. The tree's list alone is as right, but wherever a
// splitting plane goes through the mesh it holds back cells on one side for faces of the other that hide nothing of
// them, and thousands would be partially projected.
//
// Exact for every mesh whose cells do not overlap. Cost of a view: that of MPVO, of the tree, linear in its nodes, of a
// counting sort, and of the searches. In a cycle edges across gaps are found and cells of it are cut.
class BspXmpvo final : public GapSorter {
 public:
  explicit BspXmpvo(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::bsp_xmpvo; }
  std::string why() const override;
  std::size_t bytes() const override { return GapSorter::bytes() + tree_.bytes(); }

  const BspTree& tree() const { return tree_; }

 private:
  BspTree tree_;
};

}  // namespace spillikin::sort
