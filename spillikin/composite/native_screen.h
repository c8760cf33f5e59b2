// One frame as the tiles see it: vertices on the screen, scalars on a scale of their own, the transfer function as a
// table of linear pieces, clip planes along a pixel's ray.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/native_facets.h"

namespace spillikin::composite::native {

// A vertex as toScreen gives it (x and y times the depth in perspective, plain in a parallel view), its scalar on the
// frame's scale and the piece of the transfer function that it lies in.
struct Vertex {
  double x = 0.0, y = 0.0, w = 0.0;
  float value = 0.0F;
  std::uint32_t piece = 0;
};
static_assert(sizeof(Vertex) == 32);

// A vertex's place in the image, in pixels; x is not_a_place for a vertex that is not before the eye.
struct Place {
  float x = 0.0F, y = 0.0F;
};
inline constexpr float not_a_place = std::numeric_limits<float>::infinity();

// One linear piece of the transfer function, over the frame's scale of the scalar: quantity = at + slope * (value -
// anchor). Extinction is per world unit.
struct Piece {
  float anchor = 0.0F;
  float extinction = 0.0F, extinction_slope = 0.0F;
  std::array<float, 3> color{}, color_slope{};
  float end = 0.0F;  // where the next piece begins; huge for the last
  // Where the colour bends into the next piece but extinction runs straight on: by how much the colour's slope grows,
  // the last piece up to which that is so at every joint, and the sum of all bends before this piece.
  std::array<float, 3> kink{};
  std::int32_t reach = 0;
  float bent = 0.0F;
  float steepest = 0.0F;  // the largest of the colour's slopes, either way
};

// Nearness z is what fragments are compared by, larger is nearer: 1 / depth - z0 in perspective, z0 - depth in a
// parallel view. In both, a plane's nearness is linear in the pixel's coordinates. z0 lies amid the mesh, so that
// float keeps the differences.
struct Depths {
  bool parallel = false;
  double z0 = 0.0;
  double lo = 0.0, hi = 0.0;  // of all vertices, as depth

  double depth(double z) const { return parallel ? z0 - z : 1.0 / (z + z0); }
  double nearness(double w) const { return parallel ? z0 - w : 1.0 / w - z0; }
};

// A half-space along one ray: kept where at + slope * depth >= 0.
struct Limit {
  double at = 0.0, slope = 0.0;
};

class Screen {
 public:
  // Redoes what the frame's flags do not say is unchanged. Linear in the vertices, on all cores. Reuses its memory.
  void set(const Frame& frame);
  // The same inputs in another frame, which may be ordered by now.
  void moveTo(const Frame& frame) { frame_ = &frame; }

  const Frame& frame() const { return *frame_; }
  const mesh::Mesh& mesh() const { return frame_->mesh; }
  bool parallel() const { return depths_.parallel; }
  const Depths& depths() const { return depths_; }
  const Vertex& vertex(mesh::Id id) const { return vertices_[id]; }
  const Vertex* vertices() const { return vertices_.data(); }
  const Place* places() const { return places_.data(); }
  const std::vector<Piece>& pieces() const { return pieces_; }
  // The same number by number: that at offset k of piece i is float k * pieceStride() + i. There is room for vectors.
  const std::vector<float>& pieceColumns() const { return piece_columns_; }
  std::size_t pieceStride() const { return piece_stride_; }
  // The frame's scale of the scalar, and the piece that a value lies in: at a jump, the upper one.
  double scaled(double value) const { return (value - value_lo_) * value_scale_; }
  std::uint32_t piece(double value) const;
  // Of a cell field, per cell; empty for a point field.
  const std::vector<float>& cell_values() const { return cell_values_; }
  const std::vector<std::uint32_t>& cell_pieces() const { return cell_pieces_; }

  const Facets& facets() const { return facets_; }

  // A half-space along the ray of image position (x, y).
  Limit limit(const sort::HalfSpace& keep, double x, double y) const;
  // The view's clip planes as half-spaces.
  const std::vector<sort::HalfSpace>& clips() const { return clips_; }

 private:
  void setScale(const Frame& frame);
  void setKinks(const integrate::TransferFunction& transfer_function);
  void setPieceColumns();
  void setValues(const Frame& frame);
  void setVertices(const Frame& frame);
  void setClips(const Frame& frame);

  const Frame* frame_ = nullptr;
  Depths depths_;
  Facets facets_;
  std::vector<Vertex> vertices_;
  std::vector<Place> places_;
  std::vector<Piece> pieces_;
  std::vector<float> piece_columns_;
  std::size_t piece_stride_ = 0;
  std::vector<double> breaks_;
  double value_lo_ = 0.0, value_scale_ = 1.0;
  std::vector<float> cell_values_;
  std::vector<std::uint32_t> cell_pieces_;
  std::vector<sort::HalfSpace> clips_;
};

}  // namespace spillikin::composite::native
