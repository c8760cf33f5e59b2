// Meshes that the tests and benchmarks make: every generator takes a seed where it is random and has no file behind it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "spillikin/mesh/source.h"

namespace spillikin::tests {

// Delaunay tetrahedra of `points` random points in the unit cube, its corners among them: a convex mesh.
mesh::Source delaunayCube(std::size_t points, std::uint64_t seed);

// n^3 unit-cube cells: hexahedra, or each cut by the smallest-vertex rule into tetrahedra; inner points moved by up to
// `jitter` of a cell (hexahedra then have non-planar faces).
mesh::Source hexahedronGrid(std::size_t n, double jitter = 0.0, std::uint64_t seed = 1);
mesh::Source tetrahedronGrid(std::size_t n, double jitter = 0.0, std::uint64_t seed = 1);

// One cell of a VTK type with the given points.
mesh::Source oneCell(std::uint8_t type, const std::vector<Vec3>& points);

// Nonconvex meshes of tetrahedra: a thick spherical shell with an opening, two interlocked tori.
mesh::Source shell(std::size_t n);
mesh::Source interlockedTori(std::size_t n);

// Joins two sources, cells one after the other; arrays of the same name are joined, others dropped.
mesh::Source join(const mesh::Source& a, const mesh::Source& b);

// Adds a point array whose value is f at each point, or a cell array whose value is f at each cell's mean point.
void addPointArray(mesh::Source& source, const char* name, const std::function<double(const Vec3&)>& f);
void addCellArray(mesh::Source& source, const char* name, const std::function<double(const Vec3&)>& f);

}  // namespace spillikin::tests
