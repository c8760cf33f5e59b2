// A field and a transfer function as the shaders read them. What has not changed since the frame before is kept.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/gl_program.h"
#include "spillikin/composite/gl_transfer.h"

namespace spillikin::composite {

inline bool cellField(const Frame& frame) {
  return frame.field.association == mesh::Association::cells;
}

class GlLook {
 public:
  // Lengths are in `unit` (FrameMap::unit). Linear in the field when that has changed.
  void prepare(const Gl& gl, const Frame& frame, double unit);
  // For a frame that does without: drops what does not belong to it.
  void forget(const Frame& frame);
  void bind(const Gl& gl) const;
  void destroy(const Gl& gl);

  // Per vertex, on [0, 1]; empty for a cell field.
  const std::vector<float>& scalar() const { return scalar_; }
  // Colour and extinction of a cell, for a cell field; else zeros.
  std::array<float, 4> paint(mesh::Id cell) const { return paint_.empty() ? std::array<float, 4>{} : paint_[cell]; }
  std::int32_t pieces() const { return pieces_; }
  // Of a point field that is not pre-integrated: the largest over its range, per `unit`.
  double max_extinction() const { return max_extinction_; }

 private:
  void mapScalars(const Frame& frame);
  void paintCells(const Frame& frame);
  void sendPieces(const Gl& gl, const Frame& frame);
  void sendTable(const Gl& gl, const Frame& frame);

  double unit_ = 0.0;
  ScalarMap scalar_map_;
  std::vector<float> scalar_;
  std::vector<std::array<float, 4>> paint_;
  GlTexels piece_buffer_;
  std::int32_t pieces_ = 0;
  double max_extinction_ = 0.0;
  GLuint table_ = 0;  // 3D texture
  // Which of the above belong to the field and transfer function at hand.
  bool has_scalars_ = false, has_paint_ = false, has_pieces_ = false, has_table_ = false;
};

}  // namespace spillikin::composite
