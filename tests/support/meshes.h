// Meshes that the tests and benchmarks make: every generator takes a seed where it is random and has no file behind it.
// All carry the smooth, nowhere zero point array "value" (see value.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "spillikin/mesh/source.h"

namespace spillikin::tests {

// Delaunay tetrahedra of the points, no two of them at one place: a convex mesh.
mesh::Source delaunay(const std::vector<Vec3>& points);
// Delaunay tetrahedra of `points` random points in the unit cube, its corners among them: a convex mesh.
mesh::Source delaunayCube(std::size_t points, std::uint64_t seed);

// n^3 cells of side 1 that fill the cube [0, n]^3: hexahedra, or each cut by the smallest-vertex rule into six
// tetrahedra (6 n^3 of them); inner points moved by up to `jitter` of a cell along each axis (hexahedra then have
// non-planar faces; below 0.2 no tetrahedron turns over).
mesh::Source hexahedronGrid(std::size_t n, double jitter = 0.0, std::uint64_t seed = 1);
mesh::Source tetrahedronGrid(std::size_t n, double jitter = 0.0, std::uint64_t seed = 1);
// The same of columns of hexahedra, of pairs of wedges and of six pyramids around a point within, side by side.
mesh::Source mixedGrid(std::size_t n, double jitter = 0.0, std::uint64_t seed = 1);

// One cell of a VTK type with the given points; a polyhedron (42) is their convex hull, coplanar points as one polygon.
mesh::Source oneCell(std::uint8_t type, const std::vector<Vec3>& points);

// Nonconvex meshes of tetrahedra: a thick spherical shell, radii 0.6 and 1, with an opening towards +z (about
// 33 n^2 max(1, n/4) tetrahedra); two interlocked tori of radius 1 and tube 0.3 (96 n^3 tetrahedra).
mesh::Source shell(std::size_t n);
mesh::Source interlockedTori(std::size_t n);

// A closed ring of `cells` prisms around the z axis, from radius 0.5 to 1 and z from -0.25 to 0.25, each sharing a
// triangle with the next. The triangles are twisted by up to `twist` radians, so that they lean over one another the
// whole way round: a visibility cycle from all directions whose angle with the axis has a tangent below 4 sin(twist).
mesh::Source twistedRing(std::size_t cells, double twist);

// Curved hexahedra. A bar [-1/2, 1/2]^2 x [0, 3] of n x n x 3 n cells, turned about its axis by `turn` radians from end
// to end; the ball of radius 1 as an n^3 grid whose cells bulge with it.
mesh::Source twistedBar(std::size_t n, double turn);
mesh::Source curvedBall(std::size_t n);

// Joins two sources, cells one after the other; arrays of the same name are joined, others dropped.
mesh::Source join(const mesh::Source& a, const mesh::Source& b);

// Adds a point array whose value is f at each point, or a cell array whose value is f at each cell's mean point.
void addPointArray(mesh::Source& source, const char* name, const std::function<double(const Vec3&)>& f);
void addCellArray(mesh::Source& source, const char* name, const std::function<double(const Vec3&)>& f);

}  // namespace spillikin::tests
