#include "spillikin/io/color_space.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

namespace spillikin::io {
namespace {

using std::numbers::pi;

Rgb mix(const Rgb& a, const Rgb& b, double s) {
  return {a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])};
}

Rgb clamped(const Rgb& c) {
  return {std::clamp(c[0], 0.0, 1.0), std::clamp(c[1], 0.0, 1.0), std::clamp(c[2], 0.0, 1.0)};
}

// ---- HSV, each in [0, 1] --------------------------------------------------------------------------------------------

Rgb toHsv(const Rgb& c) {
  const double high = std::max({c[0], c[1], c[2]}), low = std::min({c[0], c[1], c[2]}), spread = high - low;
  if (spread <= 0.0) return {0.0, 0.0, high};
  double hue = 0.0;
  if (high == c[0]) {
    hue = (c[1] - c[2]) / spread;
  } else if (high == c[1]) {
    hue = 2.0 + (c[2] - c[0]) / spread;
  } else {
    hue = 4.0 + (c[0] - c[1]) / spread;
  }
  return {hue < 0.0 ? hue / 6.0 + 1.0 : hue / 6.0, spread / high, high};
}

Rgb fromHsv(const Rgb& c) {
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + 6.0 * c[0], 6.0);
    return c[2] * (1.0 - c[1] * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

Rgb mixHsv(const Rgb& a, const Rgb& b, double s, bool wrap) {
  Rgb from = toHsv(a), to = toHsv(b);
  if (wrap && std::abs(from[0] - to[0]) > 0.5) (from[0] < to[0] ? from[0] : to[0]) += 1.0;
  Rgb hsv = mix(from, to, s);
  hsv[0] -= std::floor(hsv[0]);
  return fromHsv(hsv);
}

// ---- CIE L*a*b*, sRGB primaries and the D65 white -------------------------------------------------------------------

constexpr Rgb white = {0.9505, 1.0, 1.089};

double linearOf(double v) {
  return v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92;
}
double gammaOf(double v) {
  return v > 0.0031308 ? 1.055 * std::pow(v, 1.0 / 2.4) - 0.055 : 12.92 * v;
}

Rgb toLab(const Rgb& c) {
  const double r = linearOf(c[0]), g = linearOf(c[1]), b = linearOf(c[2]);
  const Rgb xyz = {0.4124 * r + 0.3576 * g + 0.1805 * b, 0.2126 * r + 0.7152 * g + 0.0722 * b,
                   0.0193 * r + 0.1192 * g + 0.9505 * b};
  const auto f = [&](int i) {
    const double t = xyz[static_cast<std::size_t>(i)] / white[static_cast<std::size_t>(i)];
    return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0;
  };
  return {116.0 * f(1) - 16.0, 500.0 * (f(0) - f(1)), 200.0 * (f(1) - f(2))};
}

Rgb fromLab(const Rgb& lab) {
  const double y = (lab[0] + 16.0) / 116.0;
  const auto inverse = [](double f) { return f * f * f > 0.008856 ? f * f * f : (f - 16.0 / 116.0) / 7.787; };
  const double X = white[0] * inverse(y + lab[1] / 500.0), Y = white[1] * inverse(y);
  const double Z = white[2] * inverse(y - lab[2] / 200.0);
  return clamped({gammaOf(3.2406 * X - 1.5372 * Y - 0.4986 * Z), gammaOf(-0.9689 * X + 1.8758 * Y + 0.0415 * Z),
                  gammaOf(0.0557 * X - 0.2040 * Y + 1.0570 * Z)});
}

// ---- Msh: Lab in polar form -----------------------------------------------------------------------------------------

Rgb toMsh(const Rgb& lab) {
  const double m = std::sqrt(lab[0] * lab[0] + lab[1] * lab[1] + lab[2] * lab[2]);
  const double s = m > 0.001 ? std::acos(std::clamp(lab[0] / m, -1.0, 1.0)) : 0.0;
  return {m, s, s > 0.001 ? std::atan2(lab[2], lab[1]) : 0.0};
}

Rgb fromMsh(const Rgb& msh) {
  return {msh[0] * std::cos(msh[1]), msh[0] * std::sin(msh[1]) * std::cos(msh[2]),
          msh[0] * std::sin(msh[1]) * std::sin(msh[2])};
}

double angleBetween(double a, double b) {
  const double d = std::abs(std::fmod(a - b, 2.0 * pi));
  return d > pi ? 2.0 * pi - d : d;
}

// The hue that an unsaturated colour of magnitude m takes beside a saturated one.
double adjustedHue(const Rgb& msh, double m) {
  if (msh[0] >= m - 0.1) return msh[2];
  const double spin = msh[1] * std::sqrt(m * m - msh[0] * msh[0]) / (msh[0] * std::sin(msh[1]));
  return msh[2] > -pi / 3.0 ? msh[2] + spin : msh[2] - spin;
}

Rgb mixDiverging(const Rgb& a, const Rgb& b, double s) {
  constexpr double saturated = 0.05;
  Rgb from = toMsh(toLab(a)), to = toMsh(toLab(b));
  if (from[1] > saturated && to[1] > saturated && angleBetween(from[2], to[2]) > pi / 3.0) {
    const double middle = std::max({from[0], to[0], 88.0});
    if (s < 0.5) {
      to = {middle, 0.0, 0.0};
      s = 2.0 * s;
    } else {
      from = {middle, 0.0, 0.0};
      s = 2.0 * s - 1.0;
    }
  }
  if (from[1] < saturated && to[1] > saturated) from[2] = adjustedHue(to, from[0]);
  if (to[1] < saturated && from[1] > saturated) to[2] = adjustedHue(from, to[0]);
  return fromLab(fromMsh(mix(from, to, s)));
}

}  // namespace

std::optional<ColorSpace> colorSpaceOf(const std::string& name) {
  std::string key = name;
  std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) { return std::tolower(c); });
  if (key == "rgb") return ColorSpace::rgb;
  if (key == "hsv") return ColorSpace::hsv;
  if (key == "hsvnowrap") return ColorSpace::hsv_no_wrap;
  if (key == "lab" || key == "cielab" || key == "lab/ciede2000") return ColorSpace::lab;
  if (key == "diverging") return ColorSpace::diverging;
  if (key == "step") return ColorSpace::step;
  return std::nullopt;
}

Rgb interpolate(ColorSpace space, const Rgb& a, const Rgb& b, double s) {
  // The ends are exact in every space.
  if (space == ColorSpace::step) return b;
  if (s <= 0.0) return a;
  if (s >= 1.0) return b;
  switch (space) {
    case ColorSpace::hsv:
      return clamped(mixHsv(a, b, s, true));
    case ColorSpace::hsv_no_wrap:
      return clamped(mixHsv(a, b, s, false));
    case ColorSpace::lab:
      return fromLab(mix(toLab(a), toLab(b), s));
    case ColorSpace::diverging:
      return mixDiverging(a, b, s);
    default:
      return clamped(mix(a, b, s));
  }
}

}  // namespace spillikin::io
