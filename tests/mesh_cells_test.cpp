// Every cell type, however it is numbered, turned or collapsed.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <random>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

using tests::checkInvariants;
using tests::volume;

struct Shape {
  std::uint8_t vtk;
  CellType type;
  std::vector<Vec3> points;
  double volume;
};

// A prism over a regular polygon, as VTK numbers it.
Shape prism(std::uint8_t vtk, CellType type, int n) {
  Shape shape{vtk, type, {}, 0.0};
  for (const double z : {0.0, 1.0}) {
    for (int k = 0; k < n; ++k) {
      const double angle = 2.0 * std::acos(-1.0) * k / n;
      shape.points.emplace_back(std::cos(angle), std::sin(angle), z);
    }
  }
  shape.volume = 0.5 * n * std::sin(2.0 * std::acos(-1.0) / n);
  return shape;
}

const std::vector<Vec3> cube{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

std::vector<Shape> shapes() {
  return {
      {vtk_cell::tetra, CellType::tetrahedron, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 1.0 / 6.0},
      {vtk_cell::voxel,
       CellType::hexahedron,
       {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}},
       1.0},
      {vtk_cell::hexahedron, CellType::hexahedron, cube, 1.0},
      {vtk_cell::wedge, CellType::wedge, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}}, 0.5},
      {vtk_cell::pyramid, CellType::pyramid, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}}, 1.0 / 3.0},
      prism(vtk_cell::pentagonal_prism, CellType::pentagonal_prism, 5),
      prism(vtk_cell::hexagonal_prism, CellType::hexagonal_prism, 6),
  };
}

// The same cell with its points under other ids.
Source renamed(const Shape& shape, const std::function<Vec3(const Vec3&)>& map, std::mt19937_64& random) {
  std::vector<std::uint32_t> id(shape.points.size());
  for (std::size_t i = 0; i < id.size(); ++i)
    id[i] = static_cast<std::uint32_t>(i);
  std::shuffle(id.begin(), id.end(), random);
  Source source;
  source.points.resize(id.size());
  for (std::size_t i = 0; i < id.size(); ++i)
    source.points[id[i]] = map(shape.points[i]);
  source.types = {shape.vtk};
  source.connectivity = id;
  source.offsets = {0, id.size()};
  return source;
}

TEST(Cells, EveryTypeInEveryPositionAndNumbering) {
  const std::uint64_t seed = 30;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(name(shape.type));
    int inverted = 0;
    for (int i = 0; i < 40; ++i) {
      glm::dmat3 linear;
      for (int c = 0; c < 3; ++c)
        linear[c] = Vec3(uniform(random), uniform(random), uniform(random));
      const Vec3 shift(10.0 * uniform(random));
      BuildReport report;
      const Mesh mesh = build(renamed(
                                  shape, [&](const Vec3& p) { return linear * p + shift; }, random),
                              &report);
      checkInvariants(mesh);
      ASSERT_EQ(mesh.cell_count(), 1U);
      EXPECT_EQ(mesh.cell_type[0], shape.type);
      const double det = glm::determinant(linear);
      EXPECT_NEAR(volume(mesh), std::abs(det) * shape.volume, 1e-12);
      EXPECT_EQ(report.inverted, det < 0.0 ? 1U : 0U);
      inverted += det < 0.0 ? 1 : 0;
      EXPECT_EQ(report.degenerate + report.collapsed, 0U);
    }
    EXPECT_GT(inverted, 5);
    EXPECT_LT(inverted, 35);
  }
}

TEST(Cells, FacesOfFiveAndSixCornersAreFans) {
  const Shape shape = prism(vtk_cell::hexagonal_prism, CellType::hexagonal_prism, 6);
  std::vector<Vec3> above;
  for (const Vec3& p : shape.points)
    above.push_back(p + Vec3(0, 0, 1));
  const Mesh mesh = build(tests::join(tests::oneCell(shape.vtk, shape.points), tests::oneCell(shape.vtk, above)));
  checkInvariants(mesh);
  EXPECT_EQ(mesh.quad_count(), 12U);
  EXPECT_EQ(mesh.triangle_count(), 12U);  // three ends of four triangles, the middle one shared
  EXPECT_EQ(inspect(mesh).exterior_faces, 20U);
  EXPECT_EQ(inspect(mesh).components, 1U);
}

// One cell whose corners are points[ids[k]].
Source collapsed(const Shape& shape, const std::vector<std::uint32_t>& ids) {
  Source source = tests::oneCell(shape.vtk, shape.points);
  source.connectivity = ids;
  return source;
}

