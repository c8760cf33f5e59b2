// What cannot be built says so in one line that names the cells or points.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

std::string message(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}
std::string buildMessage(const Source& source) {
  return message([&] { build(source); });
}

void expectHas(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  EXPECT_NE(text.back(), '.') << text;
}

Source grid() {
  Source source = tests::hexahedronGrid(2);
  source.name = "grid.vtu";
  return source;
}

TEST(BuildErrors, CoordinatesThatAreNotFinite) {
  Source source = grid();
  source.points[3].y = std::numeric_limits<double>::quiet_NaN();
  source.points[20].z = -std::numeric_limits<double>::infinity();
  expectHas(buildMessage(source), "grid.vtu: 2 points have coordinates that are not finite (points 3, 20)");
  for (std::size_t p = 0; p < 12; ++p)
    source.points[p].x = std::numeric_limits<double>::infinity();
  expectHas(buildMessage(source), "13 points");
  expectHas(buildMessage(source), "0, 1, 2, 3, 4, 5, 6, 7, ...");
}

TEST(BuildErrors, ConnectivityOutOfRange) {
  Source source = grid();
  source.connectivity[8 * 5 + 2] = 27;
  source.connectivity[8 * 6 + 1] = 4000000000U;
  expectHas(buildMessage(source), "grid.vtu: cell 5 names point 27, but there are only 27 points");
}

TEST(BuildErrors, ConnectivityOfAWrongLength) {
  Source source = grid();
  source.types[4] = vtk_cell::pentagonal_prism;
  expectHas(buildMessage(source), "cell 4 (VTK type 15)");
  source = grid();
  source.offsets[3] = 1000;  // beyond the end, then back
  expectHas(buildMessage(source), "cell 2");
  source = grid();
  source.offsets.back() = source.connectivity.size() + 1;
  expectHas(buildMessage(source), "grid.vtu: 8 cells");
  source = grid();
  source.offsets.pop_back();
  expectHas(buildMessage(source), "8 offsets");
}

TEST(BuildErrors, CellsThatNameTooManyPointsAreAWarning) {
  // Hexahedra that carry 20 nodes under the linear type exist; VTK draws their first eight.
  Source source = tests::oneCell(
      vtk_cell::hexahedron,
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {5, 5, 5}});
  BuildReport report;
  const Mesh mesh = build(source, &report);
  EXPECT_EQ(mesh.points.size(), 8U);
  EXPECT_EQ(report.unused_points, 1U);
  ASSERT_EQ(report.warnings.size(), 1U);
  expectHas(report.warnings[0], "1 cells name more points");
}

