// One cell before a camera, and what its regions must satisfy: areas, volumes, scalars, and rays cast by brute force.
#pragma once

#include <vector>

#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/project/camera.h"
#include "spillikin/project/regions.h"

namespace spillikin::tests {

// One interval of a ray in a cell, in depths, with the scalar at both ends of the untrimmed interval.
struct RayInterval {
  double near = 0.0, far = 0.0;
  double front = 0.0, back = 0.0;
};

// The intervals of the ray of (x, y) inside `cell` (behind the eye too), in ascending depth, from its boundary
// triangles in plain double arithmetic: for rays that do not pass close to an edge.
std::vector<RayInterval> castRay(const mesh::Mesh& mesh, const mesh::Field& field, mesh::Id cell,
                                 const project::Camera& camera, double x, double y);

// The field at a depth, by linear continuation of the interval.
inline double along(const RayInterval& interval, double depth) {
  return interval.front + (depth - interval.near) / (interval.far - interval.near) * (interval.back - interval.front);
}

// Square pixels, positive counterclockwise with y upwards.
double area(const project::Regions& regions, std::size_t polygon);
double area(const project::Regions& regions);

// World volume of what the regions' thickness covers: exact for parallel views; in perspective by a quadrature of high
// order of the cube of depth over each polygon.
double volume(const project::Regions& regions, const project::Camera& camera);

// Area of the convex hull of the cell's corners on the screen.
double hullArea(const mesh::Mesh& mesh, mesh::Id cell, const project::Camera& camera);

double cellVolume(const mesh::Mesh& mesh, mesh::Id cell);

// True when (x, y) lies inside the polygon, away from its border by at least `margin` pixels.
bool contains(const project::Regions& regions, std::size_t polygon, double x, double y, double margin);

// The depth of the front or the back at a position inside a polygon.
double depthAt(const project::Regions& regions, const std::vector<double>& depth, std::size_t polygon, double x,
               double y, bool parallel);

// The scalar at a position inside a polygon that ends at one triangle.
double valueAt(const project::Regions& regions, const std::vector<double>& value, const std::vector<double>& depth,
               std::size_t polygon, double x, double y, bool parallel);

// A point field with the given values by vertex; a cell field constant in each.
mesh::Field pointField(std::vector<double> values);
mesh::Field linearField(const mesh::Mesh& mesh, const Vec3& gradient, double offset);
mesh::Field cellField(std::vector<double> values);

}  // namespace spillikin::tests
