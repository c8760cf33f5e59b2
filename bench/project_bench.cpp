// Projection: cells to screen polygons, by each of its ways, on one core; and the points of a mesh on the screen.
// Reported per second: cells, and polygons that came of them.
#include <benchmark/benchmark.h>

#include <glm/geometric.hpp>
#include <vector>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/subdivide.h"
#include "spillikin/project/cell_projection.h"
#include "tests/support/meshes.h"

namespace {

using namespace spillikin;

constexpr std::size_t cells_across = 24;

mesh::Field firstCoordinate(const mesh::Mesh& mesh) {
  mesh::Field field;
  for (const Vec3& p : mesh.points) {
    field.values.push_back(p.x);
  }
  return field;
}

// From outside, the whole grid in view; or, with `inside`, from its middle.
View viewOf(double side, bool inside = false) {
  View view;
  view.target = Vec3(0.5 * side);
  view.eye = view.target + side * (inside ? 0.01 : 1.0) * Vec3(1.0, 1.4, 2.6);
  view.view_angle = inside ? 90.0 : 40.0;
  return view;
}

void projectAll(benchmark::State& state, const mesh::Mesh& mesh, const View& view, project::Faces faces) {
  const mesh::Field field = firstCoordinate(mesh);
  const project::Camera camera(view);
  std::vector<Vec3> screen;
  project::screenPoints(mesh, camera, screen);
  project::CellProjector projector(mesh, camera, screen, faces);
  project::Regions regions;
  std::size_t polygons = 0;
  for (auto _ : state) {
    polygons = 0;
    for (mesh::Id cell = 0; cell < mesh.cell_count(); ++cell) {
      regions.clear();
      projector(cell, field, regions);
      polygons += regions.polygons();
    }
    benchmark::DoNotOptimize(polygons);
  }
  const auto per_second = benchmark::Counter::kIsIterationInvariantRate;
  state.counters["cells"] = benchmark::Counter(static_cast<double>(mesh.cell_count()), per_second);
  state.counters["polygons"] = benchmark::Counter(static_cast<double>(polygons), per_second);
}

void projectTetrahedra(benchmark::State& state) {
  projectAll(state, mesh::build(tests::tetrahedronGrid(cells_across, 0.15)), viewOf(cells_across),
             project::Faces::triangles);
}

void projectHexahedra(benchmark::State& state) {
  const auto faces = state.range(0) == 0 ? project::Faces::planar : project::Faces::triangles;
  projectAll(state, mesh::build(tests::hexahedronGrid(cells_across)), viewOf(cells_across), faces);
}

void projectCurvedHexahedra(benchmark::State& state) {
  projectAll(state, mesh::build(tests::hexahedronGrid(cells_across, 0.05)), viewOf(cells_across),
             project::Faces::triangles);
}

// The peer: the same hexahedra as the tetrahedra of their consistent subdivision.
void projectSubdividedHexahedra(benchmark::State& state) {
  const mesh::Mesh mesh = mesh::build(tests::hexahedronGrid(cells_across));
  const mesh::Mesh cut = mesh::tetrahedralize(mesh).mesh;
  projectAll(state, cut, viewOf(cells_across), project::Faces::triangles);
}

// Every tetrahedron the general way: what the classes save.
void projectTetrahedraTheGeneralWay(benchmark::State& state) {
  const mesh::Mesh mesh = mesh::build(tests::tetrahedronGrid(cells_across, 0.15));
  const mesh::Field field = firstCoordinate(mesh);
  const project::Camera camera(viewOf(cells_across));
  std::vector<Vec3> screen;
  project::screenPoints(mesh, camera, screen);
  project::CellOnScreen on_screen;
  project::PolyhedronProjection polyhedron;
  project::Regions regions;
  for (auto _ : state) {
    for (mesh::Id cell = 0; cell < mesh.cell_count(); ++cell) {
      regions.clear();
      on_screen.setCorners(mesh, camera, screen, field, cell);
      on_screen.setTriangles(mesh);
      benchmark::DoNotOptimize(polyhedron(on_screen, camera, project::Faces::triangles, regions));
    }
  }
  state.counters["cells"] =
      benchmark::Counter(static_cast<double>(mesh.cell_count()), benchmark::Counter::kIsIterationInvariantRate);
}

// Every cell trimmed by a plane that leaves a corner of it: the slow way for all.
void projectTrimmedTetrahedra(benchmark::State& state) {
  const mesh::Mesh mesh = mesh::build(tests::tetrahedronGrid(8, 0.15));
  const mesh::Field field = firstCoordinate(mesh);
  const project::Camera camera(viewOf(8));
  std::vector<Vec3> screen;
  project::screenPoints(mesh, camera, screen);
  project::CellProjector projector(mesh, camera, screen);
  project::Regions regions;
  for (auto _ : state) {
    for (mesh::Id cell = 0; cell < mesh.cell_count(); ++cell) {
      Vec3 middle(0.0);
      for (const mesh::Id v : mesh.vertices(cell)) {
        middle += 0.25 * mesh.points[v];
      }
      const Vec3 normal(1.0, 2.0, 3.0);
      const sort::HalfSpace half{normal, -glm::dot(normal, middle)};
      regions.clear();
      projector(cell, field, regions, {&half, 1});
      benchmark::DoNotOptimize(regions.polygons());
    }
  }
  state.counters["cells"] =
      benchmark::Counter(static_cast<double>(mesh.cell_count()), benchmark::Counter::kIsIterationInvariantRate);
}

void projectPoints(benchmark::State& state) {
  const mesh::Mesh mesh = mesh::build(tests::hexahedronGrid(64));
  const project::Camera camera(viewOf(64));
  std::vector<Vec3> screen;
  for (auto _ : state) {
    project::screenPoints(mesh, camera, screen);
    benchmark::DoNotOptimize(screen.data());
  }
  state.counters["points"] =
      benchmark::Counter(static_cast<double>(mesh.points.size()), benchmark::Counter::kIsIterationInvariantRate);
}

BENCHMARK(projectTetrahedra)->Unit(benchmark::kMillisecond);
BENCHMARK(projectTetrahedraTheGeneralWay)->Unit(benchmark::kMillisecond);
BENCHMARK(projectHexahedra)->ArgName("triangles")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(projectCurvedHexahedra)->Unit(benchmark::kMillisecond);
BENCHMARK(projectSubdividedHexahedra)->Unit(benchmark::kMillisecond);
BENCHMARK(projectTrimmedTetrahedra)->Unit(benchmark::kMillisecond);
BENCHMARK(projectPoints)->Unit(benchmark::kMillisecond);

}  // namespace
