// Whole cells against all their tetrahedra: the same views of one mesh drawn in turn both ways, in one run.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <ctime>
#include <memory>
#include <vector>

#include "spillikin/io/read.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/session.h"
#include "tests/support/meshes.h"

namespace {

using namespace spillikin;

// Processor time of all threads.
double seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double heapBytes() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct Way {
  std::unique_ptr<render::Session> session;
  double bytes = 0.0;  // held once a frame has been drawn: mesh, order, picture and all that is kept
  std::vector<double> frames;
};

void wholeAgainstTetrahedra(benchmark::State& state, const mesh::Source& source, composite::Backend backend) {
  Way ways[2];
  const render::Projection projections[2] = {render::Projection::zoo, render::Projection::tets};
  for (std::size_t i = 0; i < 2; ++i) {
    const double before = heapBytes();
    ways[i].session = std::make_unique<render::Session>(
        source, render::Engine{.projection = projections[i], .backend = backend, .walking = composite::Walking::never});
    ways[i].session->setView(ways[i].session->defaultView(512, 512));
    ways[i].session->draw();
    ways[i].bytes = heapBytes() - before;
  }
  const View first = ways[0].session->view();
  double azimuth = 0.0;
  for (auto _ : state) {
    View view = first;
    render::turnView(view, {azimuth += 4.0, 20.0, 1.0});
    for (Way& way : ways) {
      const double start = seconds();
      way.session->setView(view);
      way.session->draw();
      way.frames.push_back(seconds() - start);
    }
  }
  const double whole = median(ways[0].frames), tetrahedra = median(ways[1].frames);
  state.counters["whole_ms"] = 1e3 * whole;
  state.counters["tets_ms"] = 1e3 * tetrahedra;
  state.counters["times_faster"] = tetrahedra / whole;
  state.counters["whole_MB"] = 1e-6 * ways[0].bytes;
  state.counters["tets_MB"] = 1e-6 * ways[1].bytes;
  state.counters["memory_ratio"] = ways[0].bytes / ways[1].bytes;
}

void onGrid(benchmark::State& state, composite::Backend backend) {
  static const mesh::Source source = tests::hexahedronGrid(40, 0.2, 1);
  wholeAgainstTetrahedra(state, source, backend);
}
void onPlanarGrid(benchmark::State& state, composite::Backend backend) {
  static const mesh::Source source = tests::hexahedronGrid(40);
  wholeAgainstTetrahedra(state, source, backend);
}
void onBluntFin(benchmark::State& state, composite::Backend backend) {
  static const mesh::Source source = io::readMesh(std::string(SPILLIKIN_EXAMPLES) + "/bluntfin.vts");
  wholeAgainstTetrahedra(state, source, backend);
}

BENCHMARK_CAPTURE(onPlanarGrid, native, composite::Backend::native)
    ->Name("render/whole-against-tets/planar/native")
    ->Iterations(7)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(onPlanarGrid, osmesa, composite::Backend::osmesa)
    ->Name("render/whole-against-tets/planar/osmesa")
    ->Iterations(5)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(onGrid, native, composite::Backend::native)
    ->Name("render/whole-against-tets/curved/native")
    ->Iterations(7)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(onGrid, osmesa, composite::Backend::osmesa)
    ->Name("render/whole-against-tets/curved/osmesa")
    ->Iterations(5)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(onBluntFin, native, composite::Backend::native)
    ->Name("render/whole-against-tets/bluntfin/native")
    ->Iterations(7)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(onBluntFin, osmesa, composite::Backend::osmesa)
    ->Name("render/whole-against-tets/bluntfin/osmesa")
    ->Iterations(5)
    ->Unit(benchmark::kMillisecond);

}  // namespace
