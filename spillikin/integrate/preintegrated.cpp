#include "spillikin/integrate/preintegrated.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "spillikin/base/error.h"
#include "spillikin/integrate/pieces.h"

namespace spillikin::integrate {

namespace {

// Stands for an infinite optical depth.
constexpr double opaque = 1e12;

// Mean extinction, and the mean colour that is seen where extinction hides nothing, by extinction: the limit of short
// segments.
Optical shortLimit(const TransferFunction& tf, double front, double back) {
  Optical sum;
  forEachPiece(tf, front, back, 1.0, [&](const Optical& a, const Optical& b, double part) {
    sum.extinction += 0.5 * part * (a.extinction + b.extinction);
    const std::array<double, 3> glow = meanGlow(a, b);
    for (std::size_t k = 0; k < 3; ++k)
      sum.color[k] += part * glow[k];
    return true;
  });
  return sum;  // colour times extinction
}

void check(double lo, double hi, std::size_t n, std::size_t layers) {
  if (!std::isfinite(lo) || !std::isfinite(hi) || lo > hi) {
    throw Error(
        fmt::format("pre-integrated table: the range {},{} must be two finite numbers, the lower one first", lo, hi));
  }
  constexpr std::size_t most_bytes = std::size_t{1} << 30U;
  if (n < 2 || layers < 2) throw Error("pre-integrated table: it needs at least 2 scalars and 2 lengths");
  if (n > 65536 || layers > 65536 || n * n > most_bytes / 16 / layers) {
    throw Error(fmt::format("pre-integrated table: {0} x {0} x {1} texels pass 1 GiB; take fewer", n, layers));
  }
}

// Where x in [0, 1] falls among `count` samples: the sample below and the part of the way to the next.
struct Place {
  std::size_t below;
  double part;
  Place(double x, std::size_t count) {
    const double at = std::clamp(x, 0.0, 1.0) * static_cast<double>(count - 1);
    below = std::min(static_cast<std::size_t>(at), count - 2);
    part = at - static_cast<double>(below);
  }
};

}  // namespace

Preintegrated::Preintegrated(const TransferFunction& tf, double lo, double hi, std::size_t n, std::size_t layers)
    : n_(n), layers_(layers), lo_(lo), hi_(hi) {
  check(lo, hi, n, layers);
  texels_.resize(4 * n * n * layers);
  const auto scalar = [&](std::size_t i) {
    return std::lerp(lo, hi, static_cast<double>(i) / static_cast<double>(n - 1));
  };
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) {
      const Optical thin = shortLimit(tf, scalar(i), scalar(j));
      for (std::size_t k = 0; k < layers; ++k) {
        float* texel = &texels_[4 * ((k * n + j) * n + i)];
        const double u = static_cast<double>(k) / static_cast<double>(layers - 1);
        std::array<double, 3> seen = thin.color;
        if (k > 0 && thin.extinction > 0.0) {
          const double length = std::min((k + 1 < layers ? u / (1.0 - u) : opaque) / thin.extinction, 1e300);
          const Radiance r = integrate(tf, scalar(i), scalar(j), length);
          for (std::size_t c = 0; c < 3; ++c)
            seen[c] = r.color[c] / r.alpha * thin.extinction;
        }
        for (std::size_t c = 0; c < 3; ++c)
          texel[c] = static_cast<float>(seen[c]);
        texel[3] = static_cast<float>(thin.extinction);
      }
    }
  }
}

Radiance Preintegrated::operator()(double front, double back, double length) const {
  if (!(length > 0.0)) return {};
  const double width = hi_ > lo_ ? hi_ - lo_ : 1.0;
  const Place x((front - lo_) / width, n_);
  const Place y((back - lo_) / width, n_);
  const std::array<double, 4> across = {(1.0 - x.part) * (1.0 - y.part), x.part * (1.0 - y.part),
                                        (1.0 - x.part) * y.part, x.part * y.part};
  // Channel c of the table in one layer.
  const auto read = [&](std::size_t layer, std::size_t c) {
    const float* texel = &texels_[4 * ((layer * n_ + y.below) * n_ + x.below) + c];
    return across[0] * texel[0] + across[1] * texel[4] + across[2] * texel[4 * n_] + across[3] * texel[4 * n_ + 4];
  };
  Radiance r;
  const double extinction = read(0, 3);
  if (!(extinction > 0.0)) return r;
  const double depth = extinction * length;
  r.alpha = -std::expm1(-depth);
  const Place z(depth < opaque ? depth / (1.0 + depth) : 1.0, layers_);
  for (std::size_t c = 0; c < 3; ++c) {
    r.color[c] = r.alpha / extinction * ((1.0 - z.part) * read(z.below, c) + z.part * read(z.below + 1, c));
  }
  return r;
}

Radiance average(const TransferFunction& tf, double front, double back, double length) {
  Radiance r;
  if (!(length > 0.0)) return r;
  const Optical a = tf(front);
  const Optical b = tf(back);
  r.alpha = -std::expm1(-0.5 * length * (a.extinction + b.extinction));
  for (std::size_t k = 0; k < 3; ++k)
    r.color[k] = r.alpha * 0.5 * (a.color[k] + b.color[k]);
  return r;
}

VertexLook vertexLook(const TransferFunction& tf, double front, double back, double length) {
  const Optical a = tf(front);
  VertexLook look{a.color, 0.5 * (a.extinction + tf(back).extinction)};
  const Radiance r = integrate(tf, front, back, length);
  if (r.alpha > 0.0) {
    for (std::size_t k = 0; k < 3; ++k)
      look.color[k] = r.color[k] / r.alpha;
  }
  return look;
}

std::vector<float> opacityTexture(std::size_t size, double largest) {
  std::vector<float> texture;
  texture.reserve(size * size);
  const double step = size > 1 ? largest / static_cast<double>(size - 1) : 0.0;
  for (std::size_t j = 0; j < size; ++j) {
    for (std::size_t i = 0; i < size; ++i) {
      texture.push_back(
          static_cast<float>(-std::expm1(-step * static_cast<double>(i) * step * static_cast<double>(j))));
    }
  }
  return texture;
}

}  // namespace spillikin::integrate
