// The largest scalar on each ray, and its colour (integrate::Optics::mip).
#pragma once

#include <algorithm>
#include <cmath>

#include "spillikin/base/image.h"
#include "spillikin/composite/compositor.h"

namespace spillikin::composite {

// Backends gather the largest scalar on this scale, [0, 1] over the field's range, as an image's red, with an alpha of
// 1 where the ray meets a cell and 0 elsewhere.
struct PeakScale {
  double lo = 0.0, span = 1.0;
  explicit PeakScale(const mesh::Field& field) : lo(field.lo) {
    const double range = field.hi - field.lo;
    if (range > 0.0 && std::isfinite(1.0 / range) && std::isfinite(range)) span = range;
  }
  float operator()(double value) const { return static_cast<float>(std::clamp((value - lo) / span, 0.0, 1.0)); }
};

// Their colours in their place. A scalar that rounding has moved off a point of the transfer function is taken to be
// at the point, so that it stays on its side of a jump.
void colorPeaks(const Frame& frame, Image& image);

}  // namespace spillikin::composite
