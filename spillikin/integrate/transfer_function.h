// Transfer functions: scalar to glow colour and extinction, piecewise linear with jumps.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace spillikin::integrate {

// One breakpoint. Colour is a display value in [0, 1]; extinction is per world unit, >= 0.
struct ControlPoint {
  double value = 0.0;
  std::array<double, 3> color{};
  double extinction = 0.0;
};

// Colour and extinction at one scalar value.
struct Optical {
  std::array<double, 3> color{};
  double extinction = 0.0;
};

// Linear between points, constant outside, values ascending in scalar units; two points with the same value make a
// jump. At the value of a jump the function takes the side of the higher values (the last of the equal points); a
// segment that ends there integrates the side it lies on.
class TransferFunction {
 public:
  TransferFunction() = default;
  // Throws Error: no points, values not ascending or not finite, more than two points with one value, colour outside
  // [0, 1], negative extinction.
  explicit TransferFunction(std::vector<ControlPoint> points);

  const std::vector<ControlPoint>& points() const { return points_; }
  Optical operator()(double value) const;
  // Whether all of it glows in one colour: then a ray's radiance is that colour times its opacity, and the order of
  // what it meets does not show (Optics::absorption, Optics::xray).
  bool oneColor() const;
  // The largest extinction.
  double densest() const;

  // The same function with extinction times `factor`, and with the values mapped from [0, 1] to [lo, hi].
  TransferFunction scaled(double factor) const;
  TransferFunction mapped(double lo, double hi) const;

 private:
  std::vector<ControlPoint> points_;
};

// Built-in looks, over the values [0, 1] with extinction of at most 1; `names` lists them. Throws Error with the list.
TransferFunction preset(std::string_view name);
std::vector<std::string> presetNames();
inline constexpr const char* default_preset = "viridis";

}  // namespace spillikin::integrate
