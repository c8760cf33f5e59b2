// A segment cut at the breakpoints of a transfer function: what every optical model integrates over.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "spillikin/integrate/transfer_function.h"

namespace spillikin::integrate {

// The function at `value` between two neighbouring points of different value; exact at both.
inline Optical between(const ControlPoint& a, const ControlPoint& b, double value) {
  const double t = (value - a.value) / (b.value - a.value);
  if (!(t < 1.0)) return {b.color, b.extinction};
  Optical o;
  for (std::size_t k = 0; k < 3; ++k)
    o.color[k] = a.color[k] + t * (b.color[k] - a.color[k]);
  o.extinction = a.extinction + t * (b.extinction - a.extinction);
  return o;
}

// The integral of colour times extinction over a piece of unit length: what it glows where nothing hides anything.
// Simpson's rule, exact for the product of two linear functions.
inline std::array<double, 3> meanGlow(const Optical& a, const Optical& b) {
  std::array<double, 3> glow;
  for (std::size_t k = 0; k < 3; ++k) {
    glow[k] =
        (a.color[k] * (2.0 * a.extinction + b.extinction) + b.color[k] * (a.extinction + 2.0 * b.extinction)) / 6.0;
  }
  return glow;
}

// Calls visit(front, back, length) -> bool for each piece of the segment on which colour and extinction are linear,
// from the front, until it says false. The scalar runs linearly from `front` to `back` over `length` >= 0. At a jump
// each piece ends with the look of its own side; a segment with equal ends lies at one value and takes the function's
// rule there. No allocation; one binary search, then constant work a piece.
template <class Visit>
void forEachPiece(const TransferFunction& tf, double front, double back, double length, Visit&& visit) {
  const auto& p = tf.points();
  if (!(length > 0.0) || p.empty()) return;
  if (front == back) {
    const Optical o = tf(front);
    visit(o, o, length);
    return;
  }
  // Halves keep the span finite where the ends are near the limits of double.
  const double unit = std::isfinite(back - front) ? 1.0 : 0.5;
  const double span = unit * back - unit * front;
  const bool up = back > front;
  // The first point beyond `front`: the piece that `front` lies in ends (up) or begins (down) just before it.
  auto next = up ? std::upper_bound(p.begin(), p.end(), front, [](double v, const auto& q) { return v < q.value; })
                 : std::lower_bound(p.begin(), p.end(), front, [](const auto& q, double v) { return q.value < v; });
  double here = front;
  for (bool last = false; !last;) {
    const auto flat = next == p.begin() ? p.begin() : std::prev(next);
    const bool outside = next == p.begin() || next == p.end();
    const bool open = up ? next == p.end() : next == p.begin();  // nothing but `back` ends this piece
    const double cut = open ? back : (up ? next->value : std::prev(next)->value);
    last = up ? !(cut < back) : !(cut > back);
    const double there = last ? back : cut;
    const Optical a = outside ? Optical{flat->color, flat->extinction} : between(*std::prev(next), *next, here);
    const Optical b = outside ? a : between(*std::prev(next), *next, there);
    if (!visit(a, b, length * ((unit * there - unit * here) / span))) return;
    here = there;
    // Over the cut, and over both points of a jump.
    if (up) {
      while (next != p.end() && next->value <= here)
        ++next;
    } else {
      while (next != p.begin() && std::prev(next)->value >= here)
        --next;
    }
  }
}

}  // namespace spillikin::integrate
