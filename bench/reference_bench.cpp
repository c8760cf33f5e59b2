// What a ray of the ground truth costs, stage by stage.
#include <benchmark/benchmark.h>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/reference/candidates.h"
#include "spillikin/reference/quadrature.h"
#include "spillikin/reference/reference.h"
#include "tests/support/meshes.h"

namespace spillikin {
namespace {

struct Scene {
  explicit Scene(const mesh::Source& source)
      : mesh(mesh::build(source)), field(mesh::selectField(source, mesh)), caster(mesh, field) {}
  mesh::Mesh mesh;
  mesh::Field field;
  reference::RayCaster caster;
};

// n = 55: a million tetrahedra.
const Scene& grid(std::size_t n) {
  static std::size_t made = 0;
  static std::unique_ptr<Scene> scene;
  if (made != n) scene = std::make_unique<Scene>(tests::tetrahedronGrid(n, 0.15));
  made = n;
  return *scene;
}

View view(double n, int size) {
  View v;
  v.eye = Vec3(0.5 * n) + Vec3(1.3, 0.9, 1.7) * n;
  v.target = Vec3(0.5 * n);
  v.view_angle = 30.0;
  v.width = v.height = size;
  return v;
}

const integrate::TransferFunction& look() {
  static const integrate::TransferFunction tf = integrate::preset("viridis").mapped(0.5, 3.5).scaled(0.02);
  return tf;
}

void referenceRender(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const Scene& scene = grid(n);
  reference::Options options;
  options.quadrature = state.range(2) != 0;
  reference::Report report;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        scene.caster.render(view(static_cast<double>(n), static_cast<int>(state.range(1))), look(), options, &report));
  }
  state.counters["cells"] = static_cast<double>(scene.mesh.cell_count());
  state.counters["rays/s"] =
      benchmark::Counter(static_cast<double>(report.rays), benchmark::Counter::kIsIterationInvariantRate);
  state.counters["intervals/s"] =
      benchmark::Counter(static_cast<double>(report.intervals), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(referenceRender)
    ->ArgNames({"n", "pixels", "quadrature"})
    ->Args({12, 256, 0})
    ->Args({12, 256, 1})
    ->Args({55, 512, 0})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

void referencePrepare(benchmark::State& state) {
  const mesh::Source source = tests::tetrahedronGrid(static_cast<std::size_t>(state.range(0)), 0.15);
  const mesh::Mesh mesh = mesh::build(source);
  const mesh::Field field = mesh::selectField(source, mesh);
  for (auto _ : state) {
    const reference::RayCaster caster(mesh, field);
    benchmark::DoNotOptimize(&caster);
  }
  state.counters["cells/s"] =
      benchmark::Counter(static_cast<double>(mesh.cell_count()), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(referencePrepare)->ArgName("n")->Arg(30)->Arg(55)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace spillikin
