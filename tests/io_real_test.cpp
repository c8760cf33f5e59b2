// Real meshes, where the folder with them exists: counts, arrays and ranges known from elsewhere.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "spillikin/base/error.h"
#include "spillikin/io/read.h"

namespace {

using spillikin::Error;
using spillikin::io::readMesh;
using spillikin::io::ReadOptions;
using spillikin::io::readTimes;
using spillikin::mesh::Array;
using spillikin::mesh::Association;
using spillikin::mesh::Source;

const std::string folder = SPILLIKIN_DATA;

std::map<int, std::size_t> cellsByType(const Source& source) {
  std::map<int, std::size_t> counts;
  for (const std::uint8_t type : source.types)
    ++counts[type];
  return counts;
}

const Array* find(const Source& source, const std::string& name, Association association) {
  for (const Array& array : source.arrays) {
    if (array.name == name && array.association == association) return &array;
  }
  return nullptr;
}

std::pair<double, double> range(const Array& array) {
  double lo = std::numeric_limits<double>::infinity(), hi = -lo;
  for (const double v : array.values) {
    lo = std::min(lo, v);
    hi = std::max(hi, v);
  }
  return {lo, hi};
}

std::string describe(const Source& source) {
  std::string text = fmt::format("{} points, {} steps", source.points.size(), source.times.size());
  for (const auto& [type, count] : cellsByType(source))
    text += fmt::format(", {} of type {}", count, type);
  for (const Array& array : source.arrays) {
    text += fmt::format(", {}[{}] of {}", array.name, array.components,
                        array.association == Association::points ? "points" : "cells");
  }
  return text;
}

// Offsets ascend and close the connectivity; ids are of points; arrays have a tuple for each point or cell.
void expectConsistent(const Source& source) {
  ASSERT_EQ(source.offsets.size(), source.types.size() + 1);
  ASSERT_EQ(source.offsets.front(), 0U);
  ASSERT_TRUE(std::is_sorted(source.offsets.begin(), source.offsets.end()));
  ASSERT_EQ(source.offsets.back(), source.connectivity.size());
  for (std::size_t c = 0; c < source.types.size(); ++c) {
    if (source.types[c] == spillikin::mesh::vtk_cell::polyhedron) continue;
    for (std::size_t k = source.offsets[c]; k < source.offsets[c + 1]; ++k) {
      ASSERT_LT(source.connectivity[k], source.points.size());
    }
  }
  ASSERT_TRUE(source.left_out.empty() || source.left_out.size() == source.types.size());
  for (const Array& array : source.arrays) {
    const std::size_t tuples = array.association == Association::points ? source.points.size() : source.types.size();
    ASSERT_EQ(array.values.size(), tuples * static_cast<std::size_t>(array.components)) << array.name;
  }
}

struct Expectation {
  const char* file;
  std::map<int, std::size_t> cells;
  const char* array = nullptr;
  Association association = Association::points;
  double lo = 0.0, hi = 0.0;  // of the array, to the digits of the table
  std::size_t steps = 0;
};

class RealMesh : public testing::TestWithParam<Expectation> {};

// A test's name in the listings.
void PrintTo(const Expectation& expected, std::ostream* out) {
  *out << expected.file;
}

TEST_P(RealMesh, HasItsCellsAndArrays) {
  const Expectation& expected = GetParam();
  const std::string path = fmt::format("{}/{}", folder, expected.file);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const Source source = readMesh(path);
  SCOPED_TRACE(describe(source));
  expectConsistent(source);
  std::map<int, std::size_t> cells = cellsByType(source);
  for (const auto& [type, count] : expected.cells)
    EXPECT_EQ(cells[type], count) << "type " << type;
  EXPECT_EQ(source.times.size(), expected.steps);
  EXPECT_EQ(readTimes(path), source.times);
  if (expected.array == nullptr) return;
  const Array* array = find(source, expected.array, expected.association);
  ASSERT_NE(array, nullptr) << expected.array;
  if (expected.lo < expected.hi) {
    const auto [lo, hi] = range(*array);
    EXPECT_NEAR(lo, expected.lo, 0.006 * std::max(1.0, std::abs(expected.lo)));
    EXPECT_NEAR(hi, expected.hi, 0.006 * std::max(1.0, std::abs(expected.hi)));
  }
}

constexpr auto PD = Association::points;
constexpr auto CD = Association::cells;

INSTANTIATE_TEST_SUITE_P(
    Table, RealMesh,
    testing::Values(Expectation{"bluntfin.vts", {{12, 37479}}, "Density", PD, 0.19, 4.98},
                    Expectation{"bluntfinxyz.bin", {{12, 37479}}, "Density", PD, 0.19, 4.98, 1},
                    Expectation{"bf_tet5.vtu", {{10, 187395}}, "Density", PD, 0.19, 4.98},
                    Expectation{"comb.vts", {{12, 43008}}, "Density", PD, 0.198, 0.710},
                    Expectation{"post.vtk", {{10, 8750}}, "Pressure", PD, 0.355, 1.64},
                    Expectation{"disk_out_ref.ex2", {{12, 7472}}, "Temp", PD, 293, 913, 1},
                    Expectation{"can_t0.vtu", {{12, 4800}}, "EQPS", CD, 0, 0, 1},
                    Expectation{"can_t1.vtu", {{12, 4800}}, "DISPL", PD, 0, 0, 1},
                    Expectation{"can_t2.vtu", {{12, 4800}}, "EQPS", CD, 0.02, 2.87, 1},
                    Expectation{"mug.e", {{12, 2476}}, "aux_elem", CD, 0, 0, 21},
                    Expectation{"mesh_fs8.exo", {{13, 1344}}},
                    Expectation{"fire_ug.vtu", {{12, 10462}}, "t", PD, 298, 692},
                    Expectation{"syrthes_plates_T_6.vtu", {{10, 15241}}, "TEMPERATURE", PD},
                    Expectation{"slac_pillbox.vtu", {{10, 31135}}, "efield_mag", PD, 0, 233},
                    Expectation{"bracket_appended_compressed.vtu", {{10, 206208}}, "sj2p", CD},
                    Expectation{"bracket_refined8.vtu", {{10, 1649664}}, "xdsp", PD},
                    Expectation{"dolfin_pulley.vtu", {{10, 63767}}}, Expectation{"joint.vtk", {{12, 17784}}},
                    Expectation{"knot-hex.vtk", {{12, 23616}}},
                    Expectation{"johansen.vtu", {{12, 54756}}, "PORO", PD, 0.163, 0.250},
                    Expectation{"box_hybrid_mesh.vtu", {{10, 7949}, {12, 943}, {14, 515}}, "attribute", CD, 1, 6},
                    Expectation{"su2_chtPinArray3d_zone0.vtu", {{12, 9063}}, "Temperature", PD},
                    Expectation{"notch_stress.vtk", {{12, 2188}, {13, 4}}, "Nodal Stress", PD},
                    Expectation{"PentaHexa.vtk", {{15, 60}, {16, 150}}},
                    Expectation{"pebi3d_with_properties.vtu", {{42, 1630}}},
                    Expectation{"elements.vtu", {{10, 2}, {12, 1}, {13, 2}, {14, 2}}},
                    Expectation{"CylinderQuadratic.vtk", {{24, 1522}}, "pressure", PD},
                    Expectation{"foam_cavity/case.foam", {{12, 400}}, "p", CD, 0, 0, 6}));

}  // namespace
