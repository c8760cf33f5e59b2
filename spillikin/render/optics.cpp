#include "spillikin/render/optics.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace spillikin::render {

namespace {

using integrate::Optics;
using integrate::TransferFunction;

constexpr std::size_t grain = 16384;  // pixels

TransferFunction shaded(const TransferFunction& look, double shade) {
  auto points = look.points();
  for (auto& p : points)
    p.color = {shade, shade, shade};
  return TransferFunction(std::move(points));
}

}  // namespace

Rendition rendition(Optics optics, const TransferFunction& look, double extent) {
  switch (optics) {
    case Optics::absorption_emission:
      return {look, !look.oneColor()};
    case Optics::absorption:
      return {shaded(look, 0.0), false};
    case Optics::xray:
      return {shaded(look, 1.0), false};
    case Optics::mip:
      return {look, false, true};
    case Optics::emission:
      break;
  }
  const double depth = look.densest() * extent;
  // Powers of two change no digit.
  const double thin = depth > 0.0 && std::isfinite(depth) ? std::exp2(std::floor(std::log2(hidden / depth))) : 1.0;
  return {look.scaled(thin), false, false, 1.0 / thin};
}

void develop(const Rendition& rendition, Image& image) {
  if (rendition.gain == 1.0) return;
  const auto gain = static_cast<float>(rendition.gain);
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, image.rgba.size() / 4, grain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      float* pixel = image.rgba.data() + 4 * i;
      for (std::size_t k = 0; k < 3; ++k)
        pixel[k] *= gain;
      pixel[3] = 0.0F;
    }
  });
}

}  // namespace spillikin::render
