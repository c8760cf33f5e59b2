#include "spillikin/composite/gl_frame.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace spillikin::composite {

namespace {

constexpr float no_eye_plane = -3.0e38F;
constexpr std::size_t grain = 8192;  // vertices per task

// The power of two next to `length`; 1 for a mesh of no extent.
double powerOfTwo(double length) {
  return length > 0.0 && std::isfinite(length) ? std::exp2(std::ilogb(length)) : 1.0;
}

}  // namespace

Bounds bounds(const mesh::Mesh& mesh) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const Bounds box = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.points.size(), grain), Bounds{Vec3(inf), Vec3(-inf)},
      [&](const tbb::blocked_range<std::size_t>& range, Bounds part) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          part.lower = glm::min(part.lower, mesh.points[i]);
          part.upper = glm::max(part.upper, mesh.points[i]);
        }
        return part;
      },
      [](const Bounds& a, const Bounds& b) {
        return Bounds{glm::min(a.lower, b.lower), glm::max(a.upper, b.upper)};
      });
  return mesh.points.empty() ? Bounds{} : box;
}

FrameMap::FrameMap(const project::Camera& camera, const Bounds& bounds) : camera_(camera) {
  const Vec3 center = 0.5 * bounds.lower + 0.5 * bounds.upper;
  unit_ = powerOfTwo(glm::length(0.5 * bounds.upper - 0.5 * bounds.lower));
  center_x_ = 0.5 * camera.width();
  center_y_ = 0.5 * camera.height();
  reference_ = camera.toScreen(center).z;
  if (camera.parallel()) {
    weight_ = {1.0F, 0.0F};
    eye_depth_ = no_eye_plane;
  } else {
    const auto reference = static_cast<float>(reference_ / unit_);
    reference_ = static_cast<double>(reference) * unit_;
    weight_ = {reference, 1.0F};
    eye_depth_ = -reference;
    squared_slope_ = static_cast<float>(glm::dot(camera.directionDx(), camera.directionDx()));
  }
}

ScreenVertex FrameMap::vertex(const Vec3& world, float scalar) const {
  const Vec3 screen = camera_.toScreen(world);
  const double weight = camera_.parallel() ? 1.0 : screen.z;
  const double scale = camera_.parallel() ? 1.0 : 1.0 / unit_;
  return {static_cast<float>((screen.x - center_x_ * weight) * scale),
          static_cast<float>((screen.y - center_y_ * weight) * scale),
          static_cast<float>((screen.z - reference_) / unit_), scalar};
}

ScreenPlane FrameMap::plane(const sort::HalfSpace& keep) const {
  const double size = glm::length(keep.normal);
  const Vec3 n = keep.normal / size;
  const Vec3 direction = camera_.direction(center_x_, center_y_);
  const Vec3 start = camera_.origin(center_x_, center_y_) + reference_ * direction;
  const auto f = [&](double v) { return static_cast<float>(v / unit_); };
  const auto g = [&](double v) { return static_cast<float>(v); };
  return {
      {f(glm::dot(n, start) + keep.offset / size),
       f(glm::dot(n, camera_.originDx() + reference_ * camera_.directionDx())),
       f(glm::dot(n, camera_.originDy() + reference_ * camera_.directionDy())), 0.0F},
      {g(glm::dot(n, direction)), g(glm::dot(n, camera_.directionDx())), g(glm::dot(n, camera_.directionDy())), 0.0F}};
}

void projectVertices(const mesh::Mesh& mesh, const FrameMap& map, const std::vector<float>& scalar,
                     std::vector<ScreenVertex>& out) {
  out.resize(mesh.points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.size(), grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        out[i] = map.vertex(mesh.points[i], scalar.empty() ? 0.0F : scalar[i]);
                      }
                    });
}

}  // namespace spillikin::composite
