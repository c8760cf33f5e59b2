// MPVO for nonconvex meshes by a sort of the boundary.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Williams 1992; Max, Williams, Silva 2000, section III: the f cells with an exterior face turned towards the viewpoint
// are sorted by the distance of their means, farthest first, and each is listed after all that lies behind it through
// shared faces (a depth-first search). Approximate: across empty space the depth of a mean decides. Cost of a view:
// O(n + f log f), serial.
class Mpvonc final : public Sorter {
 public:
  explicit Mpvonc(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::mpvonc; }
  std::string why() const override { return "across empty space the depth of a cell's mean decides, which may err"; }
  bool exact() const override { return false; }
  std::size_t bytes() const override;

 private:
  void sortBoundary(const Viewpoint& viewpoint);
  bool listFrom(mesh::Id cell, Order& order);

  const mesh::Mesh& mesh_;
  FaceSigns signs_;
  std::vector<mesh::Id> neighbour_;  // beside mesh.cell_face
  std::vector<mesh::Id> boundary_;   // cells with exterior faces
  std::vector<std::pair<double, mesh::Id>> front_;
  std::vector<std::uint8_t> state_;                        // 0 untouched, 1 on the stack, 2 listed
  std::vector<std::pair<mesh::Id, std::uint32_t>> stack_;  // cell, the next of its faces to look through
};

}  // namespace spillikin::sort
