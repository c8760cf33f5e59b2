// Whole cells by the planes of their faces: which cells are of that kind, and that neighbours leave nothing out and
// draw nothing twice.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "spillikin/composite/native_facets.h"
#include "spillikin/composite/native_kernel.h"
#include "tests/composite_native_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

using composite::native::FacetCode;
using composite::native::Facets;
using composite::native::inward_shift;
using composite::native::not_of_planes;

FacetCode codeOf(const std::vector<Vec3>& points, std::uint8_t type = mesh::vtk_cell::hexahedron) {
  const mesh::Mesh mesh = mesh::build(oneCell(type, points));
  Facets facets;
  facets.set(mesh);
  return facets[0];
}

int inwardFaces(FacetCode code) {
  return std::popcount(code >> inward_shift);
}

TEST(CompositeNativeFacets, CellsThatPlanesBound) {
  EXPECT_EQ(inwardFaces(codeOf(cube())), 0);
  auto bent = cube();
  bent[6] += Vec3(0.2, 0.15, 0.1);  // out: what its faces do depends on their diagonals
  const FacetCode outward = codeOf(bent);
  ASSERT_NE(outward, not_of_planes);
  bent[6] = Vec3(0.9, 0.85, 0.8);
  const FacetCode inward = codeOf(bent);
  ASSERT_NE(inward, not_of_planes);
  EXPECT_EQ(inwardFaces(outward) + inwardFaces(inward), 3) << "what bends in with the one bends out with the other";
}

TEST(CompositeNativeFacets, CellsThatPlanesDoNotBound) {
  auto dented = cube();
  dented[6] = {0.25, 0.25, 0.25};
  EXPECT_EQ(codeOf(dented), not_of_planes);
  auto straight = cube();  // two faces in one plane
  straight[1].y = straight[5].y = 0.5;
  straight[0] = {0, 0, 0};
  straight[2] = {2, 1, 0};
  straight[6] = {2, 1, 1};
  EXPECT_EQ(codeOf(straight), not_of_planes);
}

// Perspective, parallel and from within.
std::vector<View> viewsOf(const Subject& s, double size, int pixels) {
  std::vector<View> views{viewOf(s, {1.0, 0.7, 0.4}, pixels, pixels - 7, 1.6)};
  views.push_back(views[0]);
  views[1].parallel_scale = 0.75 * size;
  views.push_back(views[0]);
  views[2].eye = {0.33 * size, 0.56 * size, 0.455 * size};
  views[2].view_angle = 100.0;
  return views;
}

// Along an axis, with vertices on pixel centres; all of the image lies within the mesh.
std::vector<View> alignedViews(double size) {
  View aligned;
  aligned.target = Vec3(0.5 * size);
  aligned.up = {0.0, 1.0, 0.0};
  aligned.width = aligned.height = 8 * (static_cast<int>(size) - 2) + 1;
  aligned.eye = aligned.target + Vec3(0.0, 0.0, 3.0 * size);
  aligned.parallel_scale = aligned.height / 16.0;
  View perspective = aligned;
  perspective.parallel_scale = 0.0;
  perspective.view_angle = 10.0;
  return {aligned, perspective};
}

TEST(CompositeNativeSheets, ThicknessesAddUpToTheChord) {
  constexpr double n = 6.0;
  for (const double jitter : {0.0, 1e-7, 0.05, 0.2}) {
    for (const std::uint64_t seed : {3U, 4U}) {
      for (const bool mixed : {false, true}) {
        const Subject s = uniform(mixed ? mixedGrid(6, jitter, seed) : hexahedronGrid(6, jitter, seed), 0.07);
        for (const View& view : viewsOf(s, n, 90)) {
          SCOPED_TRACE(testing::Message() << (mixed ? "mixed" : "hexahedra") << ", jitter " << jitter << ", seed "
                                          << seed << ", eye " << view.eye.x << ", scale " << view.parallel_scale);
          expectChords(s, view, Vec3(0.0), Vec3(n));
        }
      }
    }
  }
}

