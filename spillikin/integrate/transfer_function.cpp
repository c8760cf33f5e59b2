#include "spillikin/integrate/transfer_function.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/integrate/pieces.h"

namespace spillikin::integrate {

namespace {

void check(const std::vector<ControlPoint>& points) {
  const auto fail = [](std::size_t i, const std::string& why) {
    throw Error(fmt::format("transfer function: point {}: {}", i, why));
  };
  if (points.empty()) throw Error("transfer function: it has no points; give at least one");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ControlPoint& p = points[i];
    if (!std::isfinite(p.value)) fail(i, "its value is not a finite number");
    if (!(p.extinction >= 0.0) || !std::isfinite(p.extinction)) {
      fail(i, fmt::format("its extinction is {}, which must be a finite number, 0 or more", p.extinction));
    }
    for (const double c : p.color) {
      if (!(c >= 0.0 && c <= 1.0)) fail(i, fmt::format("its colour has a component {}, outside [0, 1]", c));
    }
    if (i > 0 && p.value < points[i - 1].value) {
      fail(i, fmt::format("its value {} is below the one before it, {}; sort the points by value", p.value,
                          points[i - 1].value));
    }
    if (i > 1 && p.value == points[i - 2].value) {
      fail(i, fmt::format("it is the third with the value {}; a jump is made of two", p.value));
    }
  }
}

}  // namespace

TransferFunction::TransferFunction(std::vector<ControlPoint> points) : points_(std::move(points)) {
  check(points_);
}

Optical TransferFunction::operator()(double value) const {
  if (points_.empty()) return {};
  const auto next = std::upper_bound(points_.begin(), points_.end(), value,
                                     [](double v, const ControlPoint& p) { return v < p.value; });
  if (next == points_.begin()) return {next->color, next->extinction};
  const ControlPoint& a = *(next - 1);
  if (next == points_.end() || a.value == value) return {a.color, a.extinction};
  const double t = (value - a.value) / (next->value - a.value);
  Optical o;
  for (std::size_t k = 0; k < 3; ++k)
    o.color[k] = a.color[k] + t * (next->color[k] - a.color[k]);
  o.extinction = a.extinction + t * (next->extinction - a.extinction);
  return o;
}

bool TransferFunction::oneColor() const {
  return std::all_of(points_.begin(), points_.end(),
                     [&](const ControlPoint& p) { return p.color == points_.front().color; });
}

double TransferFunction::densest() const {
  double most = 0.0;
  for (const ControlPoint& p : points_)
    most = std::max(most, p.extinction);
  return most;
}

TransferFunction TransferFunction::scaled(double factor) const {
  if (!(factor >= 0.0) || !std::isfinite(factor)) {
    throw Error(
        fmt::format("transfer function: the factor of its extinction is {}; it must be finite, 0 or more", factor));
  }
  std::vector<ControlPoint> points = points_;
  for (ControlPoint& p : points)
    p.extinction *= factor;
  return TransferFunction(std::move(points));
}

TransferFunction TransferFunction::mapped(double lo, double hi) const {
  if (!std::isfinite(lo) || !std::isfinite(hi) || lo > hi) {
    throw Error(
        fmt::format("transfer function: the range {},{} must be two finite numbers, the lower one first", lo, hi));
  }
  if (lo == hi) {
    const double half = 0.5 * std::max(1.0, std::abs(lo));
    const double middle = lo;
    lo = middle - half;
    hi = middle + half;
  }
  std::vector<ControlPoint> points;
  for (ControlPoint p : points_) {
    p.value = std::lerp(lo, hi, p.value);
    // Where the range has fewer doubles than the function has points, those that fall on one value become one jump.
    const std::size_t n = points.size();
    if (n > 1 && points[n - 2].value == p.value) points.pop_back();
    points.push_back(p);
  }
  return TransferFunction(std::move(points));
}

}  // namespace spillikin::integrate
