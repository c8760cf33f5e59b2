// Building a mesh, stage by stage, on tetrahedra and hexahedra of a jittered grid.
#include <benchmark/benchmark.h>

#include <map>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/points.h"
#include "spillikin/mesh/predicates.h"
#include "tests/support/meshes.h"

namespace {

using namespace spillikin;
using namespace spillikin::mesh;

// Grids of n^3 hexahedra, or six tetrahedra for each; kept, since making them takes longer than what is measured.
const Source& tetrahedra(std::size_t n) {
  static std::map<std::size_t, Source> made;
  const auto [at, fresh] = made.try_emplace(n);
  if (fresh) at->second = tests::tetrahedronGrid(n, 0.3, 1);
  return at->second;
}

const Source& hexahedra(std::size_t n) {
  static std::map<std::size_t, Source> made;
  const auto [at, fresh] = made.try_emplace(n);
  if (fresh) at->second = tests::hexahedronGrid(n, 0.3, 1);
  return at->second;
}

void countCells(benchmark::State& state, std::size_t cells) {
  state.counters["cells"] = static_cast<double>(cells);
  state.counters["cells/s"] =
      benchmark::Counter(static_cast<double>(cells), benchmark::Counter::kIsIterationInvariantRate);
}

void buildTetrahedra(benchmark::State& state) {
  const Source& source = tetrahedra(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state)
    benchmark::DoNotOptimize(build(source).face_count());
  countCells(state, source.types.size());
}
BENCHMARK(buildTetrahedra)
    ->Name("mesh/build/tetrahedra")
    ->Arg(20)
    ->Arg(55)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void buildHexahedra(benchmark::State& state) {
  const Source& source = hexahedra(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state)
    benchmark::DoNotOptimize(build(source).face_count());
  countCells(state, source.types.size());
}
BENCHMARK(buildHexahedra)
    ->Name("mesh/build/hexahedra")
    ->Arg(20)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void matchFacesOf(benchmark::State& state) {
  Mesh mesh = build(tetrahedra(55));
  for (auto _ : state)
    benchmark::DoNotOptimize(matchFaces(mesh));
  countCells(state, mesh.cell_count());
}
BENCHMARK(matchFacesOf)->Name("mesh/adjacency/tetrahedra")->Unit(benchmark::kMillisecond)->UseRealTime();

void numberPointsOf(benchmark::State& state) {
  const Source& source = tetrahedra(55);
  const PointPool pool(source);
  const std::vector<std::uint8_t> used(pool.size(), 1);
  for (auto _ : state)
    benchmark::DoNotOptimize(numberPoints(pool, used).point.size());
  state.counters["points"] = static_cast<double>(pool.size());
}
BENCHMARK(numberPointsOf)->Name("mesh/number points")->Unit(benchmark::kMillisecond)->UseRealTime();

void inspectTetrahedra(benchmark::State& state) {
  const Mesh mesh = build(tetrahedra(55));
  for (auto _ : state)
    benchmark::DoNotOptimize(inspect(mesh).components);
  countCells(state, mesh.cell_count());
}
BENCHMARK(inspectTetrahedra)->Name("mesh/inspect")->Unit(benchmark::kMillisecond)->UseRealTime();

void selectFieldOf(benchmark::State& state) {
  const Source& source = tetrahedra(55);
  const Mesh mesh = build(source);
  for (auto _ : state)
    benchmark::DoNotOptimize(selectField(source, mesh).hi);
  countCells(state, mesh.cell_count());
}
BENCHMARK(selectFieldOf)->Name("mesh/select field")->Unit(benchmark::kMillisecond)->UseRealTime();

// Four points in general position: the filter decides; in one plane: exact arithmetic has to.
void orient(benchmark::State& state, bool in_plane) {
  const Vec3 a(0.1, 0.2, 0.3), b(1.7, 0.4, 0.9), c(0.3, 1.1, 0.7);
  const Vec3 d = in_plane ? Vec3(a + (b - a) * 0.5 + (c - a) * 0.25) : Vec3(0.5, 0.5, 5.0);
  for (auto _ : state)
    benchmark::DoNotOptimize(orient3d(a, b, c, d));
}
BENCHMARK_CAPTURE(orient, general, false)->Name("mesh/orient3d/general");
BENCHMARK_CAPTURE(orient, plane, true)->Name("mesh/orient3d/in one plane");

void sortKeys(benchmark::State& state) {
  const std::size_t n = 1000000;
  std::vector<std::uint64_t> keys(n);
  std::vector<std::uint32_t> ids(n);
  std::uint64_t x = 1;
  for (auto _ : state) {
    state.PauseTiming();
    for (std::size_t i = 0; i < n; ++i) {
      x = x * 6364136223846793005ULL + 1442695040888963407ULL;
      keys[i] = x >> 24;
      ids[i] = static_cast<std::uint32_t>(i);
    }
    state.ResumeTiming();
    radixSort(keys, ids);
    benchmark::DoNotOptimize(ids.data());
  }
}
BENCHMARK(sortKeys)->Name("mesh/radix sort/1000000")->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
