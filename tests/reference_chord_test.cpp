// No cell lost, none doubled: on every ray the intervals join without gap or overlap and add up to the closed form.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "reference_support.h"

namespace spillikin::tests {
namespace {

using reference::Interval;

// Every pixel's intervals join end to end and their sum is the chord of the box. Rays in the boundary of the box
// itself belong to it or do not (the perturbed ray decides): there 0 is right too.
void expectBoxChords(const Scene& scene, const View& view, const Vec3& lo, const Vec3& hi, double tolerance,
                     const reference::Options& options = {}) {
  const reference::Rays rays(view);
  std::vector<Interval> intervals;
  std::size_t hit = 0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      scene.caster.intervals(view, x + 0.5, y + 0.5, options, intervals);
      const reference::Ray ray = rays(x + 0.5, y + 0.5);
      const double chord = boxChord(ray, lo, hi, !view.parallel());
      const double inner = boxChord(ray, lo + Vec3(tolerance), hi - Vec3(tolerance), !view.parallel());
      const double total = totalLength(intervals);
      if (inner == 0.0 && total == 0.0) continue;
      hit += intervals.empty() ? 0 : 1;
      ASSERT_NEAR(total, chord, tolerance) << fmt::format("pixel {},{}", x, y);
      // Where the ray runs through a vertex or an edge there are intervals of no length, in any order.
      std::erase_if(intervals, [&](const Interval& i) { return i.leave - i.enter < 1e-3 * tolerance; });
      for (std::size_t n = 1; n < intervals.size(); ++n) {
        ASSERT_NEAR(intervals[n].enter, intervals[n - 1].leave, tolerance) << fmt::format("pixel {},{}", x, y);
      }
    }
  }
  EXPECT_GT(hit, static_cast<std::size_t>(view.width * view.height) / 20);
}

View parallelView(const Vec3& towards, const Vec3& up, const Vec3& centre, double scale, int size) {
  View view = lookAt(centre - towards, centre, size, size);
  view.up = up;
  view.parallel_scale = scale;
  return view;
}

constexpr std::size_t n = 8;

class Aligned : public testing::TestWithParam<int> {};

// The image of 16 pixels spans the cube of 8 cells with half a cell of border on each side of it (9 units over 18
// pixels): the centres of the pixels lie on the grid's planes and their halves, so that rays run through vertices,
// along edges, along faces, along the diagonals of faces.
TEST_P(Aligned, ParallelRaysAlongTheGrid) {
  const int axis = GetParam() % 3;
  const bool tetrahedra = GetParam() < 6, backwards = GetParam() % 2 == 1;
  const Scene scene(tetrahedra ? tetrahedronGrid(n) : hexahedronGrid(n));
  Vec3 towards(0.0), up(0.0);
  towards[axis] = backwards ? -1.0 : 1.0;
  up[(axis + 1) % 3] = 1.0;
  for (const double shift : {0.0, 0.25}) {
    const Vec3 centre = Vec3(4.0) + shift * up;
    expectBoxChords(scene, parallelView(towards, up, centre, 4.5, 18), Vec3(0.0), Vec3(8.0), 1e-9);
    expectBoxChords(scene, parallelView(towards, up, centre, 4.25, 17), Vec3(0.0), Vec3(8.0), 1e-9);
    if (tetrahedra) continue;
    reference::Options curved;
    curved.model = mesh::FieldModel::isoparametric;
    expectBoxChords(scene, parallelView(towards, up, centre, 4.5, 18), Vec3(0.0), Vec3(8.0), 1e-8, curved);
  }
}
INSTANTIATE_TEST_SUITE_P(Reference, Aligned, testing::Range(0, 12));

// Along face diagonals and space diagonals of the grid: directions exact in the ratio of their components.
TEST(ReferenceChord, ParallelRaysAlongDiagonals) {
  const Scene tetrahedra(tetrahedronGrid(n)), hexahedra(hexahedronGrid(n));
  for (const Vec3 towards : {Vec3(1, 1, 0), Vec3(1, 0, -1), Vec3(1, 1, 1), Vec3(-1, 1, 1), Vec3(2, 1, 0)}) {
    const View view = parallelView(towards, Vec3(0, 0.5, 1), Vec3(4.0), 4.0, 33);
    expectBoxChords(tetrahedra, view, Vec3(0.0), Vec3(8.0), 1e-9);
    expectBoxChords(hexahedra, view, Vec3(0.0), Vec3(8.0), 1e-9);
  }
}