struct Collapse {
  std::size_t shape;
  std::vector<std::uint32_t> ids;
  CellType becomes;
  double volume;
};

TEST(Cells, CollapsedCellsBecomeWhatTheyAre) {
  const std::vector<Shape> all = shapes();
  const double pentagon = all[5].volume, hexagon = all[6].volume;
  const auto corner = [](double angle) { return Vec3(std::cos(angle), std::sin(angle), 0.0); };
  const double turn = 2.0 * std::acos(-1.0);
  // What cutting off one corner of a regular n-gon takes away.
  const auto ear = [&](int n) {
    const Vec3 a = corner(0.0), b = corner(turn / n), c = corner(2.0 * turn / n);
    return 0.5 * ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
  };
  const std::vector<Collapse> cases{
      {2, {0, 1, 2, 3, 4, 4, 7, 7}, CellType::wedge, 0.5},        // a face of the top folded onto its edge
      {2, {0, 0, 2, 3, 4, 4, 6, 7}, CellType::wedge, 0.5},        // two upright edges merged
      {2, {0, 1, 2, 3, 4, 4, 4, 4}, CellType::pyramid, 1.0 / 3},  // a face shrunk to a point
      {2, {0, 1, 2, 2, 4, 4, 4, 4}, CellType::tetrahedron, 1.0 / 6},
      {2, {0, 1, 2, 3, 4, 4, 6, 7}, CellType::polyhedron, 5.0 / 6},
      {3, {0, 1, 2, 0, 4, 5}, CellType::pyramid, 1.0 / 3},
      {3, {0, 1, 2, 0, 1, 5}, CellType::tetrahedron, 1.0 / 6},
      {3, {0, 1, 2, 3, 3, 3}, CellType::tetrahedron, 1.0 / 6},
      {4, {0, 0, 2, 3, 4}, CellType::tetrahedron, 1.0 / 6},
      {5, {0, 0, 2, 3, 4, 5, 5, 7, 8, 9}, CellType::hexahedron, pentagon - ear(5)},
      {6, {0, 0, 2, 3, 4, 5, 6, 6, 8, 9, 10, 11}, CellType::pentagonal_prism, hexagon - ear(6)},
      {6, {0, 0, 2, 2, 4, 5, 6, 6, 8, 8, 10, 11}, CellType::hexahedron, hexagon - 2 * ear(6)},
      {6, {0, 0, 2, 2, 4, 4, 6, 6, 8, 8, 10, 10}, CellType::wedge, hexagon - 3 * ear(6)},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(i);
    BuildReport report;
    const Mesh mesh = build(collapsed(all[cases[i].shape], cases[i].ids), &report);
    checkInvariants(mesh);
    ASSERT_EQ(mesh.cell_count(), 1U);
    EXPECT_STREQ(name(mesh.cell_type[0]), name(cases[i].becomes));
    EXPECT_NEAR(volume(mesh), cases[i].volume, 1e-14);
    EXPECT_EQ(report.collapsed, 1U);
    EXPECT_EQ(report.degenerate, 0U);
  }
}

TEST(Cells, CollapseIsByPlaceNotById) {
  // The points of a merged edge exist twice, with different values.
  std::vector<Vec3> points = cube;
  points[5] = points[4];
  points[6] = points[7];
  Source source = tests::oneCell(vtk_cell::hexahedron, points);
  source.arrays = {{"id", Association::points, 1, {0, 1, 2, 3, 4, 5, 6, 7}}};
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_STREQ(name(mesh.cell_type[0]), "wedge");
  EXPECT_EQ(report.collapsed, 1U);
  EXPECT_EQ(report.merged_points, 0U);
  EXPECT_EQ(report.coincident_points, 4U);
}

TEST(Cells, CollapsedToNothingIsDropped) {
  const std::vector<Shape> all = shapes();
  const Source whole = tests::oneCell(vtk_cell::tetra, {{9, 0, 0}, {10, 0, 0}, {9, 1, 0}, {9, 0, 1}});
  const std::vector<std::pair<std::size_t, std::vector<std::uint32_t>>> cases{
      {0, {0, 1, 2, 2}},    {2, {0, 1, 2, 3, 0, 1, 2, 3}}, {2, {0, 1, 1, 0, 4, 5, 5, 4}}, {2, {0, 0, 0, 0, 0, 0, 0, 0}},
      {4, {0, 1, 2, 3, 0}},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(i);
    BuildReport report;
    const Mesh mesh = build(tests::join(collapsed(all[cases[i].first], cases[i].second), whole), &report);
    checkInvariants(mesh);
    EXPECT_EQ(mesh.cell_count(), 1U);
    EXPECT_EQ(report.degenerate, 1U);
    EXPECT_EQ(report.collapsed, 0U);
  }
}

