// The native compositor against a plain ray caster in double precision.
#include <gtest/gtest.h>

#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <random>

#include "spillikin/base/error.h"
#include "spillikin/composite/backends.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/project/camera.h"
#include "tests/composite_native_checks.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

TEST(CompositeNative, DelaunayCubeInPerspective) {
  for (const char* look : {"viridis", "bands", "comb", "steps"}) {
    SCOPED_TRACE(look);
    const Subject s(delaunayCube(150, 7), "", look, 6.0);
    expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 70, 51));
  }
}

// One ramp of extinction under colours that bend wildly, from thin to dense: cells are not cut at the bends.
TEST(CompositeNative, ColoursThatBendWhereExtinctionRunsStraight) {
  std::mt19937 random(20);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same colours each time
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const double extinction : {0.3, 3.0, 30.0}) {
    for (const int points : {3, 9, 40}) {
      SCOPED_TRACE(testing::Message() << extinction << ", " << points << " colours");
      Subject s(delaunayCube(150, 7), "", "viridis", 1.0);
      std::vector<integrate::ControlPoint> look;
      for (int k = 0; k < points; ++k) {
        const double v = static_cast<double>(k) / (points - 1);
        look.push_back({s.field.lo + v * (s.field.hi - s.field.lo),
                        {uniform(random), uniform(random), uniform(random)},
                        extinction * (0.1 + v)});
      }
      s.tf = integrate::TransferFunction(look);
      expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 35, 26));
      expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 35, 26), sort::Algorithm::centroid);
    }
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

TEST(CompositeNative, ThicknessesAddUpToTheChord) {
  const Subject s = uniform(delaunayCube(3000, 21), 0.7);
  View view = viewOf(s, {1.0, 0.7, 0.4}, 211, 173, 1.6);
  expectChords(s, view, Vec3(0.0), Vec3(1.0));
  view.parallel_scale = 0.7;
  expectChords(s, view, Vec3(0.0), Vec3(1.0));
  view.parallel_scale = 0.0;
  view.eye = {0.3, 0.6, 0.55};
  view.view_angle = 100.0;
  expectChords(s, view, Vec3(0.0), Vec3(1.0));
}

TEST(CompositeNative, ThicknessesAddUpInWholeHexahedra) {
  const Subject s = uniform(hexahedronGrid(9, 0.2, 5), 0.05);
  View view = viewOf(s, {1.0, 0.7, 0.4}, 111, 93, 1.6);
  expectChords(s, view, Vec3(0.0), Vec3(9.0));
  view.parallel_scale = 7.0;
  expectChords(s, view, Vec3(0.0), Vec3(9.0));
  view.parallel_scale = 0.0;
  view.eye = {3.3, 5.6, 4.55};
  view.view_angle = 100.0;
  expectChords(s, view, Vec3(0.0), Vec3(9.0));
}

// Vertices and edges on pixel centres, faces edge-on: every ray must still find its chord, once.
TEST(CompositeNative, CellsAlignedWithThePixels) {
  for (const double size : {1.0, 0.1}) {  // exact in binary, and not
    for (const bool whole : {true, false}) {
      SCOPED_TRACE(testing::Message() << size << (whole ? " whole" : " tetrahedra"));
      mesh::Source source = whole ? hexahedronGrid(8) : tetrahedronGrid(8);
      for (Vec3& p : source.points)
        p *= size;
      const Subject s = uniform(source, 0.05 / size);
      View view;
      view.target = Vec3(4.0 * size);
      view.eye = view.target + Vec3(0.0, 0.0, 26.0 * size);
      view.up = {0.0, 1.0, 0.0};
      view.width = view.height = 33;
      view.parallel_scale = 33.0 / 8.0 * size;  // four pixels to a cell
      const auto native = composite::makeNative();
      Image image;
      drawWith(*native, s, view, orderOf(s, view), image);
      double worst = 0.0;
      for (int y = 2; y < 31; ++y) {
        for (int x = 2; x < 31; ++x)
          worst = std::max(worst, std::abs(double(image.pixel(x, y)[3]) - (1.0 - std::exp(-0.05 * 8.0))));
      }
      EXPECT_LE(worst, 1e-5);
    }
  }
}