TEST(BuildErrors, FaceStreamsThatDoNotFit) {
  const std::vector<Vec3> tetrahedron{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Source good = tests::oneCell(vtk_cell::polyhedron, tetrahedron);
  ASSERT_EQ(buildMessage(good), "no error");
  for (const auto& [at, value] : {std::pair(0, 5U), std::pair(0, 3U), std::pair(1, 4000000000U), std::pair(5, 2U)}) {
    Source bad = good;
    bad.connectivity[static_cast<std::size_t>(at)] = value;
    expectHas(buildMessage(bad), "cell 0 (VTK type 42) has connectivity of a wrong length");
  }
  Source bad = good;
  bad.connectivity[2] = 4;
  expectHas(buildMessage(bad), "cell 0 names point 4");
  bad.connectivity.clear();
  bad.offsets = {0, 0};
  expectHas(buildMessage(bad), "cell 0 (VTK type 42)");
}

TEST(BuildErrors, MoreThanTwoCellsOnAFace) {
  // Three tetrahedra on one triangle, one of them above and two below.
  Source source = tests::oneCell(vtk_cell::tetra, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  source.name = "three.vtk";
  source.points.emplace_back(0.0, 0.0, -1.0);
  source.points.emplace_back(0.3, 0.3, -2.0);
  source.arrays.clear();
  for (const std::uint32_t apex : {4U, 5U}) {
    source.types.push_back(vtk_cell::tetra);
    source.connectivity.insert(source.connectivity.end(), {0, 1, 2, apex});
    source.offsets.push_back(source.connectivity.size());
  }
  expectHas(buildMessage(source), "three.vtk: cells ");
  for (const char* cell : {"0", "1", "2"})
    expectHas(buildMessage(source), cell);
  expectHas(buildMessage(source), "share one face");
}

TEST(BuildErrors, ACellTwice) {
  for (const std::size_t again : {std::size_t{0}, std::size_t{6}}) {
    for (const bool whole_grid : {false, true}) {
      Source source =
          whole_grid ? grid() : tests::oneCell(vtk_cell::tetra, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
      const std::size_t twin = whole_grid ? again : 0;
      source.types.push_back(source.types[twin]);
      const Source before = source;
      source.connectivity.insert(source.connectivity.end(),
                                 before.connectivity.begin() + static_cast<std::ptrdiff_t>(before.offsets[twin]),
                                 before.connectivity.begin() + static_cast<std::ptrdiff_t>(before.offsets[twin + 1]));
      source.offsets.push_back(source.connectivity.size());
      const std::string text = buildMessage(source);
      expectHas(text, "share one face");
      expectHas(text, std::to_string(twin));
      expectHas(text, std::to_string(source.types.size() - 1));
    }
  }
}

TEST(BuildErrors, TheMessageDoesNotDependOnTheThreads) {
  Source source = tests::tetrahedronGrid(12);
  for (std::size_t c = 0; c < 3000; c += 7) {
    source.types.push_back(vtk_cell::tetra);
    for (std::size_t k = 0; k < 4; ++k)
      source.connectivity.push_back(source.connectivity[4 * c + k]);
    source.offsets.push_back(source.connectivity.size());
  }
  const std::string expected = buildMessage(source);
  expectHas(expected, "share one face");
  for (const std::size_t threads : {std::size_t{1}, std::size_t{6}}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(buildMessage(source), expected);
  }
}

TEST(BuildErrors, NoCellToDraw) {
  Source empty;
  empty.name = "empty.vtu";
  empty.offsets = {0};
  expectHas(buildMessage(empty), "empty.vtu: no three-dimensional cell");
  Source surface = tests::oneCell(9, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  expectHas(buildMessage(surface), "no three-dimensional cell");
  expectHas(buildMessage(surface), "1 have lower dimension");
  Source flat = tests::oneCell(
      vtk_cell::hexahedron, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  expectHas(buildMessage(flat), "1 have zero volume");
  Source hidden = grid();
  hidden.left_out.assign(8, 1);
  expectHas(buildMessage(hidden), "8 are ghost or hidden");
  hidden.left_out.pop_back();
  expectHas(buildMessage(hidden), "grid.vtu: 8 cells but 7 marks");
}

TEST(BuildErrors, OverlappingCellsAreAWarning) {
  // Two tetrahedra on the same side of their common face.
  Source source = tests::oneCell(vtk_cell::tetra, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  source.points.emplace_back(0.1, 0.1, 2.0);
  source.arrays.clear();
  source.types.push_back(vtk_cell::tetra);
  source.connectivity.insert(source.connectivity.end(), {0, 1, 2, 4});
  source.offsets.push_back(source.connectivity.size());
  BuildReport report;
  const Mesh mesh = build(source, &report);
  EXPECT_EQ(mesh.cell_count(), 2U);
  EXPECT_EQ(inspect(mesh).exterior_faces, 8U);
  ASSERT_EQ(report.warnings.size(), 1U);
  expectHas(report.warnings[0], "overlap");
}

// --- fields ---

class FieldTest : public testing::Test {
 protected:
  FieldTest() : source_(grid()) {
    source_.arrays.clear();
    const std::size_t points = source_.points.size(), cells = source_.types.size();
    source_.arrays.push_back({"velocity", Association::points, 3, std::vector<double>(3 * points)});
    source_.arrays.push_back({"material", Association::cells, 1, std::vector<double>(cells)});
    source_.arrays.push_back({"pressure", Association::points, 1, std::vector<double>(points)});
    for (std::size_t p = 0; p < points; ++p) {
      const double t = static_cast<double>(p);
      source_.arrays[0].values[3 * p] = 3.0 * t;
      source_.arrays[0].values[3 * p + 1] = -4.0 * t;
      source_.arrays[2].values[p] = 100.0 + t;
    }
    for (std::size_t c = 0; c < cells; ++c)
      source_.arrays[1].values[c] = 7.0 + static_cast<double>(c);
    mesh_ = build(source_);
  }
  Source source_;
  Mesh mesh_;
};

TEST_F(FieldTest, DefaultIsTheFirstPointScalarThenCellScalarThenVector) {
  EXPECT_EQ(selectField(source_, mesh_).name, "pressure");
  source_.arrays.pop_back();
  EXPECT_EQ(selectField(source_, mesh_).name, "material");
  source_.arrays.pop_back();
  EXPECT_EQ(selectField(source_, mesh_).name, "velocity (magnitude)");
  source_.arrays.pop_back();
  const Field none_at_all = selectField(source_, mesh_);
  EXPECT_EQ(none_at_all.name, "");
  EXPECT_EQ(none_at_all.values, std::vector<double>(mesh_.points.size(), 0.0));
  EXPECT_EQ(none_at_all.lo, none_at_all.hi);
}

TEST_F(FieldTest, ValuesFollowTheMeshsNumbering) {
  const Field pressure = selectField(source_, mesh_, "pressure", 0);
  for (Id v = 0; v < mesh_.points.size(); ++v)
    EXPECT_EQ(pressure.values[v], 100.0 + mesh_.point_file_id[v]);
  EXPECT_EQ(pressure.lo, 100.0);
  EXPECT_EQ(pressure.hi, 126.0);
  const Field material = selectField(source_, mesh_, "material");
  EXPECT_EQ(material.association, Association::cells);
  for (Id c = 0; c < mesh_.cell_count(); ++c)
    EXPECT_EQ(material.values[c], 7.0 + mesh_.cell_file_id[c]);
  const Field speed = selectField(source_, mesh_, "velocity");
  const Field y = selectField(source_, mesh_, "velocity", 1);
  EXPECT_EQ(y.name, "velocity (1)");
  for (Id v = 0; v < mesh_.points.size(); ++v) {
    EXPECT_EQ(speed.values[v], 5.0 * mesh_.point_file_id[v]);
    EXPECT_EQ(y.values[v], -4.0 * mesh_.point_file_id[v]);
  }
}

TEST_F(FieldTest, CellsWithValuesThatAreNotFiniteAreHidden) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Source source = source_;
    source.arrays[2].values[26] = bad;  // a corner of the grid: of one cell, the last
    const Mesh mesh = build(source);
    const Field field = selectField(source, mesh, "pressure");
    EXPECT_EQ(field.hidden_count, 1U);
    ASSERT_EQ(field.hidden.size(), 8U);
    for (Id c = 0; c < 8; ++c)
      EXPECT_EQ(field.hidden[c], mesh.cell_file_id[c] == 7 ? 1 : 0);
    EXPECT_EQ(field.lo, 100.0);
    EXPECT_EQ(field.hi, 125.0);
    source.arrays[1].values[2] = bad;
    EXPECT_EQ(selectField(source, mesh, "material").hidden_count, 1U);
    EXPECT_EQ(selectField(source, mesh, "velocity").hidden_count, 0U);
    EXPECT_TRUE(selectField(source, mesh, "velocity").hidden.empty());
  }
}

TEST_F(FieldTest, EverythingHiddenHasAnEmptyRange) {
  for (double& v : source_.arrays[1].values)
    v = std::nan("");
  const Field field = selectField(source_, mesh_, "material");
  EXPECT_EQ(field.hidden_count, 8U);
  EXPECT_EQ(field.lo, 0.0);
  EXPECT_EQ(field.hi, 0.0);
}

TEST_F(FieldTest, ErrorsNameTheArraysAndTheNearest) {
  const auto select = [&](const std::string& name, int component) {
    return message([&] { selectField(source_, mesh_, name, component); });
  };
  expectHas(select("presure", 0), "no array 'presure'; nearest is 'pressure'");
  expectHas(select("presure", 0), "velocity, material, pressure");
  expectHas(select("velocity", 3), "has no component 3; it has 0 to 2");
  expectHas(select("velocity", -2), "no component -2");
  Source smaller = source_;  // not the file that the mesh was built from
  smaller.points.pop_back();
  smaller.arrays[2].values.pop_back();
  expectHas(message([&] { selectField(smaller, mesh_, "pressure"); }), "does not reach all of the mesh");
  source_.arrays[2].values.pop_back();
  expectHas(select("pressure", 0), "array 'pressure' has 26 values");
  source_.arrays.clear();
  expectHas(select("pressure", 0), "the file has none");
}

}  // namespace
}  // namespace spillikin::mesh
