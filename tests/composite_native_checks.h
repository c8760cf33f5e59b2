// What the native compositor's pictures are held to.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "spillikin/composite/backends.h"
#include "spillikin/project/camera.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {

inline constexpr double step = 1.0 / 255.0;

inline void expectExact(const Subject& s, const View& view, sort::Algorithm algorithm = sort::Algorithm::mpvo,
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

// The world length of the ray of (x, y) inside the box, before the eye.
inline double chord(const project::Camera& camera, Vec3 lo, Vec3 hi, double x, double y) {
  const Vec3 origin = camera.origin(x, y);
  const Vec3 direction = camera.direction(x, y);
  double near = camera.parallel() ? -1e300 : 0.0;
  double far = 1e300;
  for (int k = 0; k < 3; ++k) {
    const double a = (lo[k] - origin[k]) / direction[k];
    const double b = (hi[k] - origin[k]) / direction[k];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return std::max(0.0, far - near) * glm::length(direction);
}

// With one extinction everywhere, opacity tells the length that was drawn: no gap, nothing twice. `bound` is a share of
// the box's diagonal.
inline void expectChords(const Subject& s, const View& view, Vec3 lo, Vec3 hi, double bound = 2e-5) {
  const double extinction = s.tf.points().front().extinction;
  const auto native = composite::makeNative();
  Image image;
  drawWith(*native, s, view, orderOf(s, view), image);
  const project::Camera camera(view);
  double worst = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double expected = chord(camera, lo, hi, x + 0.5, y + 0.5);
      const double drawn = -std::log1p(-double(image.pixel(x, y)[3])) / extinction;
      worst = std::max(worst, std::abs(drawn - expected));
    }
  }
  EXPECT_LE(worst, bound * glm::length(hi - lo));
}

// The corners of a cube, as a hexahedron has them.
inline std::vector<Vec3> cube() {
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
}

inline Subject uniform(const mesh::Source& source, double extinction) {
  Subject s(source, "", "viridis", 1.0);
  s.tf = integrate::TransferFunction({{0.0, {0.2, 0.5, 0.8}, extinction}});
  return s;
}

// Regions whose scalar is that of a jump, to the last bit.
inline Subject constantAtJumps() {
  mesh::Source source = delaunayCube(200, 14);
  addPointArray(source, "flat", [](const Vec3& p) { return p.x > 0.5 ? 0.1 : 0.7; });
  Subject s(source, "flat", "viridis", 1.0);
  s.tf = integrate::TransferFunction({{0.0, {1, 0, 0}, 2.0},
                                      {0.1, {1, 0, 0}, 2.0},
                                      {0.1, {0, 1, 0}, 0.5},
                                      {0.7, {0, 1, 0}, 0.5},
                                      {0.7, {0, 0, 1}, 1.0}});
  return s;
}

}  // namespace spillikin::tests
