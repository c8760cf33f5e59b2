// The paper's hardware mode: projected polygons whose look is computed at the vertices.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/gl_frame.h"
#include "spillikin/project/cell_projection.h"

namespace spillikin::composite {

// A corner of a triangle. u and v, in parts of `opacity_range`, are thickness and mean extinction, scaled for each
// polygon so that both make use of the texture.
struct PolygonVertex {
  float x = 0.0F, y = 0.0F, u = 0.0F, v = 0.0F, r = 0.0F, g = 0.0F, b = 0.0F, unused = 0.0F;
};

// The texture 1 - exp(-u v) for u and v up to opacity_range: optical depths up to 25, and an error below 2e-4.
inline constexpr std::size_t opacity_size = 1024;
inline constexpr double opacity_range = 5.0;

// Projects the cells of a run of the order and appends their polygons as triangles, back to front; `project` is one
// thread's own. Returns the number of polygons.
std::size_t appendPolygons(const Frame& frame, const FrameMap& map, std::size_t first, std::size_t end,
                           project::CellProjector& projector, project::Regions& regions,
                           std::vector<PolygonVertex>& out);

}  // namespace spillikin::composite
