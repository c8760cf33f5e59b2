#include "spillikin/composite/gl_transfer.h"

#include <algorithm>

namespace spillikin::composite {

namespace {

constexpr float before_all = -3.0e38F;
constexpr float after_all = 3.0e38F;

using integrate::ControlPoint;
using integrate::Optical;

Optical optical(const ControlPoint& point) {
  return {point.color, point.extinction};
}

Optical between(const ControlPoint& a, const ControlPoint& b, double value) {
  const double t = (value - a.value) / (b.value - a.value);
  Optical out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.color[i] = a.color[i] + t * (b.color[i] - a.color[i]);
  }
  out.extinction = a.extinction + t * (b.extinction - a.extinction);
  return out;
}

TransferPiece piece(float begin, float end, const Optical& low, const Optical& high, double unit) {
  TransferPiece out;
  const float width = end - begin;
  out.domain = {begin, end, begin, width > 0.0F ? 1.0F / width : 0.0F};
  for (std::size_t i = 0; i < 3; ++i) {
    out.low[i] = static_cast<float>(low.color[i]);
    out.rise[i] = static_cast<float>(high.color[i] - low.color[i]);
  }
  out.low[3] = static_cast<float>(low.extinction * unit);
  out.rise[3] = static_cast<float>((high.extinction - low.extinction) * unit);
  return out;
}

}  // namespace

float ScalarMap::operator()(double value) const {
  // Halves, because the range of finite values need not be finite.
  const double range = 0.5 * hi - 0.5 * lo;
  return range > 0.0 ? static_cast<float>((0.5 * value - 0.5 * lo) / range) : 0.0F;
}

std::vector<TransferPiece> transferPieces(const integrate::TransferFunction& tf, const ScalarMap& map, double unit) {
  std::vector<TransferPiece> out;
  const std::vector<ControlPoint>& points = tf.points();
  // Constant up to the first point, and from the last on.
  if (map.lo < points.front().value) {
    out.push_back(piece(0.0F, map(std::min(points.front().value, map.hi)), optical(points.front()),
                        optical(points.front()), unit));
  }
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const ControlPoint& a = points[i];
    const ControlPoint& b = points[i + 1];
    if (a.value == b.value || b.value <= map.lo || a.value > map.hi) {
      continue;
    }
    const double begin = std::max(a.value, map.lo);
    const double end = std::min(b.value, map.hi);
    out.push_back(piece(map(begin), map(end), between(a, b, begin), between(a, b, end), unit));
  }
  if (points.back().value <= map.hi) {
    const float begin = map(std::max(points.back().value, map.lo));
    out.push_back(piece(begin, begin, optical(points.back()), optical(points.back()), unit));
  }
  out.front().domain[0] = before_all;
  out.back().domain[1] = after_all;
  return out;
}

std::vector<std::array<float, 4>> searchStarts(const std::vector<TransferPiece>& pieces, std::size_t bins) {
  constexpr float rounding = 1e-3F;  // of a bin: a shader may find a scalar this far below its bin
  std::vector<std::array<float, 4>> out(bins);
  std::size_t k = 0;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const float begin = (static_cast<float>(bin) - rounding) / static_cast<float>(bins);
    while (k + 1 < pieces.size() && pieces[k + 1].domain[0] < begin) {
      ++k;
    }
    out[bin][0] = static_cast<float>(k);
  }
  return out;
}

}  // namespace spillikin::composite
