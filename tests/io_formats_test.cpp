// Every format, by files that hold the same box; steps, blocks, ghosts, polyhedra.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <map>

#include "io_samples.h"
#include "spillikin/base/error.h"
#include "spillikin/io/read.h"

namespace {

using namespace spillikin;
using io::readMesh;
using io::ReadOptions;
using io::readTimes;
using mesh::Association;
using mesh::Source;
using tests::Sample;
using tests::TempFolder;

const mesh::Array* find(const Source& source, const std::string& name, Association association) {
  for (const mesh::Array& array : source.arrays) {
    if (array.name == name && array.association == association) return &array;
  }
  return nullptr;
}

double atPoint(const Vec3& p) {
  return p.x + 10.0 * p.y + 100.0 * p.z;
}

Vec3 centre(const Source& source, std::size_t cell) {
  Vec3 sum{0.0};
  for (std::size_t k = source.offsets[cell]; k < source.offsets[cell + 1]; ++k) {
    sum += source.points.at(source.connectivity[k]);
  }
  return sum / static_cast<double>(source.offsets[cell + 1] - source.offsets[cell]);
}

// Corners 0 1 3 4 of a hexahedron span it with the right hand, as VTK orders them.
double tripleProduct(const Source& source, std::size_t cell) {
  const auto corner = [&](std::size_t k) { return source.points.at(source.connectivity.at(source.offsets[cell] + k)); };
  const Vec3 a = corner(1) - corner(0), b = corner(3) - corner(0), c = corner(4) - corner(0);
  return glm::dot(glm::cross(a, b), c);
}

class Format : public testing::TestWithParam<Sample> {};

TEST_P(Format, HoldsTheBox) {
  const Sample& sample = GetParam();
  const TempFolder folder;
  sample.write(folder);
  const Source source = readMesh(folder / sample.name);
  ASSERT_EQ(source.types, (std::vector<std::uint8_t>{12, 12}));
  ASSERT_EQ(source.offsets, (std::vector<std::uint64_t>{0, 8, 16}));
  for (std::size_t cell = 0; cell < 2; ++cell) {
    EXPECT_EQ(centre(source, cell), Vec3(0.5 + static_cast<double>(cell), 0.5, 0.5));
    EXPECT_DOUBLE_EQ(tripleProduct(source, cell), 1.0);
  }
  EXPECT_EQ(source.times.size(), sample.steps);
  EXPECT_EQ(readTimes(folder / sample.name), source.times);

  const bool plot3d = !sample.cell_data, foam = sample.name == "box.foam";
  if (!foam) {
    const mesh::Array* p = find(source, plot3d ? "Density" : "p", Association::points);
    ASSERT_NE(p, nullptr);
    ASSERT_EQ(p->values.size(), source.points.size());
    for (std::size_t i = 0; i < source.points.size(); ++i) {
      EXPECT_DOUBLE_EQ(p->values[i], atPoint(source.points[i]) + (plot3d ? 1.0 : 0.0));
    }
  }
  if (sample.cell_data) {
    const mesh::Array* c = find(source, "c", Association::cells);
    ASSERT_NE(c, nullptr);
    EXPECT_EQ(c->values, (std::vector<double>{5, 6}));
  }
}

TEST_P(Format, IsTheSameWithoutIsolation) {
  const Sample& sample = GetParam();
  const TempFolder folder;
  sample.write(folder);
  ReadOptions here;
  here.isolate = false;
  const Source a = readMesh(folder / sample.name), b = readMesh(folder / sample.name, here);
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.types, b.types);
  EXPECT_EQ(a.offsets, b.offsets);
  EXPECT_EQ(a.connectivity, b.connectivity);
  EXPECT_EQ(a.left_out, b.left_out);
  EXPECT_EQ(a.times, b.times);
  EXPECT_EQ(a.step, b.step);
  ASSERT_EQ(a.arrays.size(), b.arrays.size());
  for (std::size_t i = 0; i < a.arrays.size(); ++i) {
    EXPECT_EQ(a.arrays[i].name, b.arrays[i].name);
    EXPECT_EQ(a.arrays[i].association, b.arrays[i].association);
    EXPECT_EQ(a.arrays[i].components, b.arrays[i].components);
    EXPECT_EQ(a.arrays[i].identifier, b.arrays[i].identifier);
    EXPECT_EQ(a.arrays[i].values, b.arrays[i].values);
  }
}