TEST(CompositeNativeSheets, RaysThroughVerticesAndEdges) {
  constexpr double n = 6.0;
  for (const double jitter : {0.0, 0.05, 0.2}) {
    for (const bool mixed : {false, true}) {
      SCOPED_TRACE(testing::Message() << (mixed ? "mixed" : "hexahedra") << ", jitter " << jitter << ", seed 5");
      const Subject s = uniform(mixed ? mixedGrid(6, jitter, 5) : hexahedronGrid(6, jitter, 5), 0.07);
      for (const View& view : alignedViews(n))
        expectChords(s, view, Vec3(0.0), Vec3(n));
    }
  }
}

TEST(CompositeNativeSheets, EveryInstructionSet) {
  const Subject chords = uniform(mixedGrid(5, 0.2, 8), 0.07);
  const Subject picture(mixedGrid(3, 0.2, 9), "", "comb", 1.5);
  const auto targets = composite::native::kernelTargets();
  for (int k = 0; k < static_cast<int>(targets.size()); ++k) {
    SCOPED_TRACE(targets[static_cast<std::size_t>(k)]);
    composite::native::chooseKernelTarget(k);
    for (const View& view : viewsOf(chords, 5.0, 60))
      expectChords(chords, view, Vec3(0.0), Vec3(5.0));
    expectExact(picture, viewOf(picture, {0.6, 0.5, 0.9}, 40, 30));
  }
  composite::native::chooseKernelTarget(-1);
}

TEST(CompositeNativeSheets, PicturesOfMixedCells) {
  for (const double jitter : {0.0, 0.1, 0.2}) {
    for (const char* look : {"viridis", "bands", "comb", "steps"}) {
      SCOPED_TRACE(testing::Message() << jitter << " " << look);
      const Subject s(mixedGrid(3, jitter, 12), "", look, 1.5);
      for (const View& view : viewsOf(s, 3.0, 37))
        expectExact(s, view);
    }
  }
}

// Small cells, over which the field is anything from linear to noise: linear enough or not, no pixel is off by more
// than what the bounds allow.
TEST(CompositeNativeSheets, FieldsThatAreNotQuiteLinear) {
  constexpr double n = 9.0, half_step = 0.5 * step;
  constexpr unsigned seed = 23;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (const double noise : {0.0, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2}) {
    for (const bool mixed : {false, true}) {
      mesh::Source source = mixed ? mixedGrid(9, 0.1, seed) : hexahedronGrid(9, 0.1, seed);
      source.arrays.clear();
      addPointArray(source, "value",
                    [&](const Vec3& p) { return (p.x + 0.6 * p.y - 0.4 * p.z) / n + 2.0 * noise * any(random); });
      Subject s(source, "", "viridis", 1.0);
      std::vector<integrate::ControlPoint> look;
      for (const double v : {0.0, 0.3, 0.35, 0.8, 1.0}) {
        const double value = s.field.lo + v * (s.field.hi - s.field.lo);
        look.push_back({value, {any(random), any(random), any(random)}, 0.3 * (0.1 + v)});
      }
      s.tf = integrate::TransferFunction(look);
      View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 33, 5.0);
      for (const double scale : {0.0, 0.8}) {
        SCOPED_TRACE(testing::Message() << "noise " << noise << (mixed ? ", mixed" : "") << ", scale " << scale);
        view.parallel_scale = scale;
        expectExact(s, view, sort::Algorithm::mpvo, half_step);
      }
    }
  }
}

// Hexahedra with faces that are bent as far as the mesh allows, seen from all around: some are no bodies of planes, on
// some a ray has two intervals, some are cut.
TEST(CompositeNativeSheets, StronglyTwistedCells) {
  const Subject bar(twistedBar(2, 2.0), "", "viridis", 2.0);
  const Subject ball(curvedBall(3), "", "bands", 2.0);
  std::mt19937 random(31);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same views each time
  std::normal_distribution<double> normal;
  for (int k = 0; k < 6; ++k) {
    const Vec3 from(normal(random), normal(random), normal(random));
    SCOPED_TRACE(testing::Message() << "seed 31, view " << k);
    for (const Subject* s : {&bar, &ball}) {
      View view = viewOf(*s, from, 40, 40);
      expectExact(*s, view);
      view.parallel_scale = 1.5;
      expectExact(*s, view);
    }
  }
}

