#include "spillikin/composite/native_screen.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

namespace spillikin::composite::native {

namespace {

using Range = tbb::blocked_range<std::size_t>;
constexpr std::size_t grain = 1 << 14;

// A camera farther from the mesh than this share of its farthest depth keeps depths relative to the mesh's middle;
// nearer, or inside, plain inverse depth is the finer scale.
constexpr double far_share = 0.25;

struct Extent {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();
};

}  // namespace

void Screen::set(const Frame& frame) {
  frame_ = &frame;
  if (!frame.same_mesh || vertices_.empty()) facets_.set(frame.mesh);
  const bool same_values = frame.same_mesh && frame.same_field && frame.same_transfer_function && !vertices_.empty();
  if (!same_values) {
    setScale(frame);
    setValues(frame);
  }
  setVertices(frame);
  setClips(frame);
}

std::uint32_t Screen::piece(double value) const {
  return static_cast<std::uint32_t>(std::upper_bound(breaks_.begin(), breaks_.end(), value) - breaks_.begin());
}

// Piece k runs from point k - 1 to point k; the first and the last are constant.
void Screen::setScale(const Frame& frame) {
  const auto& points = frame.transfer_function.points();
  const double span = frame.field.hi - frame.field.lo;
  value_lo_ = frame.field.lo;
  value_scale_ = span > 0.0 && std::isfinite(1.0 / span) ? 1.0 / span : 1.0;
  breaks_.clear();
  pieces_.assign(points.size() + 1, Piece{});
  for (std::size_t k = 0; k <= points.size(); ++k) {
    const integrate::ControlPoint& a = points[k == 0 ? 0 : k - 1];
    const integrate::ControlPoint& b = points[std::min(k, points.size() - 1)];
    const double begin = scaled(a.value);
    const double length = scaled(b.value) - begin;
    // The anchor lies where the mesh's values are, so that small differences from it are exact.
    const double anchor = length > 0.0 ? std::clamp(0.0, begin, begin + length) : std::clamp(begin, 0.0, 1.0);
    const auto at = [&](double u, double v) { return length > 0.0 ? u + (v - u) * ((anchor - begin) / length) : u; };
    const auto slope = [&](double u, double v) { return length > 0.0 ? (v - u) / length : 0.0; };
    Piece& piece = pieces_[k];
    piece.anchor = static_cast<float>(anchor);
    piece.extinction = static_cast<float>(at(a.extinction, b.extinction));
    piece.extinction_slope = static_cast<float>(slope(a.extinction, b.extinction));
    for (std::size_t c = 0; c < 3; ++c) {
      piece.color[c] = static_cast<float>(at(a.color[c], b.color[c]));
      piece.color_slope[c] = static_cast<float>(slope(a.color[c], b.color[c]));
      piece.steepest = std::max(piece.steepest, std::abs(piece.color_slope[c]));
    }
    piece.end = k < points.size() ? static_cast<float>(scaled(points[k].value)) : std::numeric_limits<float>::max();
    if (k < points.size()) breaks_.push_back(points[k].value);
  }
  setKinks(frame.transfer_function);
  setPieceColumns();
}

// Joint k lies between pieces k and k + 1, at points[k].
void Screen::setKinks(const integrate::TransferFunction& transfer_function) {
  constexpr double straight = 1e-7;  // of the largest extinction over the frame's scale: float's own rounding
  const std::vector<integrate::ControlPoint>& points = transfer_function.points();
  const double most = transfer_function.densest();
  const auto slope = [&](std::size_t piece, double at, double next) {
    return (next - at) / (scaled(points[piece].value) - scaled(points[piece - 1].value));
  };
  const auto wide = [&](std::size_t piece) {  // neither a jump nor one of the two ends
    return piece > 0 && piece < points.size() && scaled(points[piece].value) > scaled(points[piece - 1].value);
  };
  for (std::size_t k = pieces_.size(); k-- > 0;) {
    pieces_[k].reach = static_cast<std::int32_t>(k);
    if (!wide(k) || !wide(k + 1)) continue;
    const double before = slope(k, points[k - 1].extinction, points[k].extinction);
    const double after = slope(k + 1, points[k].extinction, points[k + 1].extinction);
    if (std::abs(after - before) <= straight * most) pieces_[k].reach = pieces_[k + 1].reach;
  }
  for (std::size_t k = 0; k + 1 < pieces_.size(); ++k) {
    Piece& piece = pieces_[k];
    Piece& next = pieces_[k + 1];
    float bend = 0.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      piece.kink[c] = next.color_slope[c] - piece.color_slope[c];
      bend = std::max(bend, std::abs(piece.kink[c]));
    }
    next.bent = piece.bent + (piece.reach > static_cast<std::int32_t>(k) ? bend : 0.0F);
  }
}

