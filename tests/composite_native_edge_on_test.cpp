// Faces seen edge-on, exactly and nearly: rays beside such a face, on it, and so close that float tells nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "spillikin/base/view.h"
#include "tests/composite_native_checks.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {

namespace {

constexpr std::size_t cells = 6;  // each way
constexpr double side = 6.0;

// An eye `off` beside the plane of faces through the grid's middle; an odd number of pixels has rays on that plane.
View besidePlane(double off, int pixels, bool parallel) {
  View view;
  view.target = Vec3(0.5 * side, 0.5 * side + off, 0.5 * side);
  view.eye = view.target + Vec3(4.0, 0.0, 15.0);
  view.up = {0.0, 1.0, 0.0};
  view.width = view.height = pixels;
  if (parallel) view.parallel_scale = 4.2;
  return view;
}

template <class F>
void fromAllViews(const F& check) {
  constexpr unsigned seed = 12;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> digits(-17.0, -2.0), jitters(-15.0, -3.0);
  for (int trial = 0; trial < 24; ++trial) {
    const double off = trial % 4 == 0 ? 0.0 : std::pow(10.0, digits(random));
    const double jitter = trial % 2 == 0 ? 0.0 : std::pow(10.0, jitters(random));
    for (const int pixels : {64, 65}) {
      for (const bool parallel : {false, true}) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial << ": off " << off << ", jitter "
                                        << jitter << ", " << pixels << " pixels" << (parallel ? ", parallel" : ""));
        check(besidePlane(off, pixels, parallel), jitter);
      }
    }
  }
}

}  // namespace

TEST(CompositeNativeEdgeOn, ThicknessesAddUpInTetrahedra) {
  const Subject s = uniform(tetrahedronGrid(cells), 0.07);
  fromAllViews([&](const View& view, double) { expectChords(s, view, Vec3(0.0), Vec3(side)); });
}

// A ray that runs along faces which are not quite planar crosses all of them and
// may lose a little at each.
TEST(CompositeNativeEdgeOn, ThicknessesAddUpInWholeCells) {
  fromAllViews([](const View& view, double jitter) {
    const double bound = jitter > 0.0 && view.width % 2 != 0 ? 1e-4 : 2e-5;
    expectChords(uniform(hexahedronGrid(cells, jitter, 3), 0.07), view, Vec3(0.0), Vec3(side), bound);
    expectChords(uniform(mixedGrid(cells, jitter, 3), 0.07), view, Vec3(0.0), Vec3(side), bound);
  });
}

// The plain ray caster does not tell on which side of a face a ray runs that lies in it: no such ray here.
TEST(CompositeNativeEdgeOn, Pictures) {
  for (const int pixels : {40, 62}) {
    for (const double off : {0.0, 1e-9, 1e-4}) {
      SCOPED_TRACE(testing::Message() << pixels << " pixels, off " << off);
      const View view = besidePlane(off, pixels, false);
      expectExact(Subject(tetrahedronGrid(cells), "", "bands", 1.0), view);
      expectExact(Subject(hexahedronGrid(cells), "", "bands", 1.0), view);
      expectExact(Subject(hexahedronGrid(cells, 1e-6, 3), "", "bands", 1.0), view);
    }
  }
}

}  // namespace spillikin::tests
