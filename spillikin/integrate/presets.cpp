// The built-in looks. Colour tables: viridis, plasma, inferno and magma (Smith, van der Walt and Firing 2015, public
// domain) at every 17th of their 256 entries; coolwarm (Moreland 2009, Diverging Color Maps) at every other of its 33.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/integrate/transfer_function.h"

namespace spillikin::integrate {

namespace {

using Rgb = std::uint32_t;  // 0xrrggbb

constexpr std::array<Rgb, 16> viridis = {0x440154, 0x481a6c, 0x472f7d, 0x414487, 0x39568c, 0x31688e,
                                         0x2a788e, 0x23888e, 0x1f988b, 0x22a884, 0x35b779, 0x54c568,
                                         0x7ad151, 0xa5db36, 0xd2e21b, 0xfde725};
constexpr std::array<Rgb, 16> plasma = {0x0d0887, 0x330597, 0x5002a2, 0x6a00a8, 0x8405a7, 0x9c179e, 0xb12a90, 0xc33d80,
                                        0xd35171, 0xe16462, 0xed7953, 0xf68f44, 0xfca636, 0xfec029, 0xf9dc24, 0xf0f921};
constexpr std::array<Rgb, 16> inferno = {0x000004, 0x0c0826, 0x240c4f, 0x420a68, 0x5d126e, 0x781c6d,
                                         0x932667, 0xae305c, 0xc73e4c, 0xdd513a, 0xed6925, 0xf8850f,
                                         0xfca50a, 0xfac62d, 0xf2e661, 0xfcffa4};
constexpr std::array<Rgb, 16> magma = {0x000004, 0x0b0924, 0x20114b, 0x3b0f70, 0x57157e, 0x721f81, 0x8c2981, 0xa8327d,
                                       0xc43c75, 0xde4968, 0xf1605d, 0xfa7f5e, 0xfe9f6d, 0xfebf84, 0xfddea0, 0xfcfdbf};
constexpr std::array<Rgb, 17> coolwarm = {0x3b4cc0, 0x4d68d7, 0x6282ea, 0x779af7, 0x8db0fe, 0xa3c2ff,
                                          0xb8d0f9, 0xccd9ee, 0xdddddd, 0xecd3c5, 0xf5c4ad, 0xf7b194,
                                          0xf49a7b, 0xec7f63, 0xde604d, 0xcb3e38, 0xb40426};
constexpr std::array<Rgb, 2> grayscale = {0x000000, 0xffffff};

std::array<double, 3> color(Rgb rgb) {
  return {((rgb >> 16U) & 255U) / 255.0, ((rgb >> 8U) & 255U) / 255.0, (rgb & 255U) / 255.0};
}

// Equally spaced colours under a linear ramp of extinction. The ramp starts a little above 0, so that the outline of
// the mesh shows where the field is lowest.
TransferFunction ramp(std::span<const Rgb> colors) {
  constexpr double lowest = 0.02;
  std::vector<ControlPoint> points;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const double v = static_cast<double>(i) / static_cast<double>(colors.size() - 1);
    points.push_back({v, color(colors[i]), lowest + (1.0 - lowest) * v});
  }
  return TransferFunction(std::move(points));
}

// A diverging map: both ends are dense and the middle is thin.
TransferFunction diverging(std::span<const Rgb> colors) {
  constexpr double lowest = 0.02;
  std::vector<ControlPoint> points;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const double v = static_cast<double>(i) / static_cast<double>(colors.size() - 1);
    points.push_back({v, color(colors[i]), lowest + (1.0 - lowest) * std::abs(2.0 * v - 1.0)});
  }
  return TransferFunction(std::move(points));
}

// Plateaus of constant colour and rising extinction, with a jump between neighbours.
TransferFunction steps() {
  constexpr std::size_t count = 8;
  std::vector<ControlPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    const std::array<double, 3> c = color(viridis[2 * i + 1]);
    const double extinction = static_cast<double>(i + 1) / count;
    points.push_back({static_cast<double>(i) / count, c, extinction});
    points.push_back({static_cast<double>(i + 1) / count, c, extinction});
  }
  return TransferFunction(std::move(points));
}

// Dense bands with jumps on both sides, nearly nothing between them: contour shells of finite thickness.
TransferFunction bands() {
  constexpr std::size_t count = 5;
  constexpr double half_width = 0.03;
  constexpr double haze = 0.01;
  std::vector<ControlPoint> points = {{0.0, color(plasma[0]), haze}};
  for (std::size_t i = 0; i < count; ++i) {
    const double middle = (static_cast<double>(i) + 0.5) / count;
    const std::array<double, 3> c = color(plasma[3 * i + 2]);
    points.push_back({middle - half_width, c, haze});
    points.push_back({middle - half_width, c, 1.0});
    points.push_back({middle + half_width, c, 1.0});
    points.push_back({middle + half_width, c, haze});
  }
  points.push_back({1.0, color(plasma[15]), haze});
  return TransferFunction(std::move(points));
}

// Narrow hats with nothing between them, in alternating colours: the hardest look for whoever samples.
TransferFunction comb() {
  constexpr std::size_t count = 16;
  constexpr double half_width = 0.01;
  std::vector<ControlPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double middle = (static_cast<double>(i) + 0.5) / count;
    const std::array<double, 3> c = color(inferno[i % 2 == 0 ? 5 + i / 2 : 15 - i / 2]);
    points.push_back({middle - half_width, c, 0.0});
    points.push_back({middle, c, 1.0});
    points.push_back({middle + half_width, c, 0.0});
  }
  return TransferFunction(std::move(points));
}

using Maker = TransferFunction (*)();
constexpr std::array<std::pair<const char*, Maker>, 9> looks = {{
    {"viridis", [] { return ramp(viridis); }},
    {"plasma", [] { return ramp(plasma); }},
    {"inferno", [] { return ramp(inferno); }},
    {"magma", [] { return ramp(magma); }},
    {"grayscale", [] { return ramp(grayscale); }},
    {"coolwarm", [] { return diverging(coolwarm); }},
    {"steps", steps},
    {"bands", bands},
    {"comb", comb},
}};

}  // namespace

TransferFunction preset(std::string_view name) {
  for (const auto& [known, make] : looks) {
    if (name == known) return make();
  }
  throw Error(
      fmt::format("transfer function '{}' is not a file and not one of {}", name, fmt::join(presetNames(), ", ")));
}

std::vector<std::string> presetNames() {
  std::vector<std::string> names;
  names.reserve(looks.size());
  for (const auto& look : looks)
    names.emplace_back(look.first);
  return names;
}

}  // namespace spillikin::integrate
