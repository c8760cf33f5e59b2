// What the projection of cells gives: convex screen polygons, each behind one triangle of its cell's front and before
// one of its back (Max, Williams, Silva 2000, section II).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::project {

// What ends a region's segment of the ray: its triangle, the eye, or plane k of the planes that trim the cell (the
// view's clip planes first, then the half-spaces that the cell is kept in).
inline constexpr std::int32_t ends_at_triangle = -1;
inline constexpr std::int32_t ends_at_eye = -2;

// Polygons of any number of cells, one after the other, as structure of arrays; appended to by CellProjector, emptied
// by clear(), which keeps the storage. Polygon p has the vertices offset[p] .. offset[p + 1], counterclockwise seen
// with y upwards (that is, clockwise on the image, whose y runs downwards). Coordinates are pixels.
//
// Depths are those of the ray of (x, y) as in base/view.h; thickness is in world units along the ray. front and back
// are the scalar at the two depths. At the vertices all are exact but for rounding. Inside a polygon, 1/depth
// (perspective) or depth (parallel) is linear in x and y.
struct Regions {
  std::vector<std::uint32_t> offset{0};
  std::vector<mesh::Id> cell;
  // The triangles of mesh::surface(cell) that the untrimmed ray enters and leaves through. Where planar faces are
  // projected as one, the lowest triangle of that face.
  std::vector<std::uint32_t> front_triangle, back_triangle;
  std::vector<std::int32_t> front_end, back_end;

  std::vector<double> x, y;
  std::vector<double> front_depth, back_depth;
  std::vector<double> thickness;
  std::vector<double> front, back;

  std::size_t polygons() const { return cell.size(); }
  std::size_t vertices() const { return x.size(); }
  void clear() {
    offset.resize(1);
    cell.clear(), front_triangle.clear(), back_triangle.clear(), front_end.clear(), back_end.clear();
    x.clear(), y.clear(), front_depth.clear(), back_depth.clear(), thickness.clear(), front.clear(), back.clear();
  }

  void addVertex(double px, double py, double near, double far, double length, double near_value, double far_value) {
    x.push_back(px), y.push_back(py);
    front_depth.push_back(near), back_depth.push_back(far);
    thickness.push_back(length);
    front.push_back(near_value), back.push_back(far_value);
  }
  // Closes the polygon whose vertices were added last.
  void addPolygon(mesh::Id of, std::uint32_t front_of, std::uint32_t back_of, std::int32_t front_at = ends_at_triangle,
                  std::int32_t back_at = ends_at_triangle) {
    cell.push_back(of);
    front_triangle.push_back(front_of), back_triangle.push_back(back_of);
    front_end.push_back(front_at), back_end.push_back(back_at);
    offset.push_back(static_cast<std::uint32_t>(x.size()));
  }
};

}  // namespace spillikin::project
