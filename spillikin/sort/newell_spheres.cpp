#include "spillikin/sort/newell_spheres.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace spillikin::sort {
namespace {

using Range = tbb::blocked_range<std::size_t>;

constexpr std::size_t grain = 4096;  // cells

// Room for rounding, as a share of distances and as an angle: far more than theirs, far less than cells.
constexpr double room = 1e-10;

}  // namespace

NewellSpheres::NewellSpheres(const mesh::Mesh& mesh) : spheres_(mesh.cell_count()), seen_(mesh.cell_count()) {
  tbb::parallel_for(Range(0, spheres_.size(), grain), [&](const Range& range) {
    for (std::size_t c = range.begin(); c != range.end(); ++c) {
      const auto vertices = mesh.vertices(static_cast<mesh::Id>(c));
      Sphere& sphere = spheres_[c];
      sphere.centre = Vec3(0.0);
      for (const mesh::Id v : vertices)
        sphere.centre += mesh.points[v] / static_cast<double>(vertices.size());
      for (const mesh::Id v : vertices)
        sphere.radius = std::max(sphere.radius, glm::length(mesh.points[v] - sphere.centre));
    }
  });
}

void NewellSpheres::begin(const Viewpoint& viewpoint) {
  parallel_ = viewpoint.w == 0.0;
  const Vec3 from(viewpoint);
  const Vec3 away = parallel_ ? -from / glm::length(from) : from;
  tbb::parallel_for(Range(0, spheres_.size(), grain), [&](const Range& range) {
    for (std::size_t c = range.begin(); c != range.end(); ++c) {
      const auto& [centre, radius] = spheres_[c];
      Seen& seen = seen_[c];
      if (parallel_) {
        seen.depth = glm::dot(centre, away);
        seen.axis = centre - seen.depth * away;
        continue;
      }
      const Vec3 to = centre - from;
      seen.depth = glm::length(to);
      const bool outside = seen.depth > radius;
      seen.axis = outside ? to / seen.depth : Vec3(0.0);
      seen.sine = outside ? radius / seen.depth : 1.0;
      seen.cosine = std::sqrt(std::max(0.0, 1.0 - seen.sine * seen.sine));
    }
  });
}

bool NewellSpheres::apart(mesh::Id a, mesh::Id b) const {
  const Seen &p = seen_[a], &q = seen_[b];
  const double both = spheres_[a].radius + spheres_[b].radius;
  const double behind = p.depth - q.depth, size = std::abs(p.depth) + std::abs(q.depth) + both;
  if (behind > both + room * size) return true;  // 2'
  // 1'
  if (parallel_) {
    const double across = glm::length(p.axis - q.axis);
    return across > both + room * (size + glm::length(p.axis) + glm::length(q.axis));
  }
  const double cosine = p.cosine * q.cosine - p.sine * q.sine;
  if (cosine <= 0.0) return false;
  const double between = glm::dot(p.axis, q.axis);
  if (between <= 0.0) return true;
  return glm::length(glm::cross(p.axis, q.axis)) > p.sine * q.cosine + p.cosine * q.sine + room;
}

}  // namespace spillikin::sort
