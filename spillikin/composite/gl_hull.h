// Where on the screen the fragments of a cell may lie: a convex quadrilateral that covers its projection.
//
// The rasterizer only proposes pixels; which of them the cell covers, and from where to where, the fragment shader
// decides from the vertices. The cover may therefore be too large, never too small.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "spillikin/composite/gl_frame.h"

namespace spillikin::composite {

// How far, in pixels, a cover reaches beyond the projection: more than the rasterizer's snapping of vertices (1/256)
// together with the rounding of positions (2e-3 at 16384 pixels).
inline constexpr float cover_margin = 1.0F / 32.0F;

// The part of the image being drawn, in image positions from its centre; corners lie between pixels.
struct Window {
  float x0 = 0.0F, y0 = 0.0F, x1 = 0.0F, y1 = 0.0F;
};

struct ScreenPoint {
  float x = 0.0F, y = 0.0F;
};

// Corners counterclockwise (x to the right, y down taken as up); the last two are equal when three are enough.
using Cover = std::array<ScreenPoint, 4>;

// Reused from cell to cell.
struct CoverScratch {
  std::vector<ScreenPoint> points, hull;
};

// False when no centre of a pixel of the window can be covered. Vertices may lie behind the eye.
// Cost: n log n in the vertices.
bool cover(std::span<const ScreenVertex> vertices, const FrameMap& map, const Window& window, CoverScratch& scratch,
           Cover& out);

}  // namespace spillikin::composite
