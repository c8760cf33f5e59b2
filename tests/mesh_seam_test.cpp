// Points at one place: merged when their values agree, kept apart and matched by place when they do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

using tests::checkInvariants;
using tests::volume;

// Two grids of n^3 hexahedra that touch at x = n, each with its own points there.
Source twoBlocks(std::size_t n, double jump, bool tetrahedra) {
  const auto block = [&](double shift, double value) {
    Source source = tetrahedra ? tests::tetrahedronGrid(n) : tests::hexahedronGrid(n);
    source.arrays.clear();
    for (Vec3& p : source.points)
      p.x += shift;
    tests::addPointArray(source, "v", [value](const Vec3& p) { return value + p.y; });
    return source;
  };
  return tests::join(block(0.0, 0.0), block(static_cast<double>(n), jump));
}

TEST(Seam, EqualValuesBecomeOnePoint) {
  for (const bool tetrahedra : {false, true}) {
    BuildReport report;
    const Mesh mesh = build(twoBlocks(3, 0.0, tetrahedra), &report);
    checkInvariants(mesh);
    EXPECT_EQ(report.merged_points, 16U);
    EXPECT_EQ(report.coincident_points, 0U);
    EXPECT_EQ(mesh.points.size(), 7U * 16U);
    EXPECT_EQ(inspect(mesh).components, 1U);
    EXPECT_EQ(inspect(mesh).exterior_faces, (tetrahedra ? 2U : 1U) * (2U * 9U + 4U * 18U));
  }
}

TEST(Seam, DifferentValuesStayApartAndFacesMatchByPlace) {
  for (const bool tetrahedra : {false, true}) {
    const Source source = twoBlocks(3, 5.0, tetrahedra);
    BuildReport report;
    const Mesh mesh = build(source, &report);
    checkInvariants(mesh);
    EXPECT_EQ(report.merged_points, 0U);
    EXPECT_EQ(report.coincident_points, 32U);
    EXPECT_EQ(mesh.points.size(), 2U * 64U);
    EXPECT_EQ(inspect(mesh).components, 1U);
    EXPECT_EQ(inspect(mesh).exterior_faces, (tetrahedra ? 2U : 1U) * (2U * 9U + 4U * 18U));
    // Each cell keeps the values of its own side.
    const Field field = selectField(source, mesh, "v");
    for (Id c = 0; c < mesh.cell_count(); ++c) {
      const double value = mesh.cell_file_id[c] < source.types.size() / 2 ? 0.0 : 5.0;
      for (const Id v : mesh.vertices(c))
        EXPECT_EQ(field.values[v], value + mesh.points[v].y);
    }
  }
}

TEST(Seam, SomeEqualSomeDifferent) {
  // Four corners meet in a point: two pairs of equal values.
  Source source;
  source.offsets = {0};
  const Vec3 o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  std::vector<double> values;
  const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c, double at_origin) {
    for (const Vec3& p : {o, a, b, c}) {
      source.connectivity.push_back(static_cast<std::uint32_t>(source.points.size()));
      source.points.push_back(p);
      values.push_back(p == o ? at_origin : 1.0);
    }
    source.types.push_back(vtk_cell::tetra);
    source.offsets.push_back(source.connectivity.size());
  };
  add(x, y, z, 7.0);
  add(-x, y, z, 8.0);
  add(x, -y, z, 7.0);
  add(-x, -y, z, 8.0);
  source.arrays = {{"v", Association::points, 1, values}};
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_EQ(mesh.points.size(), 5U + 2U);
  EXPECT_EQ(report.coincident_points, 2U);
  EXPECT_EQ(report.merged_points, 16U - 7U);
  EXPECT_EQ(inspect(mesh).components, 1U);
}

TEST(Seam, ValuesAreComparedByTheirBits) {
  const auto merged = [](double a, double b) {
    Source source = twoBlocks(1, 0.0, false);
    for (std::size_t p = 0; p < source.points.size(); ++p)
      source.arrays[0].values[p] = p < 8 ? a : b;
    BuildReport report;
    checkInvariants(build(source, &report));
    return report.merged_points;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(merged(nan, nan), 4U);
  EXPECT_EQ(merged(nan, std::bit_cast<double>(std::bit_cast<std::uint64_t>(nan) + 1)), 0U);
  EXPECT_EQ(merged(nan, 1.0), 0U);
  EXPECT_EQ(merged(0.0, -0.0), 0U);
  EXPECT_EQ(merged(1.0, std::nextafter(1.0, 2.0)), 0U);
}

TEST(Seam, EveryComponentOfEveryPointArrayCounts) {
  Source source = twoBlocks(1, 0.0, false);
  Array vector{"w", Association::points, 3, std::vector<double>(3 * source.points.size(), 1.0)};
  source.arrays.push_back(vector);
  source.arrays.push_back({"cells", Association::cells, 1, {1.0, 2.0}});  // does not count
  BuildReport report;
  build(source, &report);
  EXPECT_EQ(report.merged_points, 4U);
  for (std::size_t p = 0; p < 8; ++p)
    source.arrays[1].values[3 * p + 2] = 2.0;
  build(source, &report);
  EXPECT_EQ(report.merged_points, 0U);
  EXPECT_EQ(report.coincident_points, 8U);
}

TEST(Seam, MinusZeroIsThePlaceOfZero) {
  Source source = twoBlocks(1, 0.0, false);
  for (Vec3& p : source.points)
    p.x -= 1.0;
  for (std::size_t p = 8; p < 16; ++p) {
    if (source.points[p].x == 0.0) source.points[p].x = -0.0;
  }
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_EQ(report.merged_points, 4U);
}

TEST(Seam, ManyPointsAtOnePlace) {
  // A fan of tetrahedra around an edge, each with its own points: thousands of values at two places.
  Source source;
  source.offsets = {0};
  std::vector<double> values;
  const std::size_t n = 3000;
  for (std::size_t i = 0; i < n; ++i) {
    const auto rim = [&](std::size_t k) {
      const double angle = 2.0 * std::acos(-1.0) * static_cast<double>(k % n) / static_cast<double>(n);
      return Vec3(std::cos(angle), std::sin(angle), 0.0);
    };
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(0, 0, 1), rim(i), rim(i + 1)}) {
      source.connectivity.push_back(static_cast<std::uint32_t>(source.points.size()));
      source.points.push_back(p);
      values.push_back(static_cast<double>(i % 1500));
    }
    source.types.push_back(vtk_cell::tetra);
    source.offsets.push_back(source.connectivity.size());
  }
  source.arrays = {{"v", Association::points, 1, values}};
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_EQ(inspect(mesh).components, 1U);
  EXPECT_EQ(inspect(mesh).exterior_faces, 2 * n);
  EXPECT_EQ(report.merged_points, 2 * n - 2 * 1500U);
}

}  // namespace
}  // namespace spillikin::mesh
