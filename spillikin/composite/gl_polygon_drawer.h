// Projected polygons with their look at the vertices (Max, Williams, Silva 2000, section II: the hardware mode).
#pragma once

#include <array>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/gl_cells.h"
#include "spillikin/composite/gl_polygons.h"
#include "spillikin/composite/gl_program.h"

namespace spillikin::composite {

class GlPolygonDrawer {
 public:
  explicit GlPolygonDrawer(const Gl& gl);
  void destroy();

  // Before the first window of a frame.
  void prepare(const Frame& frame);
  // Draws the whole order into the part of the image that is bound. The uniform block must be bound.
  void draw(const Frame& frame, const FrameMap& map, FrameStats& stats);

 private:
  static constexpr std::size_t batch_chunks = 16;  // of chunk_cells cells each

  void drawChunk(const std::vector<PolygonVertex>& corners);

  const Gl& gl_;
  GLuint vertex_array_ = 0, program_ = 0;
  GLuint opacity_ = 0;  // texture
  GlBuffer buffer_;
  std::vector<Vec3> screen_;
  std::array<std::vector<PolygonVertex>, batch_chunks> corners_;
};

}  // namespace spillikin::composite
