#include "spillikin/project/cell_projection.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "spillikin/project/tetrahedron_projection.h"

namespace spillikin::project {

void screenPoints(const mesh::Mesh& mesh, const Camera& camera, std::vector<Vec3>& out) {
  out.resize(mesh.points.size());
  constexpr std::size_t grain = 8192;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.size(), grain), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      out[i] = camera.toScreen(mesh.points[i]);
    }
  });
}

CellProjector::CellProjector(const mesh::Mesh& mesh, const Camera& camera, std::span<const Vec3> screen, Faces faces)
    : mesh_(mesh), camera_(camera), screen_(screen), faces_(faces), clip_count_(camera.view().clips.size()) {
  for (const ClipPlane& clip : camera.view().clips) {
    planes_.push_back({clip.normal, -glm::dot(clip.normal, clip.point)});
  }
}

// Whether the plane leaves the whole cell, cuts it, or leaves nothing.
CellProjector::Trim CellProjector::trimmedBy(const sort::HalfSpace& plane) const {
  bool outside = false;
  bool inside = false;
  for (CellOnScreen::Local v = 0; v < cell_.size(); ++v) {
    const double height = glm::dot(plane.normal, cell_.world(v)) + plane.offset;
    outside = outside || height < 0.0;
    inside = inside || height > 0.0;
  }
  return !inside ? Trim::all : outside ? Trim::some : Trim::none;
}

bool CellProjector::outsideImage() const {
  Vec2 low = cell_.position(0);
  Vec2 high = low;
  for (CellOnScreen::Local v = 1; v < cell_.size(); ++v) {
    low = glm::min(low, cell_.position(v));
    high = glm::max(high, cell_.position(v));
  }
  return high.x < 0.0 || high.y < 0.0 || low.x > camera_.width() || low.y > camera_.height();
}

void CellProjector::operator()(mesh::Id cell, const mesh::Field& field, Regions& out,
                               std::span<const sort::HalfSpace> keep) {
  const bool tetrahedron = mesh_.cell_type[cell] == mesh::CellType::tetrahedron;
  cell_.setCorners(mesh_, camera_, screen_, field, cell);
  planes_.resize(clip_count_);
  planes_.insert(planes_.end(), keep.begin(), keep.end());
  bool trimmed = !cell_.inFront();
  for (const sort::HalfSpace& plane : planes_) {
    const Trim trim = trimmedBy(plane);
    if (trim == Trim::all) {
      return;
    }
    trimmed = trimmed || trim == Trim::some;
  }
  if (!trimmed && outsideImage()) {
    return;
  }
  if (!trimmed && tetrahedron) {
    projectTetrahedron(cell_, camera_, out);
    return;
  }
  cell_.setTriangles(mesh_);
  if (trimmed || !polyhedron_(cell_, camera_, faces_, out)) {
    trimmed_(cell_, camera_, planes_, out);
  }
}

}  // namespace spillikin::project
