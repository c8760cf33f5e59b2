// ParaView's colour maps as transfer functions. Private to io.
#pragma once

#include <vector>

#include "spillikin/integrate/transfer_function.h"
#include "spillikin/io/color_space.h"

namespace spillikin::io {

struct ColorNode {
  double value = 0.0;
  Rgb color{};
};

// Opacity a over the unit distance; midpoint and sharpness shape the way to the next node (0.5 and 0: straight).
struct OpacityNode {
  double value = 0.0;
  double opacity = 0.0;
  double midpoint = 0.5;
  double sharpness = 0.0;
};

// Both lists ascending in value and not empty; equal values make a jump. Where colours or opacities do not run linearly
// in display colour and extinction, points are added until each quarter of the way between two points is right to
// 1/1024 in colour and in opacity over the unit distance, at most 64 between two nodes.
std::vector<integrate::ControlPoint> controlPoints(const std::vector<ColorNode>& colors, ColorSpace space,
                                                   const std::vector<OpacityNode>& opacities, double unit_distance);

}  // namespace spillikin::io
