// The OpenGL compositors: a new viewpoint each frame, orders made beforehand.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/composite/compositor.h"
#include "spillikin/mesh/build.h"
#include "spillikin/sort/sort.h"
#include "tests/support/meshes.h"

namespace spillikin {
namespace {

constexpr int view_count = 6;

// A mesh that fills most of the image from a ring of eyes around it.
struct GlScene {
  mesh::Mesh mesh;
  mesh::Field field;
  integrate::TransferFunction tf;
  std::array<View, view_count> views;
  std::array<sort::Order, view_count> orders;

  explicit GlScene(const mesh::Source& source) : mesh(mesh::build(source)), field(mesh::selectField(source, mesh)) {
    const mesh::Inspection box = mesh::inspect(mesh);
    const double size = glm::length(box.upper - box.lower);
    tf = integrate::preset("viridis").scaled(5.0 / size).mapped(field.lo, field.hi);
    const auto sorter = sort::makeSorter(sort::Algorithm::mpvo, mesh);
    for (std::size_t k = 0; k < view_count; ++k) {
      const double turn = 0.37 * static_cast<double>(k);
      views[k].target = 0.5 * (box.lower + box.upper);
      views[k].eye = views[k].target + 2.75 * size * glm::normalize(Vec3(std::cos(turn), 0.5, std::sin(turn)));
      (*sorter)(viewpoint(views[k]), orders[k]);
    }
  }
};

const GlScene& glScene(const std::string& name) {
  static std::map<std::string, std::unique_ptr<GlScene>> scenes;
  std::unique_ptr<GlScene>& scene = scenes[name];
  if (!scene) {
    mesh::Source source;
    if (name == "cube10k") source = tests::delaunayCube(1700, 1);
    if (name == "cube100k") source = tests::delaunayCube(15500, 1);
    if (name == "cube1M") source = tests::delaunayCube(150000, 1);
    if (name == "hexahedra50k") source = tests::hexahedronGrid(37);
    scene = std::make_unique<GlScene>(source);
  }
  return *scene;
}

// range(0): pixels on a side.
void compositeGl(benchmark::State& state, composite::Backend backend, const std::string& name,
                 composite::Integration integration) {
  std::unique_ptr<composite::Compositor> compositor;
  try {
    compositor = composite::makeCompositor(backend);
  } catch (const Error& error) {
    state.SkipWithError(error.what());
    return;
  }
  const GlScene& scene = glScene(name);
  Image image;
  composite::FrameStats stats;
  double fragments = 0.0;
  double project_seconds = 0.0;
  std::size_t frame = 0;
  const auto draw = [&] {
    View view = scene.views[frame % view_count];
    view.width = view.height = static_cast<int>(state.range(0));
    const project::Camera camera(view);
    const bool same = frame > 0;
    stats = compositor->draw(
        {scene.mesh, scene.field, scene.tf, camera, scene.orders[frame % view_count], integration, same, same, same},
        image);
    ++frame;
  };
  draw();  // the first frame compiles the shaders and sends what stays
  for (auto _ : state) {
    draw();
    fragments += static_cast<double>(stats.fragments);
    project_seconds += stats.project_seconds;
  }
  using benchmark::Counter;
  const double cells = static_cast<double>(scene.mesh.cell_count()) * static_cast<double>(state.iterations());
  state.counters["cells/s"] = Counter(cells, Counter::kIsRate);
  state.counters["fragments/s"] = Counter(fragments, Counter::kIsRate);
  state.counters["project_s"] = Counter(project_seconds, Counter::kAvgIterations);
}

#define SPILLIKIN_GL_BENCH(backend, mesh, integration)                                                 \
  BENCHMARK_CAPTURE(compositeGl, backend##_##mesh##_##integration, composite::Backend::backend, #mesh, \
                    composite::Integration::integration)                                               \
      ->Unit(benchmark::kMillisecond)                                                                  \
      ->UseRealTime()

SPILLIKIN_GL_BENCH(osmesa, cube10k, exact)->Arg(512)->Arg(1024);
SPILLIKIN_GL_BENCH(osmesa, cube100k, exact)->Arg(512)->Arg(1024);
SPILLIKIN_GL_BENCH(osmesa, cube1M, exact)->Arg(512)->Arg(1024);
SPILLIKIN_GL_BENCH(osmesa, hexahedra50k, exact)->Arg(512);
SPILLIKIN_GL_BENCH(osmesa, cube100k, preintegrated)->Arg(512);
SPILLIKIN_GL_BENCH(osmesa, cube100k, average)->Arg(512);
SPILLIKIN_GL_BENCH(osmesa, cube100k, vertex)->Arg(512);
SPILLIKIN_GL_BENCH(egl, cube100k, exact)->Arg(512)->Arg(1024);
SPILLIKIN_GL_BENCH(egl, cube1M, exact)->Arg(1024);

}  // namespace
}  // namespace spillikin