// One cell with every face bent one way or the other, each ray with all of its intervals.
TEST(CompositeNativeSheets, EveryWayToBendAFace) {
  std::mt19937 random(47);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same cells each time
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  int of_planes = 0;
  for (int k = 0; k < 40; ++k) {
    auto points = cube();
    for (Vec3& p : points)
      p += Vec3(uniform(random), uniform(random), uniform(random));
    of_planes += static_cast<int>(codeOf(points) != not_of_planes);
    SCOPED_TRACE(testing::Message() << "seed 47, cell " << k);
    const Subject s(oneCell(mesh::vtk_cell::hexahedron, points), "", "viridis", 2.0);
    expectExact(s, viewOf(s, {1.0, 0.3, 0.2}, 40, 40));
    expectExact(s, viewOf(s, {0.1, -1.0, 0.05}, 40, 40));
  }
  EXPECT_GT(of_planes, 20);
}

// From so near that of a cell's faces one triangle alone is entered, the first of its face or the second, and beside it
// a face that bends inwards is entered and left.
TEST(CompositeNativeSheets, EyesBeforeASingleTriangle) {
  std::mt19937 random(59);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same cells each time
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  const std::vector<Vec3> wedge{{0, 0, 0}, {1, 0, 0}, {0.5, 0.9, 0}, {0, 0, 1}, {1, 0, 1}, {0.5, 0.9, 1}};
  for (int k = 0; k < 60; ++k) {
    auto points = k % 2 == 0 ? cube() : wedge;
    for (Vec3& p : points)
      p += Vec3(uniform(random), uniform(random), uniform(random));
    const auto type = k % 2 == 0 ? mesh::vtk_cell::hexahedron : mesh::vtk_cell::wedge;
    const Subject s(oneCell(type, points), "", "viridis", 2.0);
    mesh::Surface surface;
    mesh::surface(s.mesh, 0, surface);
    for (const auto& t : surface.triangles) {
      const Vec3 &a = s.mesh.points[t[0]], &b = s.mesh.points[t[1]], &c = s.mesh.points[t[2]];
      const Vec3 outward = glm::normalize(glm::cross(b - a, c - a));
      View view = viewOf(s, outward, 24, 24);
      view.eye = (a + b + c) / 3.0 + 0.02 * outward;
      view.target = view.eye - outward;
      view.view_angle = 80.0;
      SCOPED_TRACE(testing::Message() << "seed 59, cell " << k << ", triangle " << t[0] << ' ' << t[1] << ' ' << t[2]);
      expectExact(s, view);
    }
  }
}

TEST(CompositeNativeSheets, ClipPlanesAndFieldsOfCells) {
  mesh::Source source = mixedGrid(3, 0.2, 14);
  addCellArray(source, "material", [](const Vec3& p) { return p.x > 1.5 ? 2.0 : p.y > 1.5 ? 1.0 : 0.0; });
  const Subject smooth(source, "value", "viridis", 1.5);
  const Subject constant(source, "material", "steps", 0.5);
  for (View view : viewsOf(smooth, 3.0, 37)) {
    view.clips = {{{1.5, 1.5, 1.5}, {1.0, 0.3, -0.2}}, {{1.5, 2.1, 1.5}, {0.0, -1.0, 0.1}}};
    expectExact(smooth, view);
    expectExact(constant, view);
  }
}

// The nearest cells last: every pixel must be put in order.
TEST(CompositeNativeSheets, WrongOrderIsRepaired) {
  const Subject s(mixedGrid(3, 0.2, 15), "", "viridis", 1.5);
  for (const View& view : viewsOf(s, 3.0, 37)) {
    SCOPED_TRACE(testing::Message() << "eye " << view.eye.x << ", scale " << view.parallel_scale);
    expectExact(s, view, sort::Algorithm::none);
    expectExact(s, view);
  }
}

}  // namespace
}  // namespace spillikin::tests
