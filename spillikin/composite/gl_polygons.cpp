#include "spillikin/composite/gl_polygons.h"

#include <algorithm>
#include <cmath>

#include "spillikin/integrate/preintegrated.h"

namespace spillikin::composite {

namespace {

// The polygon's vertices with their looks, u and v still unscaled.
void lookAt(const Frame& frame, const FrameMap& map, const project::Regions& regions, std::size_t polygon,
            std::vector<PolygonVertex>& out) {
  out.clear();
  for (std::uint32_t i = regions.offset[polygon]; i < regions.offset[polygon + 1]; ++i) {
    const double length = regions.thickness[i];
    const integrate::VertexLook look =
        integrate::vertexLook(frame.transfer_function, regions.front[i], regions.back[i], length);
    out.push_back({static_cast<float>(regions.x[i] - map.center_x()), static_cast<float>(regions.y[i] - map.center_y()),
                   static_cast<float>(length / map.unit()), static_cast<float>(look.mean_extinction * map.unit()),
                   static_cast<float>(look.color[0]), static_cast<float>(look.color[1]),
                   static_cast<float>(look.color[2]), 0.0F});
  }
}

// Only the product of thickness and extinction counts: both get the same largest value.
void balance(std::vector<PolygonVertex>& polygon) {
  float longest = 0.0F;
  float densest = 0.0F;
  for (const PolygonVertex& v : polygon) {
    longest = std::max(longest, v.u);
    densest = std::max(densest, v.v);
  }
  const bool seen = longest > 0.0F && densest > 0.0F;
  const float scale = seen ? std::sqrt(densest / longest) : 0.0F;
  constexpr auto range = static_cast<float>(opacity_range);
  for (PolygonVertex& v : polygon) {
    v.u *= scale / range;
    v.v = seen ? v.v / (scale * range) : 0.0F;
  }
}

}  // namespace

std::size_t appendPolygons(const Frame& frame, const FrameMap& map, std::size_t first, std::size_t end,
                           project::CellProjector& projector, project::Regions& regions,
                           std::vector<PolygonVertex>& out) {
  const sort::Cuts& cuts = frame.order.cuts;
  std::size_t cut = cuts.first(first);
  regions.clear();
  for (std::size_t entry = first; entry < end; ++entry) {
    const mesh::Id cell = frame.order.cells[entry];
    while (cut < cuts.size() && cuts[cut].entry < entry) {
      ++cut;
    }
    if (!frame.draws(cell)) {
      continue;
    }
    const bool is_cut = cut < cuts.size() && cuts[cut].entry == entry;
    projector(cell, frame.field, regions, is_cut ? cuts[cut].keep : std::span<const sort::HalfSpace>());
  }
  std::vector<PolygonVertex> polygon;
  for (std::size_t p = 0; p < regions.polygons(); ++p) {
    lookAt(frame, map, regions, p, polygon);
    balance(polygon);
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      out.insert(out.end(), {polygon[0], polygon[i - 1], polygon[i]});
    }
  }
  return regions.polygons();
}

}  // namespace spillikin::composite