TEST(CompositeNative, SameBitsOnAnyNumberOfThreads) {
  const Subject s(delaunayCube(4000, 5), "", "bands", 8.0);
  const View view = viewOf(s, {0.3, 0.6, 0.8}, 333, 222);
  const sort::Order order = orderOf(s, view);
  Image first;
  for (const std::size_t threads : {1U, 2U, 3U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto native = composite::makeNative();
    Image image;
    drawWith(*native, s, view, order, image);
    if (threads == 1) first = image;
    EXPECT_EQ(first.rgba, image.rgba) << threads;
  }
}

// Whatever the picture held before, tiles without a cell included, and wherever its rows begin in memory.
TEST(CompositeNative, EveryPixelIsWritten) {
  const Subject s(delaunayCube(60, 4), "", "viridis", 8.0);
  for (const int width : {97, 128, 131}) {
    SCOPED_TRACE(width);
    View view = viewOf(s, {0.3, 0.6, 0.8}, width, 109);
    view.view_angle = 100.0;  // most tiles are empty
    const auto native = composite::makeNative();
    const sort::Order order = orderOf(s, view);
    Image clean, used(width, 109);
    drawWith(*native, s, view, order, clean);
    std::fill(used.rgba.begin(), used.rgba.end(), 0.7F);
    drawWith(*native, s, view, order, used);
    EXPECT_EQ(clean.rgba, used.rgba);
    EXPECT_EQ(std::vector<float>(clean.rgba.begin(), clean.rgba.begin() + 4), std::vector<float>(4, 0.0F));
  }
}

TEST(CompositeNative, EveryInstructionSetDrawsTheSame) {
  const Subject tetrahedra(delaunayCube(2000, 6), "", "viridis", 8.0);
  const Subject hexahedra(hexahedronGrid(6, 0.15, 3), "", "comb", 1.5);
  for (const Subject* s : {&tetrahedra, &hexahedra}) {
    const View view = viewOf(*s, {0.3, 0.6, 0.8}, 133, 122);
    const sort::Order order = orderOf(*s, view);
    Image best;
    const auto targets = composite::native::kernelTargets();
    ASSERT_FALSE(targets.empty());
    for (int k = 0; k < static_cast<int>(targets.size()); ++k) {
      composite::native::chooseKernelTarget(k);
      Image image;
      drawWith(*composite::makeNative(), *s, view, order, image);
      if (k == 0) best = image;
      EXPECT_LE(largestDifference(best, image), 0.02 * step) << targets[static_cast<std::size_t>(k)];
    }
    composite::native::chooseKernelTarget(-1);
  }
}

TEST(CompositeNative, EveryCellType) {
  const std::vector<Vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const auto prism = [](int n) {
    std::vector<Vec3> points;
    for (const double z : {0.0, 1.3}) {
      for (int k = 0; k < n; ++k)
        points.emplace_back(std::cos(2.0 * M_PI * k / n), std::sin(2.0 * M_PI * k / n), z);
    }
    return points;
  };
  std::vector<Vec3> pyramid = square;
  pyramid.emplace_back(0.4, 0.6, 1.1);
  const std::vector<std::pair<std::uint8_t, std::vector<Vec3>>> cells = {
      {mesh::vtk_cell::tetra, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.3, 1}}},
      {mesh::vtk_cell::pyramid, pyramid},
      {mesh::vtk_cell::wedge, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1.2}, {1, 0, 0.9}}},
      {mesh::vtk_cell::pentagonal_prism, prism(5)},
      {mesh::vtk_cell::hexagonal_prism, prism(6)},
      {mesh::vtk_cell::polyhedron, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0.1}, {0.2, 0.3, 1}, {0.8, 0.9, 1.1}}}};
  for (const auto& [type, points] : cells) {
    SCOPED_TRACE(int(type));
    const Subject s(oneCell(type, points), "", "coolwarm", 2.0);
    expectExact(s, viewOf(s, {0.7, 0.5, 0.6}, 60, 50));
    expectExact(s, viewOf(s, {-0.2, -0.5, -0.6}, 60, 50));
  }
}

TEST(CompositeNative, NonconvexMeshesInAnyOrder) {
  for (const mesh::Source& source : {shell(4), interlockedTori(2)}) {
    const Subject s(source, "", "viridis", 5.0);
    const View view = viewOf(s, {0.3, 0.6, 0.8}, 60, 45);
    expectExact(s, view, sort::Algorithm::mpvo);
    expectExact(s, view, sort::Algorithm::centroid);
  }
}

