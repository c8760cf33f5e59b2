#include "spillikin/integrate/optics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/integrate/pieces.h"

namespace spillikin::integrate {

namespace {

constexpr std::array<std::pair<Optics, const char*>, 5> names = {{
    {Optics::absorption_emission, "absorption-emission"},
    {Optics::emission, "emission"},
    {Optics::absorption, "absorption"},
    {Optics::mip, "mip"},
    {Optics::xray, "xray"},
}};

void emit(const TransferFunction& tf, double front, double back, double length, Gathered& ray) {
  forEachPiece(tf, front, back, length, [&](const Optical& a, const Optical& b, double part) {
    const std::array<double, 3> glow = meanGlow(a, b);
    for (std::size_t k = 0; k < 3; ++k)
      ray.color[k] += part * glow[k];
    return true;
  });
}

void absorb(const TransferFunction& tf, double front, double back, double length, Gathered& ray) {
  forEachPiece(tf, front, back, length, [&](const Optical& a, const Optical& b, double part) {
    ray.depth += 0.5 * part * (a.extinction + b.extinction);
    return true;
  });
}

}  // namespace

const char* name(Optics optics) {
  return names[static_cast<std::size_t>(optics)].second;
}

Optics optics(std::string_view name) {
  std::vector<const char*> known;
  for (const auto& [value, word] : names) {
    if (name == word) return value;
    known.push_back(word);
  }
  throw Error(fmt::format("optical model '{}' is not known; use one of {}", name, fmt::join(known, ", ")));
}

void gather(Optics optics, const TransferFunction& tf, double front, double back, double length, Gathered& ray) {
  switch (optics) {
    case Optics::absorption_emission: {
      const Radiance r = integrate(tf, front, back, length);
      const double light = std::exp(-ray.depth);
      for (std::size_t k = 0; k < 3; ++k)
        ray.color[k] += light * r.color[k];
      ray.depth -= std::log1p(-r.alpha);
      return;
    }
    case Optics::emission:
      emit(tf, front, back, length, ray);
      return;
    case Optics::absorption:
    case Optics::xray:
      absorb(tf, front, back, length, ray);
      return;
    case Optics::mip:
      if (length > 0.0) ray.peak = std::max({ray.peak, front, back});
      return;
  }
}

Radiance radiance(Optics optics, const TransferFunction& tf, const Gathered& ray) {
  const double alpha = -std::expm1(-ray.depth);
  switch (optics) {
    case Optics::absorption_emission:
      return {ray.color, alpha};
    case Optics::emission:
      return {ray.color, 0.0};
    case Optics::absorption:
      return {{}, alpha};
    case Optics::xray:
      return {{alpha, alpha, alpha}, alpha};
    case Optics::mip:
      if (ray.peak == -std::numeric_limits<double>::infinity()) return {};
      return {tf(ray.peak).color, 1.0};
  }
  return {};
}

}  // namespace spillikin::integrate
