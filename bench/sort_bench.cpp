// Every visibility sort, a new viewpoint each time. Cells per second of real time; `cpu` counts all threads.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/problem_faces.h"
#include "spillikin/sort/sort.h"
#include "tests/support/meshes.h"

namespace {

using namespace spillikin;
using sort::Algorithm;

// Milliseconds on the wall, and the processor time of all threads beside them.
void onAllCores(benchmark::internal::Benchmark* b) {
  b->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
}

using Meshes = std::map<std::size_t, mesh::Mesh>;

template <class Make>
const mesh::Mesh& kept(Meshes& made, std::size_t size, const Make& make) {
  const auto [at, fresh] = made.try_emplace(size);
  if (fresh) at->second = mesh::build(make(size));
  return at->second;
}

// 6 n^3 tetrahedra of a jittered grid; kept, since making them takes longer than what is measured.
const mesh::Mesh& grid(std::size_t n) {
  static Meshes made;
  return kept(made, n, [](std::size_t size) { return tests::tetrahedronGrid(size, 0.3, 1); });
}

// Delaunay tetrahedra of random points, some 6.7 a point.
const mesh::Mesh& delaunay(std::size_t points) {
  static Meshes made;
  return kept(made, points, [](std::size_t size) { return tests::delaunayCube(size, 7); });
}

// A thick spherical shell with an opening.
const mesh::Mesh& shell(std::size_t n) {
  static Meshes made;
  return kept(made, n, [](std::size_t size) { return tests::shell(size); });
}

Viewpoint eye(const mesh::Mesh& mesh, int view, double step) {
  Vec3 lower = mesh.points.front(), upper = lower;
  for (std::size_t i = 0; i < mesh.points.size(); i += 97) {
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], mesh.points[i][k]);
      upper[k] = std::max(upper[k], mesh.points[i][k]);
    }
  }
  const Vec3 middle = 0.5 * (lower + upper), size = upper - lower;
  const double far = 2.0 * std::max(size.x, std::max(size.y, size.z)), at = 0.3 + step * view;
  return {middle + far * Vec3(std::sin(at), 0.31, std::cos(at)), 1.0};
}

constexpr double four_degrees = 0.0698, small_step = 1e-4;  // radians