TEST(CompositeNative, NearlyOpaque) {
  const Subject s(delaunayCube(150, 12), "", "coolwarm", 3000.0);
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48), sort::Algorithm::mpvo, 0.2 * step);
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48), sort::Algorithm::none, 0.2 * step);
}

// One plate of large tetrahedra between blocks of cells a hundred times smaller.
TEST(CompositeNative, LargeCellsAmongSmallOnes) {
  mesh::Source blocks = tetrahedronGrid(5, 0.1, 2);
  for (Vec3& p : blocks.points)
    p = {p.x * 0.02 + 0.3, p.y * 0.02 + 0.4, p.z * 0.02};
  mesh::Source plate = tetrahedronGrid(1);
  for (Vec3& p : plate.points)
    p = {p.x * 1.0, p.y * 1.0, p.z * 0.05 + 0.2};
  mesh::Source far = blocks;
  for (Vec3& p : far.points)
    p.z -= 0.3;
  for (Vec3& p : blocks.points)
    p.z += 0.35;
  const Subject s(join(join(blocks, plate), far), "", "viridis", 40.0);
  View view;
  view.target = {0.35, 0.45, 0.2};
  view.eye = {0.5, 0.6, 3.0};
  view.view_angle = 14.0;
  view.width = 70;
  view.height = 60;
  expectExact(s, view, sort::Algorithm::centroid);
}

// How far a pixel's colour, freed of its opacity, is from all that the function shows between two values.
double outOfRange(const integrate::TransferFunction& tf, const float* pixel, double lo, double hi) {
  const double opacity = pixel[3];
  double worst = 0.0;
  for (int c = 0; c < 3; ++c) {
    double least = 1.0, most = 0.0;
    for (int k = 0; k <= 400; ++k) {
      const double color = tf(lo + (hi - lo) * k / 400).color[static_cast<std::size_t>(c)];
      least = std::min(least, color);
      most = std::max(most, color);
    }
    worst = std::max({worst, pixel[c] - most * opacity, least * opacity - pixel[c]});
  }
  return worst;
}

// A cell so flat that the rounding of depths in float moves the scalar out of the cell's range shows no colour that the
// range does not have. Flat cells of all thicknesses, seen from all around; another cell widens the field's range.
TEST(CompositeNative, FlatCellsKeepTheirRange) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (double thickness = 1e-2; thickness > 5e-7; thickness *= 0.1) {
    SCOPED_TRACE(thickness);
    const mesh::Source flat = oneCell(mesh::vtk_cell::tetra, {{0.0, 0.0, 0.0},
                                                              {1.0, 0.0, thickness * unit(random)},
                                                              {1.0, 1.0, thickness * unit(random)},
                                                              {0.0, 1.0, -thickness}});
    mesh::Source source = join(flat, oneCell(mesh::vtk_cell::tetra, {{30, 0, 0}, {31, 0, 0}, {30, 1, 0}, {30, 0, 1}}));
    addPointArray(source, "level", [](const Vec3& p) { return p.x > 2.0 ? p.x - 30.0 : 0.45 + 0.15 * p.x * p.y; });
    const Subject s(source, "level", "viridis", 0.3 / thickness);
    for (const Vec3 from : {Vec3(0.1, 0.2, 1.0), Vec3(0.8, 0.3, -0.4)}) {
      View view = viewOf(s, from, 60, 60);
      view.target = {0.5, 0.5, 0.0};
      view.eye = view.target + 3.0 * from;
      Image image;
      drawWith(*composite::makeNative(), s, view, orderOf(s, view), image);
      double outside = 0.0, opaque = 0.0;
      for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
          outside = std::max(outside, outOfRange(s.tf, image.pixel(x, y), 0.45, 0.6));
          opaque = std::max<double>(opaque, image.pixel(x, y)[3]);
        }
      }
      EXPECT_LE(outside, 0.15 * step);
      EXPECT_GE(opaque, 0.03);
    }
  }
}

