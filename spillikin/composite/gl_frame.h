// A view as the numbers that the shaders compute with: float, relative to the eye, to a depth inside the mesh and to
// the image's centre.
#pragma once

#include <array>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/composite/gl_api.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/project/camera.h"
#include "spillikin/sort/sort.h"

namespace spillikin::composite {

// A vertex as the shaders see it. x and y are the image position from the image's centre times the homogeneous weight
// h: depth from the eye in perspective, 1 in a parallel view. depth is from FrameMap::reference. In FrameMap::unit.
struct ScreenVertex {
  float x = 0.0F, y = 0.0F, depth = 0.0F, scalar = 0.0F;
};

// f + depth * g >= 0 is kept, with f and g linear in the image position.
struct ScreenPlane {
  std::array<float, 4> f{}, g{};
};

// A box around a mesh.
struct Bounds {
  Vec3 lower{0.0}, upper{0.0};
};
Bounds bounds(const mesh::Mesh& mesh);

// Lengths are divided by `unit` (a power of two near the mesh's size), so that float neither overflows nor loses the
// smallest numbers whatever the world's unit; depths count from `reference`, inside the mesh, so that a distant eye
// costs no accuracy.
class FrameMap {
 public:
  FrameMap(const project::Camera& camera, const Bounds& bounds);

  ScreenVertex vertex(const Vec3& world, float scalar) const;
  ScreenPlane plane(const sort::HalfSpace& keep) const;
  // Homogeneous weight of a vertex: depth from the eye in perspective, 1 in a parallel view.
  float weight(float depth) const { return weight_[0] + weight_[1] * depth; }

  double unit() const { return unit_; }
  double center_x() const { return center_x_; }
  double center_y() const { return center_y_; }
  const std::array<float, 2>& weightTerms() const { return weight_; }
  float eyeDepth() const { return eye_depth_; }
  float squaredSlope() const { return squared_slope_; }

 private:
  const project::Camera& camera_;
  double unit_ = 1.0, reference_ = 0.0;
  double center_x_ = 0.0, center_y_ = 0.0;
  std::array<float, 2> weight_{1.0F, 0.0F};
  float eye_depth_ = 0.0F;
  float squared_slope_ = 0.0F;
};

// All vertices of a mesh, in parallel; `out` is as long as the mesh's points and keeps its scalars.
void projectVertices(const mesh::Mesh& mesh, const FrameMap& map, const std::vector<float>& scalar,
                     std::vector<ScreenVertex>& out);

}  // namespace spillikin::composite