// The eye on a vertex, on an edge, in a face, in a cell's middle, and outside in a plane of the grid.
TEST(ReferenceChord, PerspectiveEyeOnTheGrid) {
  const Scene tetrahedra(tetrahedronGrid(n)), hexahedra(hexahedronGrid(n));
  for (const Vec3 eye : {Vec3(4, 4, 4), Vec3(4.5, 4, 4), Vec3(4.5, 4.5, 4), Vec3(4.5, 4.5, 4.5), Vec3(4, 4, 20),
                         Vec3(4, 8, 20), Vec3(-3, 4, 4)}) {
    for (const Vec3 towards : {Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(1, 0, -1)}) {
      if (eye.z > 8.0 && towards.x != 0.0) continue;
      if (eye.x < 0.0 && towards.x == 0.0) continue;
      View view = lookAt(eye, eye + towards, 31, 31);
      view.view_angle = 90.0;
      expectBoxChords(tetrahedra, view, Vec3(0.0), Vec3(8.0), 1e-9);
      expectBoxChords(hexahedra, view, Vec3(0.0), Vec3(8.0), 1e-9);
    }
  }
}

TEST(ReferenceChord, ModelsCoverTheSameLength) {
  const Scene scene(hexahedronGrid(6, 0.15, 7));
  const View view = lookAt({14, 9, 17}, {3, 3, 3}, 40, 40);
  reference::Options tets;
  tets.model = mesh::FieldModel::tets;
  expectBoxChords(scene, view, Vec3(0.0), Vec3(6.0), 1e-9);
  expectBoxChords(scene, view, Vec3(0.0), Vec3(6.0), 1e-9, tets);
}

TEST(ReferenceChord, RandomTetrahedraAndRandomViews) {
  const std::uint64_t seed = 20240611;
  SCOPED_TRACE(fmt::format("seed {}", seed));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const Scene scene(delaunayCube(2000, seed));
  for (int trial = 0; trial < 8; ++trial) {
    const Vec3 eye(0.5 + 2.0 * uniform(random), 0.5 + 2.0 * uniform(random), 0.5 + 2.0 * uniform(random));
    View view = lookAt(eye, Vec3(0.5), 24, 24);
    if (trial % 2 == 1) view.parallel_scale = 0.6;
    expectBoxChords(scene, view, Vec3(0.0), Vec3(1.0), 1e-12);
  }
}

// Cells of 1e-3 at 1e6: a coordinate's last bit is 1e-10 there.
TEST(ReferenceChord, FarFromTheOrigin) {
  const Vec3 far(1e6, -1e6, 1e6);
  for (const bool tetrahedra : {true, false}) {
    mesh::Source source = tetrahedra ? tetrahedronGrid(8) : hexahedronGrid(8);
    for (Vec3& p : source.points)
      p = far + p * 0x1p-10;
    const Scene scene(source);
    const double side = 8 * 0x1p-10;
    const Vec3 middle = far + Vec3(side / 2);
    expectBoxChords(scene, lookAt(middle + Vec3(0.01, 0.02, 0.03), middle, 40, 40), far, far + Vec3(side), 2e-9);
    expectBoxChords(scene, lookAt(middle + Vec3(0, 0, 0.02), middle, 32, 32), far, far + Vec3(side), 2e-9);
    expectBoxChords(scene, parallelView({0, 0, -1}, {0, 1, 0}, middle, 9 * 0x1p-11, 18), far, far + Vec3(side), 2e-9);
    const View view = parallelView({0.3, 0.5, -1}, {0, 1, 0}, middle, 9 * 0x1p-11, 18);
    expectBoxChords(scene, view, far, far + Vec3(side), 4e-9);
  }
}

// A grid whose planes crowd towards a corner: sides from 1e-6 to 1 in one mesh.
TEST(ReferenceChord, CellsOfManySizes) {
  mesh::Source source = tetrahedronGrid(12);
  const auto graded = [](double x) { return x == 0.0 ? 0.0 : std::pow(10.0, (x - 12.0) * 0.5); };
  for (Vec3& p : source.points)
    p = Vec3(graded(p.x), graded(p.y), graded(p.z));
  const Scene scene(source);
  const double smallest = graded(1.0);
  ASSERT_LT(smallest, 1e-5);
  expectBoxChords(scene, lookAt({2, 2.5, 3}, Vec3(0.0), 60, 60), Vec3(0.0), Vec3(1.0), 1e-9);
  const Vec3 corner(2 * smallest);
  expectBoxChords(scene, lookAt({4 * smallest, 6 * smallest, 9 * smallest}, corner, 60, 60), Vec3(0.0), Vec3(1.0),
                  1e-9);
  expectBoxChords(scene, parallelView({0, 0, -1}, {0, 1, 0}, corner, 4 * smallest, 32), Vec3(0.0), Vec3(1.0), 1e-9);
}

}  // namespace
}  // namespace spillikin::tests
