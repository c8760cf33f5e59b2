#include "spillikin/project/camera.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "spillikin/base/error.h"

namespace spillikin::project {

namespace {

// The sine of the angle between `up` and the line of sight under which rounding would choose the image's roll.
constexpr double min_up_sine = 1e-10;

bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Scales by the largest component first, so that no square overflows or vanishes.
Vec3 unit(const Vec3& v) {
  const Vec3 scaled = v / std::fmax(std::fabs(v.x), std::fmax(std::fabs(v.y), std::fabs(v.z)));
  return scaled / glm::length(scaled);
}

void checkPose(const View& view) {
  if (!finite(view.eye) || !finite(view.target) || !finite(view.up)) {
    throw Error("camera: eye, target and up must be finite numbers; give each as x,y,z");
  }
  if (view.eye == view.target || !finite(view.target - view.eye)) {
    throw Error(
        fmt::format("camera: eye and target are both at {},{},{} (or too far apart); move one so that the camera "
                    "looks somewhere",
                    view.eye.x, view.eye.y, view.eye.z));
  }
  const Vec3 sight = unit(view.target - view.eye);
  if (view.up == Vec3(0.0) || glm::length(glm::cross(sight, unit(view.up))) < min_up_sine) {
    throw Error(fmt::format("camera: up {},{},{} is zero or parallel to the line of sight; choose another up",
                            view.up.x, view.up.y, view.up.z));
  }
}

void checkLens(const View& view) {
  if (!std::isfinite(view.parallel_scale) || view.parallel_scale < 0.0) {
    throw Error(
        fmt::format("camera: parallel scale {} is not a positive number; give half the view's height in "
                    "world units",
                    view.parallel_scale));
  }
  if (!view.parallel() && !(view.view_angle > 0.0 && view.view_angle < 180.0)) {
    throw Error(fmt::format("camera: view angle {} is not between 0 and 180 degrees", view.view_angle));
  }
}

void checkImage(const View& view) {
  if (view.width < 1 || view.height < 1) {
    throw Error(
        fmt::format("image: {}x{} has no pixels; give a width and height of at least 1", view.width, view.height));
  }
  if (static_cast<double>(view.width) * static_cast<double>(view.height) > Camera::max_pixels) {
    throw Error(fmt::format("image: {}x{} is more than {:.0f} pixels; give a smaller size", view.width, view.height,
                            Camera::max_pixels));
  }
}

void checkClips(const View& view) {
  for (std::size_t i = 0; i < view.clips.size(); ++i) {
    const ClipPlane& clip = view.clips[i];
    if (!finite(clip.point) || !finite(clip.normal) || clip.normal == Vec3(0.0)) {
      throw Error(fmt::format("clip plane {}: needs a finite point and a normal that is not zero", i));
    }
  }
}

}  // namespace

Camera::Camera(const View& view) : view_(view) {
  checkPose(view);
  checkLens(view);
  checkImage(view);
  checkClips(view);

  forward_ = unit(view.target - view.eye);
  right_ = unit(glm::cross(forward_, unit(view.up)));
  top_ = glm::cross(right_, forward_);

  constexpr double half_degree = 3.14159265358979323846 / 360.0;
  const double half_height = view.parallel() ? view.parallel_scale : std::tan(view.view_angle * half_degree);
  const double step = 2.0 * half_height / view.height;  // world units per pixel (at depth 1 in perspective)
  pixels_per_unit_ = view.height / (2.0 * half_height);

  const Vec3 dx = step * right_;
  const Vec3 dy = -step * top_;
  const Vec3 corner = -0.5 * view.width * dx - 0.5 * view.height * dy;
  if (view.parallel()) {
    origin0_ = view.eye + corner;
    origin_dx_ = dx;
    origin_dy_ = dy;
    direction0_ = forward_;
  } else {
    origin0_ = view.eye;
    direction0_ = forward_ + corner;
    direction_dx_ = dx;
    direction_dy_ = dy;
  }
}

Vec3 Camera::toScreen(const Vec3& world) const {
  const Vec3 offset = world - view_.eye;
  const double depth = glm::dot(offset, forward_);
  const double weight = parallel() ? 1.0 : depth;
  return {pixels_per_unit_ * glm::dot(offset, right_) + 0.5 * view_.width * weight,
          0.5 * view_.height * weight - pixels_per_unit_ * glm::dot(offset, top_), depth};
}

}  // namespace spillikin::project
