// Tetrahedra by the power distance of the viewpoint to their circumspheres.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spillikin/sort/convexity.h"
#include "spillikin/sort/key_sort.h"
#include "spillikin/sort/lifted_distance.h"
#include "spillikin/sort/regularity.h"
#include "spillikin/sort/repair.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Decreasing power distance |V - c|^2 - r^2 (Edelsbrunner 1989; Max, Williams, Silva 2000, section III). Exact on a
// convex mesh whose interior faces are all regular (regularity.h), be it with weights that are looked for (weights.h):
// then the exact distances ascend across every interior face towards the viewpoint. Distances are rounded to keys with
// a bound (lifted_distance.h); neighbours whose keys are nearer than that, or whose spheres are the same, are decided
// by the exact side of their face and put right where keys have them wrong (repair.h). Elsewhere a preview.
//
// Cost of a view: O(n), two passes over short keys and one over the faces. Kept: 24 bytes a tetrahedron. Needs
// tetrahedra: throws Error for any other mesh.
class PowerSort final : public Sorter {
 public:
  explicit PowerSort(const mesh::Mesh& mesh);
  // `heights` as for regularity(), which found `regularity` with them.
  PowerSort(const mesh::Mesh& mesh, const Convexity& convexity, const Regularity& regularity,
            const std::vector<double>& heights = {});
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::power; }
  std::string why() const override;
  bool exact() const override { return exact_; }
  std::size_t bytes() const override;

  std::size_t suspectFaces() const;                                 // of the last view, decided by the exact predicate
  std::size_t repairedCells() const { return repair_.repaired(); }  // of the last view

 private:
  struct Prepared;
  PowerSort(const mesh::Mesh& mesh, const Prepared& prepared);
  static Prepared prepare(const mesh::Mesh& mesh);
  void findSuspects(std::uint32_t certain);

  const mesh::Mesh& mesh_;
  std::string why_;
  bool exact_ = false;
  LiftedDistance distance_;
  std::vector<std::uint32_t> keys_;  // from `lead` on, by cell
  KeySort sort_;
  Repair repair_;
  std::vector<std::vector<mesh::Id>> suspects_;  // by part of the faces
};

}  // namespace spillikin::sort
