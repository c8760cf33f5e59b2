#include "spillikin/mesh/hull.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <algorithm>
#include <map>

#include "spillikin/mesh/predicates.h"

namespace spillikin::mesh {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangles = std::vector<std::array<Id, 3>>;

bool allInOnePlane(const PointPool& pool, std::span<const std::uint32_t> points) {
  std::vector<Point> all;
  for (const std::uint32_t p : points)
    all.emplace_back(pool[p].x, pool[p].y, pool[p].z);
  const auto b = std::find_if(all.begin(), all.end(), [&](const Point& p) { return p != all.front(); });
  if (b == all.end()) return true;
  const auto c = std::find_if(b, all.end(), [&](const Point& p) { return !CGAL::collinear(all.front(), *b, p); });
  if (c == all.end()) return true;
  return std::all_of(c, all.end(), [&](const Point& p) { return CGAL::coplanar(all.front(), *b, *c, p); });
}

Triangles hullTriangles(const PointPool& pool, std::span<const std::uint32_t> points) {
  std::map<std::array<double, 3>, Id> id;
  std::vector<Point> sites;
  for (const std::uint32_t p : points) {
    const Vec3& x = pool[p];
    if (id.try_emplace({x.x + 0.0, x.y + 0.0, x.z + 0.0}, p).second) sites.emplace_back(x.x, x.y, x.z);
  }
  CGAL::Surface_mesh<Point> hull;
  CGAL::convex_hull_3(sites.begin(), sites.end(), hull);
  Triangles triangles;
  for (const auto face : hull.faces()) {
    std::array<Id, 3> triangle{};
    std::size_t k = 0;
    for (const auto v : hull.vertices_around_face(hull.halfedge(face))) {
      const Point& p = hull.point(v);
      triangle[k++ % 3] = id.at({p.x() + 0.0, p.y() + 0.0, p.z() + 0.0});
    }
    triangles.push_back(triangle);
  }
  return triangles;
}

// The directed edges of a plane region whose reverse is not among them, chained to a polygon.
std::vector<Id> outline(const std::vector<std::array<Id, 3>>& region) {
  std::map<Id, Id> next;
  std::map<std::pair<Id, Id>, bool> inner;
  for (const auto& t : region) {
    for (std::size_t k = 0; k < 3; ++k)
      inner[{t[k], t[(k + 1) % 3]}] = true;
  }
  for (const auto& [edge, unused] : inner) {
    if (inner.count({edge.second, edge.first}) == 0) next[edge.first] = edge.second;
  }
  std::vector<Id> polygon{next.begin()->first};
  while (polygon.size() < next.size())
    polygon.push_back(next.at(polygon.back()));
  return polygon;
}

// Drops corners on the line of their neighbours: points of the set on an edge of the hull, in both faces there.
void dropStraightCorners(const PointPool& pool, std::vector<Id>& polygon) {
  const auto point = [&](std::size_t k) {
    const Vec3& p = pool[polygon[k % polygon.size()]];
    return Point(p.x, p.y, p.z);
  };
  std::vector<Id> corners;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    if (!CGAL::collinear(point(k + polygon.size() - 1), point(k), point(k + 1))) corners.push_back(polygon[k]);
  }
  polygon.swap(corners);
}

}  // namespace

Polygons convexHull(const PointPool& pool, std::span<const std::uint32_t> points) {
  Polygons polygons;
  if (points.size() < 4 || allInOnePlane(pool, points)) return polygons;
  const Triangles triangles = hullTriangles(pool, points);
  std::vector<bool> done(triangles.size(), false);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (done[i]) continue;
    const auto& t = triangles[i];
    Triangles region;
    for (std::size_t j = i; j < triangles.size(); ++j) {
      // On a convex hull, all that lies in one plane hangs together.
      const auto& u = triangles[j];
      const bool inside = std::all_of(u.begin(), u.end(),
                                      [&](Id v) { return orient3d(pool[t[0]], pool[t[1]], pool[t[2]], pool[v]) == 0; });
      if (!inside) continue;
      done[j] = true;
      region.push_back(u);
    }
    std::vector<Id> polygon = outline(region);
    dropStraightCorners(pool, polygon);
    polygons.add(polygon);
  }
  return polygons;
}

}  // namespace spillikin::mesh
