// The rays of a view, straight from the formula that defines it (base/view.h).
#pragma once

#include "spillikin/base/view.h"

namespace spillikin::reference {

struct Ray {
  Vec3 origin{0.0}, direction{0.0};  // not a unit vector: its component along the line of sight is 1
  Vec3 right{0.0}, down{0.0};        // in the image
};

// The part of a ray that is drawn: in front of the eye and inside every clip plane. lo > hi when there is none.
struct Range {
  double lo, hi;
};

class Rays {
 public:
  // Throws Error: size below 1, not finite, eye at the target, up along the line of sight, view angle outside (0, 180).
  explicit Rays(const View& view);

  Ray operator()(double x, double y) const;
  Range drawn(const Ray& ray) const;
  const View& view() const { return view_; }
  const Vec3& forward() const { return forward_; }

 private:
  View view_;
  Vec3 forward_{0.0}, right_{0.0}, top_{0.0};
  double half_height_ = 0.0;  // of the view, at depth 1 in perspective
};

}  // namespace spillikin::reference
