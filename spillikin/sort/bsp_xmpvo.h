// MPVO merged with the traversal of a BSP tree of the exterior.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/sort/bsp_tree.h"
#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/xmpvo.h"

namespace spillikin::sort {

// Comba et al. 1999; Max, Williams, Silva 2000, section III. The tree lists the fragments of exterior triangles from
// far to near. A cell waits for its neighbours, as in MPVO, and until every fragment turned away from the viewpoint has
// come by: all that lies behind it across empty space has then come by as well. Cells of which a fragment turned
// towards the viewpoint has come by, but which still wait for neighbours, are partially projected (Comba's term): a
// cell about to be listed is tested against each of them, exactly, and waits for those that it hides.
//
// Exact for every mesh whose cells do not overlap. Cost of a view: O(n + b p) for b boundary cells and p partially
// projected ones; serial. In a cycle the rest of the order is XMPVO's.
class BspXmpvo final : public Sorter {
 public:
  explicit BspXmpvo(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::bsp_xmpvo; }
  std::string why() const override;
  bool exact() const override { return true; }
  std::size_t bytes() const override;

  const BspTree& tree() const { return tree_; }
  std::size_t partiallyProjected() const { return most_partial_; }  // at most at a time, in the last view

 private:
  void count();
  void abutting(const Viewpoint& viewpoint);
  bool hides(mesh::Id front, mesh::Id behind, const Viewpoint& viewpoint) const;
  void drain(const Viewpoint& viewpoint, Order& order);
  void freed(mesh::Id cell);
  void finish(const Viewpoint& viewpoint, Order& order);

  const mesh::Mesh& mesh_;
  FaceSigns signs_;
  GapEdges gaps_;
  BspTree tree_;
  std::vector<std::uint32_t> waits_;  // per cell: neighbours, fragments and cells across gaps that must come first
  std::vector<std::uint8_t> listed_, partial_mark_;
  std::vector<mesh::Id> queue_, partial_;
  std::vector<std::pair<mesh::Id, mesh::Id>> held_;  // (partially projected cell, cell that waits for it)
  std::vector<mesh::Id> neighbour_;
  std::size_t most_partial_ = 0;
  std::unique_ptr<Xmpvo> xmpvo_;  // made when a cycle is first met
  Order rest_;
};

}  // namespace spillikin::sort