TEST_P(Format, ChoosesSteps) {
  const Sample& sample = GetParam();
  const TempFolder folder;
  sample.write(folder);
  const std::string path = folder / sample.name;
  ReadOptions options;
  if (sample.steps == 2) {
    EXPECT_EQ(readTimes(path), (std::vector<double>{0.0, 0.5}));
    options.step = 1;
    const Source second = readMesh(path, options);
    EXPECT_EQ(second.step, 1U);
    if (sample.name == "box.exo" || sample.name == "box.case") {
      const mesh::Array* p = find(second, "p", Association::points);
      ASSERT_NE(p, nullptr);
      EXPECT_DOUBLE_EQ(p->values[0], atPoint(second.points[0]) + 0.5);
    }
    if (sample.name == "box.pvd") {
      EXPECT_EQ(second.types.size(), 1U);
    }
    options.step.reset();
    options.time = 0.3;
    EXPECT_EQ(readMesh(path, options).step, 1U);
    options.time = 0.2;
    EXPECT_EQ(readMesh(path, options).step, 0U);
    options.time.reset();
  }
  options.step = 2;
  try {
    readMesh(path, options);
    FAIL() << "step 2 was read";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(path), std::string::npos) << text;
    EXPECT_NE(text.find(sample.steps == 2 ? "2 steps" : "1 step"), std::string::npos) << text;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Format, testing::ValuesIn(tests::samples()), [](const auto& instance) {
  std::string name = instance.param.name;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

TEST(ReadExodus, LeavesDisplacementsUnapplied) {
  const TempFolder folder;
  tests::sample("box.exo").write(folder);
  const Source source = readMesh(folder / "box.exo");
  const mesh::Array* moved = find(source, "DISPL", Association::points);
  ASSERT_NE(moved, nullptr);
  EXPECT_EQ(moved->components, 3);
  EXPECT_EQ(moved->values.front(), 1.0);
  EXPECT_EQ(source.points.front(), Vec3(0.0));
}

TEST(ReadPlot3d, ReadsGeometryAlone) {
  const TempFolder folder;
  tests::sample("boxxyz.bin").write(folder);
  std::filesystem::remove(folder / "boxq.bin");
  const Source source = readMesh(folder / "boxxyz.bin");
  EXPECT_EQ(source.types.size(), 2U);
  EXPECT_TRUE(source.arrays.empty());
}

TEST(ReadXml, PolyhedraCarryTheirFaceStream) {
  const TempFolder folder;
  const std::string points = "0 0 0 1 0 0 0 1 0 0 0 1 9 9 9";
  const std::string faces = "4 3 0 2 1 3 0 1 3 3 1 2 3 3 0 3 2";
  tests::writeText(folder / "one.vtu", tests::vtu(5, 1, points, "0 1 2 3", "4", "42|" + faces + "|17"));
  const Source source = readMesh(folder / "one.vtu");
  EXPECT_EQ(source.types, (std::vector<std::uint8_t>{42}));
  EXPECT_EQ(source.connectivity, (std::vector<std::uint32_t>{4, 3, 0, 2, 1, 3, 0, 1, 3, 3, 1, 2, 3, 3, 0, 3, 2}));
  EXPECT_EQ(source.offsets, (std::vector<std::uint64_t>{0, 17}));
}

std::string ghosts(const char* element, const char* flags) {
  return std::string("<") + element +
         "><DataArray type=\"UInt8\" Name=\"vtkGhostType\" NumberOfComponents=\"1\" format=\"ascii\">" + flags +
         "</DataArray></" + element + ">";
}

// Two tetrahedra on one triangle.
std::string twoTetrahedra(const std::string& more) {
  return tests::vtu(5, 2, "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1", "0 1 2 3 1 2 3 4", "4 8", "10 10", more);
}

TEST(LeftOut, GhostAndHiddenCells) {
  const TempFolder folder;
  tests::writeText(folder / "duplicate.vtu", twoTetrahedra(ghosts("CellData", "0 1")));
  tests::writeText(folder / "hidden.vtu", twoTetrahedra(ghosts("CellData", "32 0")));
  tests::writeText(folder / "exterior.vtu", twoTetrahedra(ghosts("CellData", "16 2")));
  EXPECT_EQ(readMesh(folder / "duplicate.vtu").left_out, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(readMesh(folder / "hidden.vtu").left_out, (std::vector<std::uint8_t>{1, 0}));
  const Source exterior = readMesh(folder / "exterior.vtu");
  EXPECT_TRUE(exterior.left_out.empty());
  EXPECT_TRUE(exterior.arrays.empty());
}

TEST(LeftOut, CellsThatTouchHiddenPoints) {
  const TempFolder folder;
  tests::writeText(folder / "hidden.vtu", twoTetrahedra(ghosts("PointData", "0 0 0 0 2")));
  tests::writeText(folder / "duplicate.vtu", twoTetrahedra(ghosts("PointData", "1 1 1 1 1")));
  EXPECT_EQ(readMesh(folder / "hidden.vtu").left_out, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_TRUE(readMesh(folder / "duplicate.vtu").left_out.empty());
}

// An array that one block has and the other has not.
TEST(Blocks, ArraysOfSomeBlocksAreNanInTheOthers) {
  const TempFolder folder;
  tests::sample("box.pvd").write(folder);
  std::string text = tests::readText(folder / "half1.vtu");
  text.replace(text.find("Name=\"p\""), 8, "Name=\"q\"");
  tests::writeText(folder / "half1.vtu", text);
  const Source source = readMesh(folder / "box.pvd");
  const mesh::Array* p = find(source, "p", Association::points);
  const mesh::Array* q = find(source, "q", Association::points);
  ASSERT_NE(p, nullptr);
  ASSERT_NE(q, nullptr);
  ASSERT_EQ(p->values.size(), 16U);
  ASSERT_EQ(q->values.size(), 16U);
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(std::isnan(p->values[i]), i >= 8);
    EXPECT_EQ(std::isnan(q->values[i]), i < 8);
  }
}

TEST(Blocks, FlatGridsAreKeptAsCellsOfTheirOwnDimension) {
  const TempFolder folder;
  tests::writeText(folder / "flat.vtk",
                   "# vtk DataFile Version 3.0\nflat\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 1\n"
                   "ORIGIN 0 0 0\nSPACING 1 1 1\n");
  const Source source = readMesh(folder / "flat.vtk");
  EXPECT_EQ(source.points.size(), 6U);
  ASSERT_EQ(source.types.size(), 2U);
  EXPECT_EQ(source.offsets.back(), 8U);
  EXPECT_LT(source.types[0], 10);
}

TEST(Arrays, TextIsSkippedAndIntegersBecomeDoubles) {
  const TempFolder folder;
  const std::string data =
      "<CellData><DataArray type=\"String\" Name=\"label\" NumberOfTuples=\"2\" format=\"ascii\">97 0 98 0</DataArray>"
      "<DataArray type=\"Int64\" Name=\"id\" NumberOfComponents=\"1\" format=\"ascii\">-7 9007199254740992</DataArray>"
      "</CellData>";
  tests::writeText(folder / "two.vtu", twoTetrahedra(data));
  const Source source = readMesh(folder / "two.vtu");
  ASSERT_EQ(source.arrays.size(), 1U);
  EXPECT_EQ(source.arrays[0].name, "id");
  EXPECT_EQ(source.arrays[0].values, (std::vector<double>{-7.0, 9007199254740992.0}));
}

TEST(Arrays, IdentifiersAreMarked) {
  const TempFolder folder;
  const auto array = [](const std::string& type, const std::string& name) {
    return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" format=\"ascii\">1 2</DataArray>";
  };
  const std::vector<std::string> ids = {"GlobalNodeId", "vtkOriginalCellIds", "GLOBAL_IDS_CELLS", "id", "cell ids"};
  const std::vector<std::string> others = {"Acid", "idle", "fluid", "grids", "Ideal", "Density"};
  std::string data = "<CellData GlobalIds=\"numbers\">" + array("Int64", "numbers") + array("Float64", "realId");
  for (const std::string& name : ids)
    data += array("Int64", name);
  for (const std::string& name : others)
    data += array("Int32", name);
  tests::writeText(folder / "two.vtu", twoTetrahedra(data + "</CellData>"));
  const Source source = readMesh(folder / "two.vtu");
  ASSERT_EQ(source.arrays.size(), 2 + ids.size() + others.size());
  const auto marked = [&](const std::string& name) { return find(source, name, Association::cells)->identifier; };
  EXPECT_TRUE(marked("numbers"));
  EXPECT_FALSE(marked("realId"));
  for (const std::string& name : ids)
    EXPECT_TRUE(marked(name)) << name;
  for (const std::string& name : others)
    EXPECT_FALSE(marked(name)) << name;
}

TEST(Progress, IsForwardedFromTheChild) {
  const TempFolder folder;
  tests::sample("box.vtu").write(folder);
  std::vector<double> seen;
  ReadOptions options;
  options.progress = [&](double done) { seen.push_back(done); };
  readMesh(folder / "box.vtu", options);
  ASSERT_FALSE(seen.empty());
  for (const double done : seen) {
    EXPECT_GE(done, 0.0);
    EXPECT_LE(done, 1.0);
  }
}

TEST(Progress, MayThrow) {
  const TempFolder folder;
  tests::sample("box.vtu").write(folder);
  ReadOptions options;
  options.progress = [](double) { throw std::runtime_error("stop"); };
  EXPECT_THROW(readMesh(folder / "box.vtu", options), std::runtime_error);
}

}  // namespace
