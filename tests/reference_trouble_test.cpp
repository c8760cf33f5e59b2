// Bad input: overlapping, hidden, inverted, collapsed, degenerate and nonconvex cells; faces seen edge-on.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>
#include <random>

#include "reference_support.h"
#include "spillikin/base/error.h"
#include "spillikin/mesh/subdivide.h"

namespace spillikin::tests {
namespace {

using reference::Interval;
using reference::Options;
using reference::Report;

mesh::Source moved(mesh::Source source, const Vec3& by) {
  for (Vec3& p : source.points)
    p += by;
  return source;
}

TEST(ReferenceTrouble, OverlappingCellsAreReported) {
  const mesh::Source a = hexahedronGrid(1), b = moved(hexahedronGrid(1), {0.0, 0.0, 0.75});
  const Scene scene(join(a, b));
  View view = lookAt({0.4, 0.45, 5.0}, {0.4, 0.45, 0.0}, 8, 8);
  view.parallel_scale = 0.3;
  Report report;
  const Image image = scene.caster.render(view, constantMedium(1.0), {}, &report);
  EXPECT_EQ(report.overlaps, 64U);
  EXPECT_EQ(report.gaps, 0U);
  ASSERT_EQ(report.overlapping.size(), 1U);
  EXPECT_NE(report.overlapping[0][0], report.overlapping[0][1]);
  EXPECT_EQ(report.overlapping_at[0], (std::array<double, 2>{0.5, 0.5}));
  // Both are drawn in full.
  EXPECT_NEAR(image.pixel(4, 4)[3], -std::expm1(-2.0), 1e-6);
}

TEST(ReferenceTrouble, TouchingCellsAreNotReported) {
  for (const double at : {1.0, 1.0 + 1e-15, 1.0 - 1e-16}) {
    const Scene scene(join(hexahedronGrid(1), moved(hexahedronGrid(1), {0.0, 0.0, at})));
    Report report;
    scene.caster.render(lookAt({2.0, 1.7, 4.0}, {0.5, 0.5, 1.0}, 32, 32), constantMedium(1.0), {}, &report);
    EXPECT_EQ(report.overlaps, 0U);
    EXPECT_GT(report.intervals, 300U);
  }
}

TEST(ReferenceTrouble, NoFalseAlarms) {
  const Vec3 far(-1e6, 1e6, 2e6);
  mesh::Source source = delaunayCube(3000, 3);
  for (Vec3& p : source.points)
    p = far + p * 0x1p-6;
  const Scene scene(source);
  Report report;
  scene.caster.render(lookAt(far + Vec3(0.05, 0.03, 0.06), far + Vec3(0x1p-7), 64, 64), constantMedium(1.0), {},
                      &report);
  EXPECT_GT(report.intervals, 30000U);
  EXPECT_EQ(report.overlaps, 0U);
  EXPECT_EQ(report.gaps, 0U);
}

// Rays through vertices and along faces are full of cells that they only touch.
TEST(ReferenceTrouble, NoFalseAlarmsWhenAligned) {
  for (const bool tetrahedra : {false, true}) {
    const Scene scene(tetrahedra ? tetrahedronGrid(8) : hexahedronGrid(8));
    for (const Vec3 eye : {Vec3(4, 4, 25), Vec3(25, 4, 25), Vec3(25, 25, 25), Vec3(10, 13, 25)}) {
      for (const double scale : {0.0, 33 / 8.0}) {
        View view = lookAt(eye, {4, 4, 4}, 65, 65);
        view.parallel_scale = scale;
        Report report;
        scene.caster.render(view, constantMedium(1.0), {}, &report);
        EXPECT_GT(report.intervals, 5000U);
        EXPECT_EQ(report.gaps, 0U);
        EXPECT_EQ(report.overlaps, 0U);
      }
    }
  }
}

// What lies behind the eye is not looked at, and its absence is no gap.
TEST(ReferenceTrouble, NoFalseAlarmsFromInside) {
  const Scene random(delaunayCube(2000, 8)), grid(hexahedronGrid(8));
  for (int n = 0; n < 6; ++n) {
    const Vec3 eye(0.31 + 0.07 * n, 0.5, 0.43);
    for (const bool in_grid : {false, true}) {
      View view = lookAt(in_grid ? 8.0 * eye : eye, in_grid ? Vec3(4.0, 3.0, 0.0) : Vec3(0.5, 0.4, 0.0), 40, 40);
      view.view_angle = 100.0;
      Report report;
      (in_grid ? grid : random).caster.render(view, constantMedium(1.0), {}, &report);
      EXPECT_GT(report.intervals, 1600U);
      EXPECT_EQ(report.gaps, 0U);
      EXPECT_EQ(report.overlaps, 0U);
    }
  }
}

TEST(ReferenceTrouble, HiddenCellsAreNotThere) {
  mesh::Source source = hexahedronGrid(3);
  source.arrays.clear();
  addCellArray(source, "c", [](const Vec3& p) { return p.x > 1.0 && p.x < 2.0 ? std::nan("") : 1.0; });
  const Scene scene(source, "c");
  ASSERT_EQ(scene.field.hidden_count, 9U);
  View view = lookAt({9.0, 1.4, 1.6}, {0.0, 1.4, 1.6}, 9, 9);
  view.parallel_scale = 1.2;
  Report report;
  const Image image = scene.caster.render(view, constantMedium(1.0), {}, &report);
  for (std::size_t n = 3; n < image.rgba.size(); n += 4)
    EXPECT_NEAR(image.rgba[n], -std::expm1(-2.0), 1e-6);
  EXPECT_EQ(report.gaps, 0U);
  EXPECT_EQ(report.intervals, 2U * 81U);
}

TEST(ReferenceTrouble, AllCellsHidden) {
  mesh::Source source = hexahedronGrid(2);
  addCellArray(source, "c", [](const Vec3&) { return std::nan(""); });
  const Scene scene(source, "c");
  Report report;
  const Image image = scene.caster.render(lookAt({5, 4, 6}, Vec3(1.0), 16, 16), constantMedium(1.0), {}, &report);
  EXPECT_EQ(image.rgba, std::vector<float>(16 * 16 * 4, 0.0F));
  EXPECT_EQ(report.rays, 256U);
  EXPECT_EQ(report.intervals, 0U);
}

TEST(ReferenceTrouble, FieldOfAnotherMesh) {
  const Scene scene(hexahedronGrid(2)), other(hexahedronGrid(3));
  EXPECT_THROW(reference::RayCaster(scene.mesh, other.field), Error);
}

// The order of a file's ids can turn cells inside out: nothing changes in the picture.
TEST(ReferenceTrouble, InvertedCells) {
  const mesh::Source good = hexahedronGrid(3, 0.1);
  mesh::Source bad = good;
  for (std::size_t c = 0; c < bad.types.size(); c += 2) {
    const auto ids = bad.connectivity.begin() + static_cast<std::ptrdiff_t>(bad.offsets[c]);
    std::swap_ranges(ids, ids + 4, ids + 4);
  }
  const View view = lookAt({8, 7, 9}, Vec3(1.5), 40, 40);
  const integrate::TransferFunction tf = ramp(0.5, 3.5, 3.0);
  const Scene a(good), b(bad);
  Report report;
  const Image x = a.caster.render(view, tf, {}), y = b.caster.render(view, tf, {}, &report);
  for (std::size_t n = 0; n < x.rgba.size(); ++n)
    ASSERT_NEAR(x.rgba[n], y.rgba[n], 1e-6);
  EXPECT_EQ(report.overlaps, 0U);
}

// One cell of every kind against its volume: chord times pixel area adds up to it.
TEST(ReferenceTrouble, EveryCellTypeFillsItsVolume) {
  const std::vector<Vec3> tetra{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<Vec3> pyramid{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.3, 0.4, 1}};
  const std::vector<Vec3> wedge{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}};
  std::vector<Vec3> pentagon, hexagon;
  for (const double z : {0.0, 1.0}) {
    for (int n = 0; n < 5; ++n)
      pentagon.emplace_back(std::cos(1.2566370614 * n), std::sin(1.2566370614 * n), z);
    for (int n = 0; n < 6; ++n)
      hexagon.emplace_back(std::cos(1.0471975512 * n), std::sin(1.0471975512 * n), z);
  }
  std::vector<Vec3> octahedron{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const struct {
    mesh::Source source;
    double volume;
  } cases[] = {
      {oneCell(10, tetra), 1.0 / 6},         {oneCell(14, pyramid), 1.0 / 3},      {oneCell(13, wedge), 0.5},
      {oneCell(15, pentagon), 2.3776412907}, {oneCell(16, hexagon), 2.5980762114}, {oneCell(42, octahedron), 4.0 / 3},
      {oneCell(42, pentagon), 2.3776412907}};
  for (const auto& c : cases) {
    const Scene scene(c.source);
    for (const mesh::FieldModel model : {mesh::FieldModel::face, mesh::FieldModel::tets}) {
      View view = lookAt({0.4, -3.0, 5.0}, {0.0, 0.0, 0.4}, 250, 250);
      view.parallel_scale = 1.6;
      Options options;
      options.model = model;
      std::vector<Interval> intervals;
      double volume = 0.0;
      for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
          scene.caster.intervals(view, x + 0.5, y + 0.5, options, intervals);
          volume += totalLength(intervals);
        }
      }
      volume *= std::pow(2.0 * view.parallel_scale / view.height, 2);
      EXPECT_NEAR(volume, c.volume, 2e-3 * c.volume) << int{c.source.types[0]};
    }
  }
}

