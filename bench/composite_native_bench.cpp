// The native compositor: a new viewpoint each frame, orders made beforehand, and beside it what the core can do.
#include <benchmark/benchmark.h>
#include <oneapi/tbb/global_control.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/mesh/build.h"
#include "spillikin/sort/sort.h"
#include "tests/support/meshes.h"

namespace spillikin {
namespace {

constexpr int view_count = 6;

// A mesh with a smooth field, a ring of views that it fills most of, and their orders.
struct Scene {
  mesh::Mesh mesh;
  mesh::Field field;
  integrate::TransferFunction tf;
  std::vector<View> views;
  std::vector<sort::Order> orders;

  explicit Scene(const mesh::Source& source) : mesh(mesh::build(source)), field(mesh::selectField(source, mesh)) {
    Vec3 lo(std::numeric_limits<double>::infinity());
    Vec3 hi = -lo;
    for (const Vec3& p : mesh.points) {
      lo = glm::min(lo, p);
      hi = glm::max(hi, p);
    }
    const double size = glm::length(hi - lo);
    tf = integrate::preset("viridis").scaled(5.0 / size).mapped(field.lo, field.hi);
    const auto sort = sort::makeSorter(sort::Algorithm::mpvo, mesh);
    for (int k = 0; k < view_count; ++k) {
      View view;
      view.target = 0.5 * (lo + hi);
      view.eye = view.target + 2.75 * size * glm::normalize(Vec3(std::cos(0.37 * k), 0.5, std::sin(0.37 * k)));
      views.push_back(view);
      orders.emplace_back();
      (*sort)(viewpoint(view), orders.back());
    }
  }
};

const Scene& scene(const std::string& name) {
  static std::map<std::string, std::unique_ptr<Scene>> scenes;
  std::unique_ptr<Scene>& s = scenes[name];
  if (!s) {
    if (name == "cube10k") s = std::make_unique<Scene>(tests::delaunayCube(1700, 1));
    if (name == "cube100k") s = std::make_unique<Scene>(tests::delaunayCube(15500, 1));
    if (name == "cube1M") s = std::make_unique<Scene>(tests::delaunayCube(150000, 1));
    if (name == "shell100k") s = std::make_unique<Scene>(tests::shell(23));
    if (name == "tori100k") s = std::make_unique<Scene>(tests::interlockedTori(10));
    if (name == "hexahedra50k") s = std::make_unique<Scene>(tests::hexahedronGrid(37));
  }
  return *s;
}

// range(0): pixels on a side; range(1): threads.
void compositeNative(benchmark::State& state, const std::string& name) {
  const Scene& s = scene(name);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(state.range(1)));
  const auto compositor = composite::makeCompositor(composite::Backend::native);
  Image image;
  composite::FrameStats stats;
  double fragments = 0.0;
  std::size_t frame = 0;
  const auto draw = [&] {
    View view = s.views[frame % view_count];
    view.width = view.height = static_cast<int>(state.range(0));
    const project::Camera camera(view);
    composite::Frame f{s.mesh, s.field, s.tf, camera, s.orders[frame % view_count]};
    f.same_mesh = f.same_field = f.same_transfer_function = frame > 0;
    stats = compositor->draw(f, image);
    ++frame;
  };
  draw();  // the first frame allocates
  for (auto _ : state) {
    draw();
    fragments += static_cast<double>(stats.fragments);
  }
  state.counters["cells"] = static_cast<double>(s.mesh.cell_count());
  state.counters["cells/s"] =
      benchmark::Counter(static_cast<double>(s.mesh.cell_count()), benchmark::Counter::kIsIterationInvariantRate);
  state.counters["fragments/s"] = benchmark::Counter(fragments, benchmark::Counter::kIsRate);
  state.counters["flagged"] = static_cast<double>(stats.flagged);
}

void sizes(benchmark::internal::Benchmark* b) {
  b->Args({1024, 1})->Args({1024, 2})->Unit(benchmark::kMillisecond)->UseRealTime();
}
void imageSizes(benchmark::internal::Benchmark* b) {
  for (const int size : {256, 512, 1024, 2048})
    b->Args({size, 2});
  b->Unit(benchmark::kMillisecond)->UseRealTime();
}
BENCHMARK_CAPTURE(compositeNative, cube10k, "cube10k")->Apply(sizes);
BENCHMARK_CAPTURE(compositeNative, cube100k, "cube100k")->Apply(imageSizes);
BENCHMARK_CAPTURE(compositeNative, cube1M, "cube1M")->Apply(sizes);
BENCHMARK_CAPTURE(compositeNative, shell100k, "shell100k")->Apply(sizes);
BENCHMARK_CAPTURE(compositeNative, tori100k, "tori100k")->Apply(sizes);
BENCHMARK_CAPTURE(compositeNative, hexahedra50k, "hexahedra50k")->Apply(sizes);

// What one core can do as this file is compiled: independent multiply-adds out of registers.
void multiplyAdds(benchmark::State& state) {
  constexpr std::size_t lanes = 128;
  std::vector<float> a(lanes, 1.0F);
  for (auto _ : state) {
    for (int repeat = 0; repeat < 1000; ++repeat) {
      for (std::size_t i = 0; i < lanes; ++i)
        a[i] = a[i] * 0.999F + 0.001F;
      benchmark::DoNotOptimize(a.data());
    }
  }
  state.counters["multiply-adds/s"] = benchmark::Counter(1000.0 * lanes, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(multiplyAdds)->Name("compositeNative/core/multiplyAdds");

// What one core reads from memory.
void readMemory(benchmark::State& state) {
  const std::vector<float> a(std::size_t{1} << 26U, 1.0F);
  for (auto _ : state) {
    std::array<float, 16> sum{};
    for (std::size_t i = 0; i < a.size(); i += 16) {
      for (std::size_t k = 0; k < 16; ++k)
        sum[k] += a[i + k];
    }
    benchmark::DoNotOptimize(sum.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * a.size() * sizeof(float)));
}
BENCHMARK(readMemory)->Name("compositeNative/core/readMemory")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace spillikin
