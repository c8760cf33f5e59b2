#include "spillikin/io/paraview_colormap.h"

#include <algorithm>
#include <cmath>

namespace spillikin::io {
namespace {

using integrate::ControlPoint;

constexpr double tolerance = 1.0 / 1024.0;  // of colour and of opacity over the unit distance
constexpr int max_depth = 6;                // bisections between two nodes
constexpr double max_opacity = 1.0 - 0x1p-24;

// Which side of a jump a value is approached from.
enum class Side { below, above };

// The last node at or below `value` (above) or strictly below it (below); -1 before the first.
template <typename Node>
std::ptrdiff_t nodeBefore(const std::vector<Node>& nodes, double value, Side side) {
  const auto first = side == Side::above ? std::upper_bound(nodes.begin(), nodes.end(), value,
                                                            [](double v, const Node& node) { return v < node.value; })
                                         : std::lower_bound(nodes.begin(), nodes.end(), value,
                                                            [](const Node& node, double v) { return node.value < v; });
  return first - nodes.begin() - 1;
}

Rgb colorAt(const std::vector<ColorNode>& nodes, ColorSpace space, double value, Side side) {
  const std::ptrdiff_t before = nodeBefore(nodes, value, side);
  if (before < 0) return nodes.front().color;
  if (before + 1 == std::ssize(nodes)) return nodes.back().color;
  const ColorNode& a = nodes[static_cast<std::size_t>(before)];
  const ColorNode& b = nodes[static_cast<std::size_t>(before) + 1];
  return interpolate(space, a.color, b.color, (value - a.value) / (b.value - a.value));
}

// From y0 to y1 as VTK's piecewise functions run: the middle lies at `midpoint`; sharpness 0 is straight, above it a
// Hermite curve.
double shaped(double s, double y0, double y1, double midpoint, double sharpness) {
  midpoint = std::clamp(midpoint, 1e-5, 1.0 - 1e-5);
  s = s < midpoint ? 0.5 * s / midpoint : 0.5 + 0.5 * (s - midpoint) / (1.0 - midpoint);
  if (sharpness < 0.01) return y0 + s * (y1 - y0);
  const double power = 1.0 + 10.0 * sharpness;
  s = s < 0.5 ? 0.5 * std::pow(2.0 * s, power) : 1.0 - 0.5 * std::pow(2.0 * (1.0 - s), power);
  const double rise = s * s * (3.0 - 2.0 * s);
  const double tangents = s * (1.0 - s) * (1.0 - 2.0 * s) * (1.0 - sharpness);
  return std::clamp(y0 + (y1 - y0) * (rise + tangents), std::min(y0, y1), std::max(y0, y1));
}

// Sharpness 1 is a step at the midpoint.
bool isStep(const OpacityNode& node) {
  return node.sharpness > 0.99;
}

double stepValue(const OpacityNode& a, const OpacityNode& b) {
  return a.value + std::clamp(a.midpoint, 1e-5, 1.0 - 1e-5) * (b.value - a.value);
}

double opacityAt(const std::vector<OpacityNode>& nodes, double value, Side side) {
  const std::ptrdiff_t before = nodeBefore(nodes, value, side);
  if (before < 0) return nodes.front().opacity;
  if (before + 1 == std::ssize(nodes)) return nodes.back().opacity;
  const OpacityNode& a = nodes[static_cast<std::size_t>(before)];
  const OpacityNode& b = nodes[static_cast<std::size_t>(before) + 1];
  const double s = (value - a.value) / (b.value - a.value);
  if (s >= 1.0) return b.opacity;
  if (isStep(a)) return value < stepValue(a, b) ? a.opacity : b.opacity;
  return shaped(s, a.opacity, b.opacity, a.midpoint, a.sharpness);
}

class Sampler {
 public:
  Sampler(const std::vector<ColorNode>& colors, ColorSpace space, const std::vector<OpacityNode>& opacities,
          double unit_distance)
      : colors_(colors), space_(space), opacities_(opacities), unit_(unit_distance) {}

  ControlPoint at(double value, Side side) const {
    const double opacity = std::clamp(opacityAt(opacities_, value, side), 0.0, max_opacity);
    return {value, colorAt(colors_, space_, value, side), -std::log1p(-opacity) / unit_};
  }

  // Points strictly between a and b.
  void refine(const ControlPoint a, const ControlPoint b, int depth, std::vector<ControlPoint>& out) const {
    const double middle = a.value + 0.5 * (b.value - a.value);
    if (depth == 0 || !(a.value < middle && middle < b.value)) return;
    const auto straight = [&](double s) { return near(a, b, s, at(a.value + s * (b.value - a.value), Side::above)); };
    if (straight(0.25) && straight(0.5) && straight(0.75)) return;
    const ControlPoint mid = at(middle, Side::above);
    refine(a, mid, depth - 1, out);
    out.push_back(mid);
    refine(mid, b, depth - 1, out);
  }

 private:
  bool near(const ControlPoint& a, const ControlPoint& b, double s, const ControlPoint& exact) const {
    double error = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      error = std::max(error, std::abs(a.color[c] + s * (b.color[c] - a.color[c]) - exact.color[c]));
    }
    const double extinction = a.extinction + s * (b.extinction - a.extinction);
    error = std::max(error, std::abs(std::exp(-unit_ * extinction) - std::exp(-unit_ * exact.extinction)));
    return error <= tolerance;
  }

  const std::vector<ColorNode>& colors_;
  ColorSpace space_;
  const std::vector<OpacityNode>& opacities_;
  double unit_;
};

// The values of all nodes, and of the steps between opacity nodes, each once.
std::vector<double> breakValues(const std::vector<ColorNode>& colors, const std::vector<OpacityNode>& opacities) {
  std::vector<double> values;
  values.reserve(colors.size() + 2 * opacities.size());
  for (const ColorNode& node : colors)
    values.push_back(node.value);
  for (std::size_t i = 0; i < opacities.size(); ++i) {
    values.push_back(opacities[i].value);
    if (i + 1 < opacities.size() && isStep(opacities[i])) values.push_back(stepValue(opacities[i], opacities[i + 1]));
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

// Equal but for the rounding of one step in the value.
bool alike(const ControlPoint& a, const ControlPoint& b, double unit_distance) {
  constexpr double rounding = 1e-6;
  double difference = std::abs(std::exp(-unit_distance * a.extinction) - std::exp(-unit_distance * b.extinction));
  for (std::size_t c = 0; c < 3; ++c)
    difference = std::max(difference, std::abs(a.color[c] - b.color[c]));
  return difference < rounding;
}

}  // namespace

std::vector<ControlPoint> controlPoints(const std::vector<ColorNode>& colors, ColorSpace space,
                                        const std::vector<OpacityNode>& opacities, double unit_distance) {
  const Sampler sampler(colors, space, opacities, unit_distance);
  const std::vector<double> values = breakValues(colors, opacities);
  std::vector<ControlPoint> points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const ControlPoint above = sampler.at(values[i], Side::above);
    if (i > 0) {
      // A step takes its upper side at its own value: the lower one is found just before it.
      ControlPoint below = sampler.at(std::nextafter(values[i], values[i - 1]), Side::below);
      below.value = values[i];
      if (alike(below, above, unit_distance)) below = above;
      sampler.refine(points.back(), below, max_depth, points);
      if (!alike(below, above, unit_distance)) points.push_back(below);
    }
    points.push_back(above);
  }
  return points;
}

}  // namespace spillikin::io
