// A view as linear maps: what projection and compositing compute with.
#pragma once

#include <glm/mat4x4.hpp>

#include "spillikin/base/view.h"

namespace spillikin::project {

// The ray of image position (x, y) is  origin(x, y) + w * direction(x, y)  with w the depth along the line of sight, in
// world units (see View). In perspective the origin is the eye and the direction is linear in x and y; in a parallel
// view the direction is constant and the origin is linear.
class Camera {
 public:
  // Throws Error: eye equal to target, up parallel to the line of sight or zero, angle outside (0, 180), parallel scale
  // not above 0 or not finite, image of no pixel or of more than max_pixels, a clip plane without normal.
  explicit Camera(const View& view);

  static constexpr double max_pixels = 16384.0 * 16384.0;

  const View& view() const { return view_; }
  bool parallel() const { return view_.parallel(); }
  int width() const { return view_.width; }
  int height() const { return view_.height; }

  // World to camera: (x*depth, y*depth, depth) in perspective; (x, y, depth) in a parallel view, with x, y in pixels.
  Vec3 toScreen(const Vec3& world) const;

  Vec3 origin(double x, double y) const { return origin0_ + x * origin_dx_ + y * origin_dy_; }
  Vec3 direction(double x, double y) const { return direction0_ + x * direction_dx_ + y * direction_dy_; }

  // The same, as coefficients of 1, x and y.
  const Vec3& origin0() const { return origin0_; }
  const Vec3& originDx() const { return origin_dx_; }
  const Vec3& originDy() const { return origin_dy_; }
  const Vec3& direction0() const { return direction0_; }
  const Vec3& directionDx() const { return direction_dx_; }
  const Vec3& directionDy() const { return direction_dy_; }
  const Vec3& forward() const { return forward_; }
  const Vec3& right() const { return right_; }
  const Vec3& top() const { return top_; }

 private:
  View view_;
  Vec3 forward_{0.0}, right_{0.0}, top_{0.0};
  Vec3 origin0_{0.0}, origin_dx_{0.0}, origin_dy_{0.0};
  Vec3 direction0_{0.0}, direction_dx_{0.0}, direction_dy_{0.0};
  double pixels_per_unit_ = 1.0;  // at depth 1 in perspective, at any depth in a parallel view
};

}  // namespace spillikin::project
