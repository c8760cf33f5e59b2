// What it costs to replace curved cells by flat triangles, cell by cell: the two models of the ground truth on one
// view's rays.
#pragma once

#include <cstddef>
#include <vector>

#include "spillikin/reference/reference.h"

namespace spillikin::reference {

// One cell on the rays through the pixel centres of a view; lengths in world units.
struct FlatFaceCost {
  std::size_t rays = 0;                           // that meet the cell under either model
  double length_face = 0.0, length_curved = 0.0;  // of the rays inside it, summed: flat faces, its true ones
  double worst_length = 0.0;                      // the largest difference of the two on a ray
  double worst_scalar = 0.0;                      // the same of the mean scalar, on rays that meet it under both

  // Lengths differ by this part of the true one; as rays lie evenly, the difference of the volumes.
  double relative() const;
};

// For each of the mesh's `cells`, in its order: model face against model isoparametric. Cells that are bounded by
// planar faces show differences of the field alone, tetrahedra none. The same bits whatever the number of threads.
// Throws what RayCaster::intervals does. Cost: two casts of the view.
std::vector<FlatFaceCost> flatFaceCost(const RayCaster& caster, const View& view, std::size_t cells);

}  // namespace spillikin::reference
