// Which cells a ray may meet: an Embree scene of conservative boxes, one user primitive per cell.
#pragma once

#include <cstdint>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/reference/rays.h"

namespace spillikin::reference {

// Embree computes in float, so the mesh is moved and scaled into the unit ball (in double), every box is rounded
// outward, and a margin covers what float does to the ray: see box_margin in the source. A ray's origin is first moved
// along it to where it enters the ball, so that a distant eye costs no accuracy: eyes up to 1e9 mesh sizes away.
class Candidates {
 public:
  // Cells with hidden[cell] != 0 are left out; `hidden` may be empty. Throws Error when Embree cannot build.
  Candidates(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& hidden);
  ~Candidates();
  Candidates(const Candidates&) = delete;
  Candidates& operator=(const Candidates&) = delete;

  // All cells whose box the ray meets, in any order, each once; with `from_origin`, cells wholly behind the origin may
  // be missing. `cells` is overwritten. Throws Error for an origin too far away. Safe from several threads at once.
  void gather(const Ray& ray, bool from_origin, std::vector<mesh::Id>& cells) const;

  double radius() const { return radius_; }        // of a ball around the mesh, world units
  double magnitude() const { return magnitude_; }  // largest absolute coordinate

 private:
  struct Scene;
  Scene* scene_ = nullptr;
  Vec3 centre_{0.0};
  double radius_ = 0.0, magnitude_ = 0.0;
};

}  // namespace spillikin::reference
