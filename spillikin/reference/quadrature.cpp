#include "spillikin/reference/quadrature.h"

#include <algorithm>
#include <cmath>

namespace spillikin::reference {
namespace {

using integrate::Optical;
using integrate::Radiance;

// One piece of a segment on which colour and extinction are linear in s, from 0 at the front to 1.
struct Piece {
  Optical front, back;
  double length;
  double depth(double s) const {
    return length * s * (front.extinction + 0.5 * s * (back.extinction - front.extinction));
  }
  std::array<double, 3> glow(double s) const {
    const double weight = length * (front.extinction + s * (back.extinction - front.extinction)) * std::exp(-depth(s));
    std::array<double, 3> value{};
    for (std::size_t c = 0; c < 3; ++c)
      value[c] = weight * (front.color[c] + s * (back.color[c] - front.color[c]));
    return value;
  }
};

// Gauss-Kronrod rule of 7 and 15 points: half of its symmetric nodes and weights.
constexpr std::array<double, 8> node{0.991455371120812639206854697526329, 0.949107912342758524526189684047851,
                                     0.864864423359769072789712788640926, 0.741531185599394439863864773280788,
                                     0.586087235467691130294144691693013, 0.405845151377397166906606412076961,
                                     0.207784955007898467600689403773245, 0.0};
constexpr std::array<double, 8> kronrod{0.022935322010529224963732008058970, 0.063092092629978553290700663189204,
                                        0.104790010322250183839876322541518, 0.140653259715525918745189590510238,
                                        0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
                                        0.204432940075298892414161999234649, 0.209482141084727828012999174891714};
constexpr std::array<double, 4> gauss{0.129484966168869693270611432679082, 0.279705391489276667901467771423780,
                                      0.381830050505118944950369775488975, 0.417959183673469387755102040816327};

void integrateGlow(const Piece& piece, double lo, double hi, int depth, std::array<double, 3>& sum) {
  const double middle = 0.5 * (lo + hi), half = 0.5 * (hi - lo);
  std::array<double, 3> fine{}, coarse{};
  for (std::size_t n = 0; n < 8; ++n) {
    for (const double sign : {-1.0, 1.0}) {
      if (n == 7 && sign > 0.0) break;  // the middle counts once
      const std::array<double, 3> value = piece.glow(middle + sign * half * node[n]);
      for (std::size_t c = 0; c < 3; ++c) {
        fine[c] += kronrod[n] * value[c];
        if (n % 2 == 1) coarse[c] += gauss[n / 2] * value[c];
      }
    }
  }
  double error = 0.0;
  for (std::size_t c = 0; c < 3; ++c)
    error = std::max(error, half * std::abs(fine[c] - coarse[c]));
  constexpr int deepest = 40;
  if (error > quadrature_tolerance * (hi - lo) && depth < deepest && error > 1e-16) {
    integrateGlow(piece, lo, middle, depth + 1, sum);
    integrateGlow(piece, middle, hi, depth + 1, sum);
    return;
  }
  for (std::size_t c = 0; c < 3; ++c)
    sum[c] += half * fine[c];
}

Radiance integratePiece(const Piece& piece) {
  Radiance out;
  integrateGlow(piece, 0.0, 1.0, 0, out.color);
  out.alpha = -std::expm1(-piece.depth(1.0));
  return out;
}

// The value at breakpoint p approached from below (the first of equal points) or from above (the last).
Optical at(const std::vector<integrate::ControlPoint>& points, double value, bool from_below) {
  const auto less = [](const integrate::ControlPoint& p, double v) { return p.value < v; };
  const auto greater = [](double v, const integrate::ControlPoint& p) { return v < p.value; };
  const auto upper = from_below ? std::lower_bound(points.begin(), points.end(), value, less)
                                : std::upper_bound(points.begin(), points.end(), value, greater);
  if (upper == points.begin()) return {upper->color, upper->extinction};
  const integrate::ControlPoint& a = *(upper - 1);
  if (upper == points.end()) return {a.color, a.extinction};
  const integrate::ControlPoint& b = *upper;
  const double w = (value - a.value) / (b.value - a.value);
  Optical out;
  for (std::size_t c = 0; c < 3; ++c)
    out.color[c] = a.color[c] + w * (b.color[c] - a.color[c]);
  out.extinction = a.extinction + w * (b.extinction - a.extinction);
  return out;
}

}  // namespace

integrate::Radiance quadrature(const integrate::TransferFunction& tf, double front, double back, double length) {
  const auto& points = tf.points();
  if (front == back) {
    const Optical optical = at(points, front, false);
    return integratePiece({optical, optical, length});
  }
  const bool rising = back > front;
  const std::size_t count = points.size();
  Radiance sum;
  double from = front;
  for (std::size_t n = 0; n <= count; ++n) {
    double to = back;
    if (n < count) {
      const double value = points[rising ? n : count - 1 - n].value;
      if (rising ? (value <= from || value >= back) : (value >= from || value <= back)) continue;
      to = value;
    }
    const Piece piece{at(points, from, !rising), at(points, to, rising), length * ((to - from) / (back - front))};
    sum = over(sum, integratePiece(piece));
    from = to;
  }
  return sum;
}

}  // namespace spillikin::reference
