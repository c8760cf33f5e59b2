// One cell as a view sees it: its boundary triangles, their corners on the screen, and what a ray meets on a triangle.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/planar_predicates.h"
#include "spillikin/project/camera.h"

namespace spillikin::project {

using mesh::Vec2;

// Where a ray meets a triangle.
struct Sample {
  double depth = 0.0;
  double value = 0.0;
};

// Reused from cell to cell, it stops allocating.
class CellOnScreen {
 public:
  using Local = std::uint32_t;  // index of a vertex in the cell

  // The corners alone. `screen`: for each vertex of the mesh, Camera::toScreen.
  void setCorners(const mesh::Mesh& mesh, const Camera& camera, std::span<const Vec3> screen, const mesh::Field& field,
                  mesh::Id cell);
  // The boundary triangles of the same cell.
  void setTriangles(const mesh::Mesh& mesh);

  mesh::Id cell() const { return cell_; }
  std::size_t size() const { return homogeneous_.size(); }
  bool inFront() const { return in_front_; }  // no vertex in or behind the eye plane; always so in a parallel view
  bool parallel() const { return parallel_; }

  const Vec3& world(Local v) const { return world_[v]; }
  const Vec3& homogeneous(Local v) const { return homogeneous_[v]; }  // Camera::toScreen
  const Vec2& position(Local v) const { return position_[v]; }        // pixels; only where inFront()
  double value(Local v) const { return value_[v]; }

  // mesh::surface, with vertices as positions in the cell.
  std::span<const std::array<Local, 3>> triangles() const { return triangles_; }
  const mesh::Surface& surface() const { return surface_; }

  // The three below need inFront(); t runs from 0 at a to 1 at b on the screen; weights are those of b and c on the
  // screen.
  Sample atCorner(Local v) const { return {homogeneous_[v].z, value_[v]}; }
  Sample onEdge(Local a, Local b, double t) const;
  Sample inTriangle(const std::array<Local, 3>& corner, double weight_b, double weight_c) const;
  // At an image position, which is first moved into the triangle where rounding has left it outside. Along the longest
  // edge the position is met to within rounding however thin the triangle is seen.
  // `off`: by how many pixels it was moved.
  Sample at(const std::array<Local, 3>& corner, const Vec2& position, double* off = nullptr) const;
  // Whether all three barycentric coordinates of an image position are larger than `least`.
  bool isInside(const std::array<Local, 3>& corner, const Vec2& position, double least) const;

 private:
  mesh::Id cell_ = mesh::none;
  bool in_front_ = true, parallel_ = false;
  std::vector<Vec3> world_, homogeneous_;
  std::vector<Vec2> position_;
  std::vector<double> value_;
  mesh::Surface surface_;
  std::vector<std::array<Local, 3>> triangles_;
};

}  // namespace spillikin::project
