// The OpenGL compositors against a plain ray caster in double precision.
#include <gtest/gtest.h>

#include "spillikin/composite/backends.h"
#include "spillikin/project/camera.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

constexpr double step = 1.0 / 255.0;
constexpr double mean_bound = 1e-4;

double meanDifference(const Image& a, const Image& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    sum += std::abs(double(a.rgba[i]) - double(b.rgba[i]));
  }
  return sum / static_cast<double>(a.rgba.size());
}

// One context for all tests: making one takes longer than drawing.
composite::Compositor& osmesa() {
  static const std::unique_ptr<composite::Compositor> compositor = composite::makeOsmesa();
  return *compositor;
}

void expectExact(const Subject& s, const View& view, sort::Algorithm algorithm = sort::Algorithm::mpvo) {
  Image image;
  const composite::FrameStats stats = drawWith(osmesa(), s, view, orderOf(s, view, algorithm), image);
  const Image truth = castRays(s, project::Camera(view));
  EXPECT_LE(largestDifference(image, truth), 0.1 * step);
  EXPECT_LE(meanDifference(image, truth), mean_bound);
  if (std::getenv("SPILLIKIN_SHOW") != nullptr) {
    std::printf("max %.3g mean %.3g fragments %zu polygons %zu\n", largestDifference(image, truth),
                meanDifference(image, truth), stats.fragments, stats.polygons);
  }
  EXPECT_GT(stats.fragments, 0U);
}

TEST(CompositeGl, DelaunayCubeInPerspective) {
  for (const char* look : {"viridis", "bands", "comb", "steps"}) {
    SCOPED_TRACE(look);
    const Subject s(delaunayCube(150, 7), "", look, 6.0);
    expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 70, 51));
  }
}

TEST(CompositeGl, DelaunayCubeInParallel) {
  const Subject s(delaunayCube(150, 8), "", "viridis", 6.0);
  View view = viewOf(s, {-0.4, 0.6, 0.8}, 51, 70);
  view.parallel_scale = 0.8;
  expectExact(s, view);
}

TEST(CompositeGl, EyeInside) {
  const Subject s(delaunayCube(150, 9), "", "coolwarm", 6.0);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
  view.eye = {0.41, 0.52, 0.47};
  view.target = {0.9, 0.1, 0.8};
  view.view_angle = 80.0;
  expectExact(s, view);
}

TEST(CompositeGl, ClipPlanes) {
  const Subject s(delaunayCube(150, 10), "", "viridis", 6.0);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
  view.clips = {{{0.5, 0.5, 0.5}, {1.0, 0.3, -0.2}}, {{0.5, 0.7, 0.5}, {0.0, -1.0, 0.1}}};
  expectExact(s, view);
  view.parallel_scale = 0.8;
  expectExact(s, view);
}

TEST(CompositeGl, WholeHexahedra) {
  const Subject s(hexahedronGrid(4, 0.15, 3), "", "viridis", 1.5);
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48));
}

}  // namespace
}  // namespace spillikin::tests