// A cell of a real grid, warped so that in some attitudes, which number its corners in other orders, its tetrahedra
// overlap: it is then coned from a point inside, as it is drawn, and every ray is as long in its tetrahedra as in the
// cell.
TEST(ReferenceTrouble, TetrahedraOfAWarpedCellFillIt) {
  const std::vector<Vec3> corners{{0.008, -0.144, 0.007}, {0.186, -0.166, -0.144}, {0.186, 0.126, -0.188},
                                  {0.008, 0.150, -0.037}, {-0.096, -0.113, 0.130}, {0.105, -0.134, 0.197},
                                  {0.064, 0.160, 0.127},  {-0.130, 0.182, 0.065}};
  std::size_t coned = 0;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int attitude = 0; attitude < 40; ++attitude) {
    SCOPED_TRACE(attitude);
    const Vec3 x = glm::normalize(Vec3(unit(random), unit(random), unit(random)));
    const Vec3 y = glm::normalize(glm::cross(x, Vec3(unit(random), unit(random), unit(random))));
    std::vector<Vec3> turned;
    for (const Vec3& p : corners)
      turned.push_back(p.x * x + p.y * y + p.z * glm::cross(x, y));
    const Scene scene(oneCell(12, turned));
    coned += mesh::tetrahedralize(scene.mesh).centre_offset.size() - 1;
    Options whole, tets;
    tets.model = mesh::FieldModel::tets;
    View view = lookAt({0.5, -0.7, 1.1}, {0.02, 0.01, 0.02}, 40, 40);
    view.parallel_scale = 0.3;
    Report report;
    scene.caster.render(view, constantMedium(1.0), tets, &report);
    EXPECT_EQ(report.overlaps, 0U);
    std::vector<Interval> in_cell, in_tetrahedra;
    double length = 0.0;
    for (int row = 0; row < view.height; ++row) {
      for (int column = 0; column < view.width; ++column) {
        scene.caster.intervals(view, column + 0.5, row + 0.5, whole, in_cell);
        scene.caster.intervals(view, column + 0.5, row + 0.5, tets, in_tetrahedra);
        ASSERT_NEAR(totalLength(in_tetrahedra), totalLength(in_cell), 1e-9) << column << ' ' << row;
        length += totalLength(in_cell);
      }
    }
    EXPECT_GT(length, 30.0);
  }
  EXPECT_GT(coned, 0U);
}