TEST(CompositeNative, CellFields) {
  mesh::Source source = delaunayCube(150, 13);
  addCellArray(source, "material", [](const Vec3& p) { return p.x > 0.5 ? 2.0 : p.y > 0.5 ? 1.0 : 0.0; });
  const Subject tetrahedra(source, "material", "steps", 3.0);
  expectExact(tetrahedra, viewOf(tetrahedra, {1.0, 0.6, 0.8}, 64, 48));
  mesh::Source grid = hexahedronGrid(4, 0.1, 2);
  addCellArray(grid, "material", [](const Vec3& p) { return p.x > 2.0 ? 2.0 : p.y > 2.0 ? 1.0 : 0.0; });
  const Subject hexahedra(grid, "material", "steps", 0.5);
  expectExact(hexahedra, viewOf(hexahedra, {1.0, 0.6, 0.8}, 64, 48));
}

// A region whose scalar is a jump's value lies on the jump's upper side, to the last bit.
TEST(CompositeNative, ConstantAtAJump) {
  const Subject s = constantAtJumps();
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48));
}

TEST(CompositeNative, HiddenCellsAreNotDrawn) {
  Subject s(delaunayCube(150, 15), "", "viridis", 6.0);
  s.field.hidden.assign(s.mesh.cell_count(), 0);
  for (std::size_t c = 0; c < s.mesh.cell_count(); c += 3)
    s.field.hidden[c] = 1;
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48));
}

// Cells of a few pixels each take a short series about their middle: seen from nearby at a wide angle, where it is at
// its worst, from far away, and without perspective; clear, and dense enough for some to be left to longer ones.
TEST(CompositeNative, SmallCellsAreRightFromAnywhere) {
  for (const double density : {0.6, 6.0}) {
    const Subject s(delaunayCube(800, 23), "", "viridis", density);
    const auto expectRight = [&](const View& view) { expectExact(s, view, sort::Algorithm::mpvo, 0.1 * step); };
    expectRight(viewOf(s, {1.0, 0.6, 0.8}, 40, 28));
    View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 28, 0.8);
    view.view_angle = 110.0;
    expectRight(view);
    view = viewOf(s, {0.2, 0.9, -0.5}, 40, 28, 4000.0);
    view.view_angle = 0.03;
    expectRight(view);
    view.parallel_scale = 0.8;
    expectRight(view);
  }
}

// Every third cell in two pieces, as a cycle would be cut: together they are the cell.
TEST(CompositeNative, PiecesMakeUpTheCell) {
  mesh::Source small = hexahedronGrid(4, 0.1, 7);
  for (Vec3& p : small.points)
    p *= 1e-7;
  for (const mesh::Source& source : {delaunayCube(150, 16), hexahedronGrid(4, 0.1, 7), small}) {
    const Subject s(source, "", "viridis", glm::length(source.points.back()) < 1e-3 ? 2e7 : 2.0);
    for (const bool parallel : {false, true}) {
      View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
      if (parallel) view.parallel_scale = 0.45 * glm::length(view.eye - view.target) / 2.5;
      const sort::Order whole = orderOf(s, view);
      sort::Order cut;
      cut.exact = whole.exact;
      for (std::size_t i = 0; i < whole.cells.size(); ++i) {
        cut.cells.push_back(whole.cells[i]);
        if (i % 3 != 0) continue;
        const auto corners = s.mesh.vertices(whole.cells[i]);
        const Vec3 middle = 0.5 * (s.mesh.points[corners[0]] + s.mesh.points[corners[2]]);
        const Vec3 sight = glm::normalize(view.target - view.eye) + Vec3(0.1, 0.2, -0.1);
        const sort::HalfSpace behind{sight, -glm::dot(sight, middle)}, before{-sight, glm::dot(sight, middle)};
        cut.cuts.add(static_cast<std::uint32_t>(cut.cells.size() - 1), {&behind, 1});
        cut.cells.push_back(whole.cells[i]);
        cut.cuts.add(static_cast<std::uint32_t>(cut.cells.size() - 1), {&before, 1});
      }
      const auto native = composite::makeNative();
      Image image;
      const composite::FrameStats stats = drawWith(*native, s, view, cut, image);
      EXPECT_LE(largestDifference(image, castRays(s, project::Camera(view))), 0.1 * step);
      EXPECT_EQ(stats.unresolved, 0U);
      // In any order, too: pieces are collected and sorted again.
      std::reverse(cut.cells.begin(), cut.cells.end());
      const sort::Cuts cuts = std::exchange(cut.cuts, {});
      for (std::size_t i = cuts.size(); i-- > 0;)
        cut.cuts.add(static_cast<std::uint32_t>(cut.cells.size() - 1 - cuts[i].entry), cuts[i].keep);
      const composite::FrameStats repaired = drawWith(*native, s, view, cut, image);
      EXPECT_LE(largestDifference(image, castRays(s, project::Camera(view))), 0.1 * step);
      EXPECT_GT(repaired.resolved, 0U);
      EXPECT_EQ(repaired.unresolved, 0U);
    }
  }
}