void run(benchmark::State& state, Algorithm algorithm, const mesh::Mesh& mesh, double step) {
  std::unique_ptr<sort::Sorter> sorter;
  try {
    sorter = sort::makeSorter(algorithm, mesh);
  } catch (const Error& error) {
    state.SkipWithError(error.what());
    return;
  }
  std::vector<Viewpoint> eyes;
  for (int i = 0; i < 90; ++i)
    eyes.push_back(eye(mesh, i, step));
  sort::Order order;
  std::size_t view = 0;
  for (auto _ : state) {
    (*sorter)(eyes[view++ % eyes.size()], order);
    benchmark::DoNotOptimize(order.cells.data());
  }
  const auto cells = static_cast<double>(mesh.cell_count());
  state.counters["cells"] = cells;
  state.counters["cells/s"] = benchmark::Counter(cells, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["bytes/cell"] = static_cast<double>(sorter->bytes()) / cells;
  state.counters["layers"] = static_cast<double>(order.layer_offset.size());
}

void onGrid(benchmark::State& state, Algorithm algorithm, double step) {
  run(state, algorithm, grid(static_cast<std::size_t>(state.range(0))), step);
}
BENCHMARK_CAPTURE(onGrid, mpvo, Algorithm::mpvo, four_degrees)
    ->Name("sort/mpvo")
    ->Arg(12)
    ->Arg(26)
    ->Arg(55)
    ->Arg(119)
    ->Apply(onAllCores);
BENCHMARK_CAPTURE(onGrid, mpvo_small, Algorithm::mpvo, small_step)
    ->Name("sort/mpvo/small-step")
    ->Arg(55)
    ->Apply(onAllCores);
BENCHMARK_CAPTURE(onGrid, power, Algorithm::power, four_degrees)
    ->Name("sort/power")
    ->Arg(12)
    ->Arg(26)
    ->Arg(55)
    ->Arg(119)
    ->Apply(onAllCores);
BENCHMARK_CAPTURE(onGrid, centroid, Algorithm::centroid, four_degrees)
    ->Name("sort/centroid")
    ->Arg(12)
    ->Arg(26)
    ->Arg(55)
    ->Arg(119)
    ->Apply(onAllCores);
BENCHMARK_CAPTURE(onGrid, mpvonc, Algorithm::mpvonc, four_degrees)->Name("sort/mpvonc")->Arg(55)->Apply(onAllCores);

// A million hexahedra with curved faces: the sides of the viewpoint and the problem cells of a new view.
const mesh::Mesh& hexahedra(std::size_t n) {
  static Meshes made;
  return kept(made, n, [](std::size_t size) { return tests::hexahedronGrid(size, 0.2, 1); });
}

void problemFaces(benchmark::State& state) {
  const mesh::Mesh& mesh = hexahedra(static_cast<std::size_t>(state.range(0)));
  sort::FaceSigns signs(mesh);
  sort::ProblemFaces problems(mesh, signs);
  int view = 0;
  for (auto _ : state) {
    signs(eye(mesh, view++, four_degrees));
    problems.update();
  }
  const auto faces = static_cast<double>(mesh.quad_count());
  state.counters["faces/s"] = benchmark::Counter(faces, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["problem cells"] = static_cast<double>(problems.cells());
}
BENCHMARK(problemFaces)->Name("sort/problem-faces")->Arg(100)->Apply(onAllCores);

// Cells in cycles by their curved faces: cut, or subdivided first.
void curved(benchmark::State& state, sort::CurvedCells road) {
  const mesh::Mesh& mesh = hexahedra(static_cast<std::size_t>(state.range(0)));
  const auto sorter = sort::makeSorter(Algorithm::automatic, mesh, road);
  sort::Order order;
  int view = 0;
  std::size_t pieces = 0;
  for (auto _ : state) {
    (*sorter)(eye(mesh, view++ % 90, four_degrees), order);
    pieces += order.cells.size() - mesh.cell_count();
  }
  state.counters["added pieces"] = static_cast<double>(pieces) / static_cast<double>(state.iterations());
}
BENCHMARK_CAPTURE(curved, cut, sort::CurvedCells::cut)->Name("sort/curved/cut")->Arg(40)->Apply(onAllCores);
BENCHMARK_CAPTURE(curved, tetrahedra, sort::CurvedCells::tetrahedra)
    ->Name("sort/curved/tetrahedra")
    ->Arg(40)
    ->Apply(onAllCores);

void onDelaunay(benchmark::State& state, Algorithm algorithm) {
  run(state, algorithm, delaunay(static_cast<std::size_t>(state.range(0))), four_degrees);
}
BENCHMARK_CAPTURE(onDelaunay, mpvo, Algorithm::mpvo)
    ->Name("sort/delaunay/mpvo")
    ->Arg(1600)
    ->Arg(15000)
    ->Arg(149000)
    ->Apply(onAllCores);
BENCHMARK_CAPTURE(onDelaunay, power, Algorithm::power)
    ->Name("sort/delaunay/power")
    ->Arg(1600)
    ->Arg(15000)
    ->Arg(149000)
    ->Apply(onAllCores);

void onShell(benchmark::State& state, Algorithm algorithm) {
  run(state, algorithm, shell(static_cast<std::size_t>(state.range(0))), four_degrees);
}
BENCHMARK_CAPTURE(onShell, mpvo, Algorithm::mpvo)->Name("sort/shell/mpvo-inexact")->Arg(16)->Apply(onAllCores);
BENCHMARK_CAPTURE(onShell, xmpvo, Algorithm::xmpvo)->Name("sort/shell/xmpvo")->Arg(16)->Apply(onAllCores);
BENCHMARK_CAPTURE(onShell, bsp, Algorithm::bsp_xmpvo)->Name("sort/shell/bsp-xmpvo")->Arg(16)->Apply(onAllCores);
BENCHMARK_CAPTURE(onShell, convexified, Algorithm::convexified)
    ->Name("sort/shell/convexified")
    ->Arg(16)
    ->Apply(onAllCores);

// The two halves of a view.
void faceSigns(benchmark::State& state) {
  const mesh::Mesh& mesh = grid(static_cast<std::size_t>(state.range(0)));
  sort::FaceSigns signs(mesh);
  int view = 0;
  for (auto _ : state)
    signs(eye(mesh, view++ % 90, four_degrees));
  state.counters["faces/s"] =
      benchmark::Counter(static_cast<double>(mesh.face_count()), benchmark::Counter::kIsIterationInvariantRate);
  state.counters["exact"] = static_cast<double>(signs.exactCalls());
}
BENCHMARK(faceSigns)->Name("sort/face-signs")->Arg(55)->Apply(onAllCores);

void layers(benchmark::State& state) {
  const mesh::Mesh& mesh = grid(static_cast<std::size_t>(state.range(0)));
  sort::FaceSigns signs(mesh);
  sort::LayeredSort layered(mesh);
  signs(eye(mesh, 0, four_degrees));
  sort::Order order;
  for (auto _ : state)
    layered(signs, order);
  state.counters["cells/s"] =
      benchmark::Counter(static_cast<double>(mesh.cell_count()), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(layers)->Name("sort/layers")->Arg(55)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void prepare(benchmark::State& state) {
  const mesh::Mesh& mesh = grid(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state)
    benchmark::DoNotOptimize(sort::makeSorter(Algorithm::mpvo, mesh)->bytes());
}
BENCHMARK(prepare)->Name("sort/mpvo/prepare")->Arg(55)->Apply(onAllCores);

}  // namespace