// A hexahedron whose top has two high corners, at (0,0) and (1,1), and two low ones. Cut from low to low the top is a
// valley, and a level ray along x = y leaves the cell and comes back; cut from high to high it is a ridge.
TEST(ReferenceTrouble, NonconvexCellInSeveralIntervals) {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0},   {1, 1, 0}, {0, 1, 0},
                                  {0, 0, 1}, {1, 0, 0.2}, {1, 1, 1}, {0, 1, 0.2}};
  const Scene scene(oneCell(12, corners));
  bool valley = false;
  for (const auto& quad : scene.mesh.quad) {
    const Vec3 &a = scene.mesh.points[quad[0]], &c = scene.mesh.points[quad[2]];
    if (a.z > 0.0 && c.z > 0.0 && a.x != c.x && a.y != c.y) valley = a.z == 0.2;
  }
  View view = lookAt({-3.0, -3.0, 0.6}, {0.5, 0.5, 0.6}, 9, 9);
  view.up = {0, 0, 1};
  view.parallel_scale = 0.1;
  std::vector<Interval> intervals;
  scene.caster.intervals(view, 4.5, 4.5, {}, intervals);
  ASSERT_EQ(intervals.size(), valley ? 2U : 1U);
  EXPECT_NEAR(totalLength(intervals), std::sqrt(2.0) * (valley ? 0.5 : 1.0), 1e-12);
  if (valley) {
    EXPECT_NEAR(intervals[1].enter - intervals[0].leave, std::sqrt(0.5), 1e-12);
  }
}

