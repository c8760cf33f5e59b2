// Tetrahedra by the power distance of the viewpoint to their circumspheres.
#pragma once

#include <string>
#include <vector>

#include "spillikin/sort/radix_sort.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Decreasing |V - c|^2 - r^2 (Edelsbrunner 1989; Max, Williams, Silva 2000, section III): a visibility order of a
// Delaunay tetrahedralization, a preview elsewhere. Up to a term that is the same for all cells the distance is linear
// in V, so that a cell is four doubles. Cells are sorted by a key (Ladder) that keeps the order of the distances, and
// those that then tie by the distance itself. Needs tetrahedra: throws Error for any other mesh.
class PowerSort final : public Sorter {
 public:
  explicit PowerSort(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::power; }
  std::string why() const override;
  bool exact() const override { return false; }
  std::size_t bytes() const override;

 private:
  Vec3 origin_{0.0};
  std::vector<Vec4> form_;  // -2 c and |c|^2 - r^2, relative to the origin
  RadixSort radix_;
};

}  // namespace spillikin::sort
