// The convex hull of a convex point set cell. Inside of building a mesh.
#pragma once

#include <span>

#include "spillikin/mesh/points.h"
#include "spillikin/mesh/polygons.h"

namespace spillikin::mesh {

// The hull's faces, outward, as ids of the pool; triangles that lie exactly in one plane are joined to one polygon, and
// points inside the hull or its faces belong to none. Empty when all points lie in one plane. Cost: that of CGAL's
// quickhull.
Polygons convexHull(const PointPool& pool, std::span<const std::uint32_t> points);

}  // namespace spillikin::mesh