TEST(ReferenceTrouble, ThinAndTinyCells) {
  mesh::Source source = tetrahedronGrid(4);
  for (Vec3& p : source.points)
    p.z *= 1e-12;
  const Scene scene(source);
  View view = lookAt({2.2, 2.3, 5.0}, {2.2, 2.3, 0.0}, 16, 16);
  view.parallel_scale = 1.5;
  std::vector<Interval> intervals;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      scene.caster.intervals(view, x + 0.5, y + 0.5, {}, intervals);
      ASSERT_NEAR(totalLength(intervals), 4e-12, 1e-14);
    }
  }
}

// A box seen so that its sides run along the lines of sight: the sides' pixels and no others.
TEST(ReferenceTrouble, EdgeOnFacesOfABox) {
  const Scene scene(hexahedronGrid(2));
  View view = lookAt({1, 1, 9}, {1, 1, 0}, 30, 30);
  view.parallel_scale = 1.5;  // 10 pixels to the unit: the box spans pixels 5 to 25
  std::vector<std::uint8_t> mask = scene.caster.edgeOnMask(view);
  EXPECT_EQ(std::accumulate(mask.begin(), mask.end(), 0), 0);  // centres are half a pixel from the sides
  view.width = view.height = 29;
  view.parallel_scale = 1.45;  // sides at 4.5 and 24.5
  mask = scene.caster.edgeOnMask(view);
  for (int y = 0; y < 29; ++y) {
    for (int x = 0; x < 29; ++x) {
      const bool ring = (x == 4 || x == 24 || y == 4 || y == 24) && x >= 4 && x <= 24 && y >= 4 && y <= 24;
      ASSERT_EQ(mask[static_cast<std::size_t>(29 * y + x)], ring ? 1 : 0) << x << "," << y;
    }
  }
}

// In perspective only faces whose plane holds the eye are edge-on; also with the eye inside their extent.
TEST(ReferenceTrouble, EdgeOnInPerspective) {
  const Scene scene(hexahedronGrid(2));
  const auto count = [&](const View& view) {
    const std::vector<std::uint8_t> mask = scene.caster.edgeOnMask(view);
    return std::accumulate(mask.begin(), mask.end(), 0);
  };
  EXPECT_EQ(count(lookAt({3, 4, 9}, {1, 1, 1}, 65, 65)), 0);
  // The eye in the plane x = 2, looking along it: the face is the middle column.
  const View view = lookAt({2, 1, 9}, {2, 1, 0}, 65, 65);
  EXPECT_GT(count(view), 10);
  const std::vector<std::uint8_t> mask = scene.caster.edgeOnMask(view);
  for (std::size_t n = 0; n < mask.size(); ++n) {
    EXPECT_TRUE(mask[n] == 0 || n % 65 == 32) << n;
  }
  // The eye on the boundary, half of the face behind it.
  EXPECT_GT(count(lookAt({2, 1, 1}, {2, 1, 0}, 65, 65)), 10);
}

}  // namespace
}  // namespace spillikin::tests