// Whatever corners are merged, what comes out is closed, has positive volume, or is counted as nothing.
TEST(Cells, AnyCollapseGivesClosedCells) {
  const std::uint64_t seed = 31;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  const Source whole = tests::oneCell(vtk_cell::tetra, {{9, 0, 0}, {10, 0, 0}, {9, 1, 0}, {9, 0, 1}});
  std::size_t drawn = 0;
  for (int i = 0; i < 2000; ++i) {
    Shape shape = shapes()[static_cast<std::size_t>(i) % 7];
    if (i % 2 == 0) {
      for (Vec3& p : shape.points)
        p += Vec3(jitter(random), jitter(random), jitter(random));
    }
    std::vector<std::uint32_t> ids(shape.points.size());
    for (std::size_t k = 0; k < ids.size(); ++k)
      ids[k] = static_cast<std::uint32_t>(k);
    const std::size_t merges = 1 + random() % (ids.size() - 1);
    for (std::size_t m = 0; m < merges; ++m) {
      const std::uint32_t from = ids[random() % ids.size()], to = ids[random() % ids.size()];
      std::replace(ids.begin(), ids.end(), from, to);
    }
    SCOPED_TRACE(testing::Message() << "case " << i);
    BuildReport report;
    const Mesh mesh = build(tests::join(collapsed(shape, ids), whole), &report);
    checkInvariants(mesh);
    if (testing::Test::HasFatalFailure()) return;
    drawn += mesh.cell_count() - 1;
    EXPECT_TRUE(mesh.cell_count() > 1 || report.degenerate > 0);
  }
  EXPECT_GT(drawn, 200U);
}

TEST(Cells, ACollapsedCellMeetsItsNeighbours) {
  // Two hexahedra side by side, the right one folded to a wedge away from the common face, a pyramid on its slope.
  Source source;
  source.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1},  {1, 0, 1},
                   {1, 1, 1}, {0, 1, 1}, {2, 0, 0}, {2, 1, 0}, {2, 0.5, 1}};
  source.types = {vtk_cell::hexahedron, vtk_cell::hexahedron, vtk_cell::pyramid};
  source.connectivity = {0, 1, 2, 3, 4, 5, 6, 7, 1, 8, 9, 2, 5, 5, 6, 6};
  source.connectivity[12 + 1] = 5;
  source.connectivity.insert(source.connectivity.end(), {8, 9, 6, 5, 10});
  source.offsets = {0, 8, 16, 21};
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_EQ(report.collapsed, 1U);
  const Inspection seen = inspect(mesh);
  EXPECT_EQ(seen.components, 1U);
  EXPECT_EQ(seen.exterior_faces, 6U + 5U + 5U - 4U);
}

// --- polyhedra and convex point sets ---

TEST(Polyhedra, KnownFormsAreRecognised) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(name(shape.type));
    for (const std::uint8_t type : {vtk_cell::polyhedron, vtk_cell::convex_point_set}) {
      // A convex set of regular polygons: rounding makes their corners not exactly coplanar, so only small ones.
      if (type == vtk_cell::convex_point_set && shape.points.size() > 8) continue;
      BuildReport report;
      const Mesh mesh = build(tests::oneCell(type, shape.points), &report);
      checkInvariants(mesh);
      EXPECT_STREQ(name(mesh.cell_type[0]), name(shape.type));
      EXPECT_FALSE(mesh.has_polyhedra());
      EXPECT_EQ(report.inverted, 0U);  // the faces given are outward
      EXPECT_NEAR(volume(mesh), shape.volume, 1e-14);
    }
  }
}

// Turns some faces of the face stream of a source's only cell round.
void turnFaces(Source& source, std::mt19937_64& random) {
  std::size_t at = 1;
  for (std::uint32_t f = 0; f < source.connectivity[0]; ++f) {
    const auto begin = source.connectivity.begin() + static_cast<std::ptrdiff_t>(at) + 1;
    if (random() % 2 == 0) std::reverse(begin, begin + source.connectivity[at]);
    at += 1 + source.connectivity[at];
  }
}

