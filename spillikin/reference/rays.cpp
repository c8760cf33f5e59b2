#include "spillikin/reference/rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "spillikin/base/error.h"

namespace spillikin::reference {
namespace {

bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void check(const View& view) {
  if (view.width < 1 || view.height < 1) {
    throw Error(
        fmt::format("image size {}x{} has no pixels: give a positive width and height", view.width, view.height));
  }
  if (!finite(view.eye) || !finite(view.target) || !finite(view.up) || !std::isfinite(view.parallel_scale)) {
    throw Error("camera is not finite: check eye, target, up and parallel scale");
  }
  if (view.eye == view.target) throw Error("camera looks nowhere: eye and target are the same point");
  if (!view.parallel() && !(view.view_angle > 0.0 && view.view_angle < 180.0)) {
    throw Error(fmt::format("view angle {} is outside (0, 180) degrees", view.view_angle));
  }
  for (const ClipPlane& plane : view.clips) {
    if (!finite(plane.point) || !finite(plane.normal) || plane.normal == Vec3(0.0)) {
      throw Error("clip plane without a finite point and a normal of nonzero length");
    }
  }
}

}  // namespace

Rays::Rays(const View& view) : view_(view) {
  check(view);
  forward_ = glm::normalize(view.target - view.eye);
  const Vec3 right = glm::cross(forward_, view.up);
  // Below this sine of the angle between up and the line of sight, rounding decides where right is.
  constexpr double least_sine = 1e-12;
  if (!(glm::length(right) > least_sine * glm::length(view.up))) {
    throw Error("camera's up direction lies along its line of sight: choose another one");
  }
  right_ = glm::normalize(right);
  top_ = glm::cross(right_, forward_);
  half_height_ = view.parallel() ? view.parallel_scale : std::tan(view.view_angle * (std::numbers::pi / 360.0));
}

Ray Rays::operator()(double x, double y) const {
  const double height = view_.height;
  const double across = half_height_ * (2.0 * (x - view_.width / 2.0) / height);
  const double up = half_height_ * (2.0 * (height / 2.0 - y) / height);
  const Vec3 offset = across * right_ + up * top_;
  if (view_.parallel()) return {view_.eye + offset, forward_, right_, -top_};
  return {view_.eye, forward_ + offset, right_, -top_};
}

Range Rays::drawn(const Ray& ray) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Range range{view_.parallel() ? -infinity : 0.0, infinity};
  for (const ClipPlane& plane : view_.clips) {
    const double height = glm::dot(ray.origin - plane.point, plane.normal);
    const double slope = glm::dot(ray.direction, plane.normal);
    if (slope > 0.0) {
      range.lo = std::max(range.lo, -height / slope);
    } else if (slope < 0.0) {
      range.hi = std::min(range.hi, -height / slope);
    } else if (height < 0.0) {
      return {infinity, -infinity};
    }
  }
  return range;
}

}  // namespace spillikin::reference
