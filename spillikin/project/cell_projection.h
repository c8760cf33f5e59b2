// Cells and a view to screen polygons: chooses for each cell how it is projected.
#pragma once

#include <span>
#include <vector>

#include "spillikin/project/cell_on_screen.h"
#include "spillikin/project/polyhedron_projection.h"
#include "spillikin/project/regions.h"
#include "spillikin/project/trimmed_projection.h"

namespace spillikin::project {

// Camera::toScreen of every vertex of the mesh. On all cores; allocates only when `out` grows.
void screenPoints(const mesh::Mesh& mesh, const Camera& camera, std::vector<Vec3>& out);

// Projects the cells of a mesh for one view, one at a time; one projector per thread. A tetrahedron goes the fast way
// of its classes, other cells through the planar subdivision, and what the eye plane, a clip plane or a half-space
// trims, or is not convex, by pairs of triangles.
class CellProjector {
 public:
  // All must outlive the projector. `screen`: from screenPoints for this mesh and camera.
  CellProjector(const mesh::Mesh& mesh, const Camera& camera, std::span<const Vec3> screen,
                Faces faces = Faces::triangles);

  // Appends the regions of a cell; none where it lies outside the image, behind the eye or outside a clip plane.
  // `keep`: half-spaces that this piece of the cell is limited to. Allocates nothing once its storage has met the
  // largest cell.
  void operator()(mesh::Id cell, const mesh::Field& field, Regions& out, std::span<const sort::HalfSpace> keep = {});

 private:
  enum class Trim : std::uint8_t { none, some, all };
  Trim trimmedBy(const sort::HalfSpace& plane) const;
  bool outsideImage() const;

  const mesh::Mesh& mesh_;
  const Camera& camera_;
  std::span<const Vec3> screen_;
  Faces faces_;
  std::size_t clip_count_ = 0;
  std::vector<sort::HalfSpace> planes_;  // the view's clip planes, then those of the piece
  CellOnScreen cell_;
  PolyhedronProjection polyhedron_;
  TrimmedProjection trimmed_;
};

}  // namespace spillikin::project
