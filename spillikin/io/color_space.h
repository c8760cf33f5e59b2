// Interpolation between two colours as ParaView's colour maps define it. Private to io.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace spillikin::io {

using Rgb = std::array<double, 3>;

enum class ColorSpace { rgb, hsv, hsv_no_wrap, lab, diverging, step };

// "RGB", "HSV", "HsvNoWrap", "Lab", "Lab/CIEDE2000" (taken as Lab), "Diverging", "Step", any case; nothing for others.
std::optional<ColorSpace> colorSpaceOf(const std::string& name);

// The colour at the part s in [0, 1] of the way from a to b, each channel in [0, 1]. Lab and Diverging use the D65
// white; Diverging goes through white where the hues are far apart (Moreland, "Diverging Color Maps for Scientific
// Visualization", 2009). Step is b everywhere.
Rgb interpolate(ColorSpace space, const Rgb& a, const Rgb& b, double s);

}  // namespace spillikin::io