void Screen::setPieceColumns() {
  constexpr std::size_t numbers = sizeof(Piece) / sizeof(float);
  static_assert(sizeof(Piece) == numbers * sizeof(float));
  constexpr std::size_t room = 32;  // numbers in the two longest vectors
  piece_stride_ = std::max(pieces_.size(), room);
  piece_columns_.assign(numbers * piece_stride_, 0.0F);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    for (std::size_t k = 0; k < numbers; ++k) {
      const char* number = reinterpret_cast<const char*>(&pieces_[i]) + k * sizeof(float);
      std::memcpy(&piece_columns_[k * piece_stride_ + i], number, sizeof(float));
    }
  }
}

void Screen::setValues(const Frame& frame) {
  const std::vector<double>& values = frame.field.values;
  vertices_.resize(frame.mesh.points.size());
  const bool of_cells = frame.field.association == mesh::Association::cells;
  cell_values_.resize(of_cells ? values.size() : 0);
  cell_pieces_.resize(of_cells ? values.size() : 0);
  tbb::parallel_for(Range(0, values.size(), grain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const bool known = std::isfinite(values[i]);  // else a cell that shows it is hidden
      const float value = known ? static_cast<float>(scaled(values[i])) : 0.0F;
      const std::uint32_t k = known ? piece(values[i]) : 0;
      if (of_cells) {
        cell_values_[i] = value;
        cell_pieces_[i] = k;
      } else {
        vertices_[i].value = value;
        vertices_[i].piece = k;
      }
    }
  });
}

void Screen::setVertices(const Frame& frame) {
  const std::vector<Vec3>& points = frame.mesh.points;
  const project::Camera& camera = frame.camera;
  depths_.parallel = camera.parallel();
  places_.resize(points.size());
  const Extent extent = tbb::parallel_reduce(
      Range(0, points.size(), grain), Extent{},
      [&](const Range& range, Extent e) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          const Vec3 p = camera.toScreen(points[i]);
          Vertex& v = vertices_[i];
          v.x = p.x;
          v.y = p.y;
          v.w = p.z;
          const double scale = depths_.parallel ? 1.0 : 1.0 / p.z;
          const bool before = depths_.parallel || p.z > 0.0;
          places_[i] = {before ? static_cast<float>(p.x * scale) : not_a_place, static_cast<float>(p.y * scale)};
          e.lo = std::min(e.lo, p.z);
          e.hi = std::max(e.hi, p.z);
        }
        return e;
      },
      [](const Extent& a, const Extent& b) {
        return Extent{std::min(a.lo, b.lo), std::max(a.hi, b.hi)};
      });
  depths_.lo = extent.lo;
  depths_.hi = extent.hi;
  if (depths_.parallel) {
    depths_.z0 = 0.5 * (extent.lo + extent.hi);
  } else {
    depths_.z0 = extent.lo > far_share * extent.hi ? 0.5 * (1.0 / extent.lo + 1.0 / extent.hi) : 0.0;
  }
}

void Screen::setClips(const Frame& frame) {
  clips_.clear();
  for (const ClipPlane& clip : frame.camera.view().clips) {
    clips_.push_back({clip.normal, -glm::dot(clip.normal, clip.point)});
  }
}

Limit Screen::limit(const sort::HalfSpace& keep, double x, double y) const {
  const project::Camera& camera = frame_->camera;
  return {glm::dot(keep.normal, camera.origin(x, y)) + keep.offset, glm::dot(keep.normal, camera.direction(x, y))};
}

}  // namespace spillikin::composite::native