TEST(Polyhedra, RandomHullsWithFacesInAnyRound) {
  const std::uint64_t seed = 32;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 40; ++i) {
    std::vector<Vec3> points;
    for (int k = 0; k < 6 + i % 10; ++k)
      points.emplace_back(uniform(random), uniform(random), uniform(random));
    Source stream = tests::oneCell(vtk_cell::polyhedron, points);
    turnFaces(stream, random);
    const Mesh mesh = build(stream);
    checkInvariants(mesh);
    const Mesh hull = build(tests::oneCell(vtk_cell::convex_point_set, points));
    checkInvariants(hull);
    EXPECT_NEAR(volume(mesh), volume(hull), 1e-12);
    EXPECT_EQ(mesh.face_count(), hull.face_count());
    EXPECT_EQ(inspect(hull).nonconvex_cells, 0U);
  }
}

TEST(Polyhedra, LargeFacesAreFansThatNeighboursShare) {
  // Two octagonal prisms on top of each other, as polyhedra.
  std::vector<Vec3> lower, upper;
  for (int layer = 0; layer < 2; ++layer) {
    for (int k = 0; k < 8; ++k) {
      const double x = std::array{2, 3, 3, 2, 1, 0, 0, 1}[static_cast<std::size_t>(k)];
      const double y = std::array{0, 1, 2, 3, 3, 2, 1, 0}[static_cast<std::size_t>(k)];
      lower.emplace_back(x, y, layer);
      upper.emplace_back(x, y, layer + 1);
    }
  }
  const Mesh mesh =
      build(tests::join(tests::oneCell(vtk_cell::polyhedron, lower), tests::oneCell(vtk_cell::polyhedron, upper)));
  checkInvariants(mesh);
  EXPECT_EQ(mesh.cell_count(), 2U);
  EXPECT_TRUE(mesh.has_polyhedra());
  EXPECT_EQ(mesh.triangle_count(), 18U);
  EXPECT_EQ(mesh.quad_count(), 16U);
  EXPECT_EQ(inspect(mesh).components, 1U);
  EXPECT_DOUBLE_EQ(volume(mesh), 14.0);
  Surface boundary;
  surface(mesh, 0, boundary);
  EXPECT_EQ(boundary.triangles.size(), 2U * 6U + 8U * 2U);
}

TEST(Polyhedra, OnesThatDoNotCloseAreLeftOut) {
  Source open = tests::oneCell(vtk_cell::polyhedron, cube);
  open.connectivity[0] = 5;
  open.connectivity.resize(1 + 5 * 5);
  open.offsets[1] = open.connectivity.size();
  const Source whole = tests::oneCell(vtk_cell::tetra, {{9, 0, 0}, {10, 0, 0}, {9, 1, 0}, {9, 0, 1}});
  BuildReport report;
  const Mesh mesh = build(tests::join(open, whole), &report);
  checkInvariants(mesh);
  EXPECT_EQ(mesh.cell_count(), 1U);
  EXPECT_EQ(report.unclosed, 1U);
  ASSERT_EQ(report.warnings.size(), 1U);
}

TEST(ConvexPointSets, InnerAndRepeatedPointsDoNotCount) {
  std::vector<Vec3> points = cube;
  points.emplace_back(0.5, 0.5, 0.5);
  points.emplace_back(1, 1, 1);
  for (const double t : {0.0, 0.25, 0.5, 1.0}) {
    points.emplace_back(t, 0, 0);
    points.emplace_back(1, 0.5, t);
    points.emplace_back(0.5, t, 1);
  }
  std::mt19937_64 random(33);
  for (int i = 0; i < 50; ++i) {
    std::shuffle(points.begin(), points.end(), random);
    const Mesh mesh = build(tests::oneCell(vtk_cell::convex_point_set, points));
    checkInvariants(mesh);
    ASSERT_STREQ(name(mesh.cell_type[0]), "hexahedron") << "shuffle " << i;
    ASSERT_EQ(mesh.points.size(), 8U);
    ASSERT_DOUBLE_EQ(volume(mesh), 1.0);
  }
}

TEST(ConvexPointSets, FlatOnesAreDropped) {
  const Source whole = tests::oneCell(vtk_cell::tetra, {{9, 0, 0}, {10, 0, 0}, {9, 1, 0}, {9, 0, 1}});
  for (const std::vector<Vec3>& points : {std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 2, 0}},
                                          std::vector<Vec3>{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}},
                                          std::vector<Vec3>{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}}) {
    BuildReport report;
    const Mesh mesh = build(tests::join(tests::oneCell(vtk_cell::convex_point_set, points), whole), &report);
    EXPECT_EQ(mesh.cell_count(), 1U);
    EXPECT_EQ(report.degenerate, 1U);
  }
}

}  // namespace
}  // namespace spillikin::mesh
