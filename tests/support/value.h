// The point array "value" that every generator attaches.
#pragma once

#include <cmath>

#include "spillikin/base/view.h"

namespace spillikin::tests {

// Smooth, nowhere zero (0.5 to 3.5), and different in every direction, so that swapped axes show.
inline double smoothValue(const Vec3& p) {
  return 2.0 + 0.6 * std::sin(2.1 * p.x + 0.3) + 0.5 * std::cos(3.3 * p.y - 1.2 * p.z) +
         0.4 * std::sin(1.7 * p.z + p.x);
}

}  // namespace spillikin::tests
