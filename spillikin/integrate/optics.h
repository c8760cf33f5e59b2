// Optical models: what a segment of a ray gives, and how segments join (Max 1995, Optical Models for Direct Volume
// Rendering).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

#include "spillikin/integrate/segment.h"
#include "spillikin/integrate/transfer_function.h"

namespace spillikin::integrate {

// With extinction tau(s), colour c(s) and optical depth D = integral of tau along the ray:
//   absorption_emission  integral of c tau exp(-D), alpha 1 - exp(-D): glowing particles that hide what is behind them
//   emission             integral of c tau, alpha 0: a glowing gas, added to the background; may exceed 1
//   absorption           black, alpha 1 - exp(-D): smoke before the background
//   mip                  the colour at the largest scalar on the ray, opaque wherever the ray meets a cell
//   xray                 white times 1 - exp(-D), and that alpha: a radiograph
// All but the first join segments in any order.
enum class Optics : std::uint8_t { absorption_emission, emission, absorption, mip, xray };

const char* name(Optics optics);
Optics optics(std::string_view name);  // absorption-emission, emission, ...; throws Error that lists them
inline bool orderMatters(Optics optics) {
  return optics == Optics::absorption_emission;
}

// What a ray has gathered. All-zero is a ray that has met nothing.
struct Gathered {
  std::array<double, 3> color{};
  double depth = 0.0;                                      // optical depth
  double peak = -std::numeric_limits<double>::infinity();  // largest scalar
};

// Joins the segment of `length` >= 0 world units, from scalar `front` to `back`. Front to back where order matters.
void gather(Optics optics, const TransferFunction& tf, double front, double back, double length, Gathered& ray);

// Premultiplied colour and alpha of the ray.
Radiance radiance(Optics optics, const TransferFunction& tf, const Gathered& ray);

}  // namespace spillikin::integrate
