// The absorption-emission integral over one ray segment: closed form in double precision.
#pragma once

#include <array>

#include "spillikin/integrate/transfer_function.h"

namespace spillikin::integrate {

// Radiance that leaves the front of a segment, premultiplied, and its opacity 1 - exp(-optical depth).
struct Radiance {
  std::array<double, 3> color{};
  double alpha = 0.0;
};

// Front over back: what reaches the eye of `back` seen through `front`.
inline Radiance over(const Radiance& front, const Radiance& back) {
  const double t = 1.0 - front.alpha;
  return {{front.color[0] + t * back.color[0], front.color[1] + t * back.color[1], front.color[2] + t * back.color[2]},
          front.alpha + t * back.alpha};
}

// The weights of a segment on which colour and extinction are linear: radiance = front * c_f + back * c_b.
// front = 1 - Psi, back = Psi - zeta, alpha = 1 - zeta, each to relative accuracy (1e-12 for thin segments too).
struct Weights {
  double front = 0.0;
  double back = 0.0;
  double alpha = 0.0;
};

// x = front extinction * length, y = back extinction * length, both >= 0 (Moreland and Angel 2004). Any x, y from 0 to
// 1e6; no branch at which the answer jumps by more than its error bound.
Weights weights(double x, double y);

// The radiance of a segment of `length` >= 0 world units on which the scalar runs linearly from `front` to `back`, cut
// at the transfer function's breakpoints. A segment with front == back lies at one value: jumps by TransferFunction's
// rule.
Radiance integrate(const TransferFunction& tf, double front, double back, double length);

}  // namespace spillikin::integrate
