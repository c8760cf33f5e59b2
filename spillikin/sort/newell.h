// The list algorithm of Newell, Newell and Sancha, for cells.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "spillikin/sort/sort.h"
#include "spillikin/sort/xmpvo.h"

namespace spillikin::sort {

// Newell, Newell, Sancha 1972; Stein et al. 1994; Williams et al. 1998; Max, Williams, Silva 2000, section III. Cells
// are listed by their farthest vertex. The farthest is tested against those that follow, up to the first that lies
// nearer than all of it, and listed if it hides none; one that it hides is moved before it and marked, and the part of
// the list that the move has disturbed is remembered. The tests, from cheap to dear: depth (1), windows and bounding
// boxes on the image plane (2, 3), cones and spheres (1', 2'), planes of faces (4, 5), and the definitive one: a
// triangle of the first turned away and one of the second turned towards the viewpoint whose projections overlap,
// exactly.
//
// The list needs no adjacency and is exact for cells that do not overlap; whether exterior triangles cross is decided
// once. A cell about to be moved a second time is in a cycle:
// the rest of the list is then XMPVO's. Cost: O(n log n) and the pairs of cells that share a window and are not told
// apart by depth, up to n^2; serial. For small meshes and for comparison.
class Newell final : public Sorter {
 public:
  explicit Newell(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::newell; }
  std::string why() const override;
  bool exact() const override { return xmpvo_.exact(); }
  std::size_t bytes() const override;

 private:
  struct Extent {
    double nearest = 0.0, farthest = 0.0;          // from the viewpoint, or along the line of sight
    std::array<double, 2> lower{}, upper{};        // on the image plane; everything where a cell is not in front of it
    std::array<std::uint32_t, 2> first{}, last{};  // windows
  };
  struct Half {
    Triangle corner;
    int sign;  // of the viewpoint, outward
  };

  void measure(const Viewpoint& viewpoint);
  void windows();
  bool isConvex(mesh::Id cell);
  bool hides(mesh::Id a, mesh::Id b, const Viewpoint& viewpoint);
  void halves(mesh::Id cell, const Viewpoint& viewpoint, std::vector<Half>& out);
  bool mayHide(mesh::Id a, mesh::Id b, const Viewpoint& viewpoint) const;
  mesh::Id firstHidden(mesh::Id a, const Viewpoint& viewpoint);
  void finish(const Viewpoint& viewpoint, Order& order);

  const mesh::Mesh& mesh_;
  std::vector<Vec3> centre_;  // of the bounding spheres
  std::vector<double> radius_;
  std::vector<std::uint8_t> convex_;
  std::vector<Extent> extent_;
  std::uint32_t side_ = 1;                     // windows along each side of the image
  std::vector<std::vector<mesh::Id>> window_;  // cells by farthest vertex, farthest first
  std::vector<std::size_t> window_head_;       // before it all are listed
  std::vector<mesh::Id> list_;
  std::vector<std::uint8_t> moved_, listed_;
  mesh::Surface surface_;
  std::vector<Half> halves_a_, halves_b_;
  Xmpvo xmpvo_;  // also knows whether exterior triangles cross
  Order rest_;
};

}  // namespace spillikin::sort
