// The native compositor against a plain ray caster in double precision.
#include <gtest/gtest.h>

#include "spillikin/composite/backends.h"
#include "spillikin/project/camera.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

constexpr double step = 1.0 / 255.0;

void expectExact(const Subject& s, const View& view, sort::Algorithm algorithm = sort::Algorithm::mpvo,
                 double bound = 0.1 * step) {
  const auto native = composite::makeNative();
  Image image;
  const composite::FrameStats stats = drawWith(*native, s, view, orderOf(s, view, algorithm), image);
  EXPECT_LE(largestDifference(image, castRays(s, project::Camera(view))), bound);
  EXPECT_EQ(stats.unresolved, 0U);
  EXPECT_EQ(stats.flagged, stats.resolved);
  EXPECT_TRUE(stats.certified);
  EXPECT_GT(stats.fragments, 0U);
}

TEST(CompositeNative, DelaunayCubeInPerspective) {
  for (const char* look : {"viridis", "bands", "comb", "steps"}) {
    SCOPED_TRACE(look);
    const Subject s(delaunayCube(150, 7), "", look, 6.0);
    expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 70, 51));
  }
}

TEST(CompositeNative, DelaunayCubeInParallel) {
  const Subject s(delaunayCube(150, 8), "", "viridis", 6.0);
  View view = viewOf(s, {-0.4, 0.6, 0.8}, 51, 70);
  view.parallel_scale = 0.8;
  expectExact(s, view);
}

TEST(CompositeNative, EyeInside) {
  const Subject s(delaunayCube(150, 9), "", "coolwarm", 6.0);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
  view.eye = {0.41, 0.52, 0.47};
  view.target = {0.9, 0.1, 0.8};
  view.view_angle = 80.0;
  expectExact(s, view);
}

TEST(CompositeNative, ClipPlanes) {
  const Subject s(delaunayCube(150, 10), "", "viridis", 6.0);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
  view.clips = {{{0.5, 0.5, 0.5}, {1.0, 0.3, -0.2}}, {{0.5, 0.7, 0.5}, {0.0, -1.0, 0.1}}};
  expectExact(s, view);
  view.parallel_scale = 0.8;
  expectExact(s, view);
}

TEST(CompositeNative, WholeHexahedra) {
  const Subject s(hexahedronGrid(4, 0.15, 3), "", "viridis", 1.5);
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48));
}

TEST(CompositeNative, WrongOrderIsRepaired) {
  const Subject s(delaunayCube(150, 11), "", "viridis", 20.0);
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48), sort::Algorithm::none);
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48), sort::Algorithm::centroid);
}

}  // namespace
}  // namespace spillikin::tests
