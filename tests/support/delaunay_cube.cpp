// Alone in its file: CGAL's triangulation takes longer to compile than all other generators together.
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <random>
#include <utility>
#include <vector>

#include "tests/support/meshes.h"
#include "tests/support/value.h"

namespace spillikin::tests {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_3<std::uint32_t, Kernel>;
using Cell = CGAL::Delaunay_triangulation_cell_base_3<Kernel>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<Vertex, Cell>>;

}  // namespace

mesh::Source delaunay(const std::vector<Vec3>& points) {
  mesh::Source source;
  source.name = "delaunay";
  source.points = points;
  std::vector<std::pair<Kernel::Point_3, std::uint32_t>> input;
  input.reserve(source.points.size());
  for (const Vec3& p : source.points) {
    input.emplace_back(Kernel::Point_3(p.x, p.y, p.z), static_cast<std::uint32_t>(input.size()));
  }
  const Delaunay triangulation(input.begin(), input.end());

  source.offsets.push_back(0);
  for (const auto cell : triangulation.finite_cell_handles()) {
    for (int k = 0; k < 4; ++k) {
      source.connectivity.push_back(cell->vertex(k)->info());
    }
    source.offsets.push_back(source.connectivity.size());
  }
  source.types.assign(source.offsets.size() - 1, mesh::vtk_cell::tetra);
  addPointArray(source, "value", [](const Vec3& p) { return smoothValue(p); });
  return source;
}

mesh::Source delaunayCube(std::size_t points, std::uint64_t seed) {
  std::vector<Vec3> at;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (unsigned corner = 0; corner < 8; ++corner) {
    at.emplace_back(corner & 1U, (corner >> 1U) & 1U, (corner >> 2U) & 1U);
  }
  while (at.size() < points) {
    const double x = uniform(random);
    const double y = uniform(random);
    const double z = uniform(random);
    at.emplace_back(x, y, z);
  }
  mesh::Source source = delaunay(at);
  source.name = "delaunay cube";
  return source;
}

}  // namespace spillikin::tests