TEST(CompositeNative, ImagesOfAnySize) {
  const Subject s(delaunayCube(100, 17), "", "viridis", 6.0);
  for (const auto& [width, height] : {std::pair{1, 1}, {33, 1}, {1, 67}, {31, 33}, {129, 5}}) {
    SCOPED_TRACE(width);
    View view = viewOf(s, {1.0, 0.6, 0.8}, width, height, 1.2);
    expectExact(s, view);
  }
}

// Wider than one region of tiles: the work goes on region by region.
TEST(CompositeNative, TheWidestAndTheHighestImage) {
  const Subject s(delaunayCube(20, 17), "", "viridis", 6.0);
  for (const auto& [width, height] : {std::pair{16384, 1}, {1, 16384}}) {
    SCOPED_TRACE(width);
    View view = viewOf(s, {1.0, 0.6, 0.8}, width, height, 1.2);
    view.parallel_scale = width > height ? 2e-4 : 1.5;  // half the height of what is seen
    expectExact(s, view);
  }
}

// A million cells on one pixel, and on four.
TEST(CompositeNative, AMillionCellsOnOnePixel) {
  const Subject s(tetrahedronGrid(55, 0.15, 3), "", "viridis", 0.02);
  for (const int size : {1, 2})
    expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, size, size, 1.2));
}

// Cells that cover every pixel, from outside and around the eye, and one beside which all others are small.
TEST(CompositeNative, OneCellCoversTheImage) {
  const mesh::Source one = oneCell(mesh::vtk_cell::tetra, {{-9, -9, -5}, {9, -9, -5}, {0, 12, -5}, {0, 0, 4}});
  const Subject s(one, "", "viridis", 0.1);
  View view;
  view.eye = {0.3, 0.2, 5.0};
  view.target = {0.0, 0.1, 0.0};
  view.view_angle = 20.0;
  view.width = 97;
  view.height = 83;
  expectExact(s, view);
  view.eye.z = 1.0;
  view.view_angle = 110.0;
  expectExact(s, view);
}

TEST(CompositeNative, FarAwayAndAnyUnit) {
  for (const double unit : {1e-9, 1.0, 1e9}) {
    SCOPED_TRACE(unit);
    mesh::Source source = delaunayCube(150, 18);
    for (Vec3& p : source.points)
      p *= unit;
    const Subject s(source, "", "viridis", 6.0 / unit);
    expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48));
    View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48, 1e5);
    view.view_angle = 0.0006;
    expectExact(s, view);
    view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48, 0.8);
    view.parallel_scale = 0.8 * unit;
    expectExact(s, view);
  }
}

TEST(CompositeNative, CellsThatOverlapInSpaceAreReported) {
  mesh::Source a = tetrahedronGrid(2);
  mesh::Source b = a;
  for (Vec3& p : b.points)
    p += Vec3(0.31, 0.23, 0.41);
  const Subject s(join(a, b), "", "viridis", 1.0);
  Image image;
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
  const composite::FrameStats stats =
      drawWith(*composite::makeNative(), s, view, orderOf(s, view, sort::Algorithm::centroid), image);
  EXPECT_GT(stats.unresolved, 0U);
  EXPECT_FALSE(stats.certified);
}

TEST(CompositeNative, OtherIntegrationsAreRefused) {
  const Subject s(delaunayCube(50, 19), "", "viridis", 1.0);
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 8, 8);
  const project::Camera camera(view);
  const sort::Order order = orderOf(s, view);
  Image image;
  EXPECT_THROW(composite::makeNative()->draw(
                   {s.mesh, s.field, s.tf, camera, order, composite::Integration::preintegrated}, image),
               Error);
}

}  // namespace
}  // namespace spillikin::tests
