// Bad input: each kind gets one line that names the file, says what is wrong and what to do.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>

#include "io_samples.h"
#include "spillikin/base/error.h"
#include "spillikin/io/read.h"

namespace {

using namespace spillikin;
using io::readMesh;
using mesh::Source;
using tests::Sample;
using tests::TempFolder;
using tests::writeText;

// The message of the Error that reading must end with, on one line.
std::string refusal(const std::string& path, const io::ReadOptions& options = {}) {
  try {
    readMesh(path, options);
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(path), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    return text;
  }
  ADD_FAILURE() << path << " was read";
  return {};
}

void expectSays(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << text << "' does not say '" << part << "'";
}

TEST(BadInput, Missing) {
  const TempFolder folder;
  expectSays(refusal(folder / "no.vtu"), "does not exist");
  expectSays(refusal(folder / "no/such/folder.ex2"), "does not exist");
}

TEST(BadInput, Empty) {
  const TempFolder folder;
  for (const char* name : {"a.vtu", "a.vtk", "a.ex2", "a.pvd", "a.case", "a.cgns", "axyz.bin", "a.pvtu"}) {
    writeText(folder / name, "");
    expectSays(refusal(folder / name), "is empty");
  }
}

TEST(BadInput, Folder) {
  const TempFolder folder;
  std::filesystem::create_directory(folder.path() / "a.vtu");
  expectSays(refusal(folder / "a.vtu"), "is a folder");
}

TEST(BadInput, Pipe) {
  const TempFolder folder;
  ASSERT_EQ(mkfifo((folder / "a.vtu").c_str(), 0600), 0);
  expectSays(refusal(folder / "a.vtu"), "pipe");
}

TEST(BadInput, UnknownSuffixListsTheKnown) {
  const TempFolder folder;
  writeText(folder / "mesh.stl", "solid\n");
  for (const char* known : {".vtu", ".vtk", ".ex2", ".cgns", ".foam", "xyz.bin", ".pvd"}) {
    expectSays(refusal(folder / "mesh.stl"), known);
  }
  writeText(folder / "mesh", "");
  expectSays(refusal(folder / "mesh"), ".vtu");
}

TEST(BadInput, MisnamedFilesAreRecognised) {
  const TempFolder folder;
  tests::sample("unstructured.vtk").write(folder);
  tests::sample("box.vtu").write(folder);
  tests::sample("box.exo").write(folder);
  const auto copy = [&](const char* from, const char* to) {
    writeText(folder / to, tests::readText(folder / from));
    return folder / to;
  };
  expectSays(refusal(copy("unstructured.vtk", "legacy.vtu")), "rename it to end in .vtk");
  expectSays(refusal(copy("box.vtu", "xml.vtk")), "rename it to end in .vtu");
  expectSays(refusal(copy("box.vtu", "xml.vts")), "VTK XML UnstructuredGrid");
  expectSays(refusal(copy("box.vtu", "xml.ex2")), "rename it to end in .vtu");
  expectSays(refusal(copy("box.exo", "exodus.vtu")), "rename it to end in .ex2");
  expectSays(refusal(copy("box.vtu", "xml.mesh")), "rename it to end in .vtu");
  writeText(folder / "packed.vtu", "\x1f\x8b\x08 and so on");
  expectSays(refusal(folder / "packed.vtu"), "unpack it first");
  writeText(folder / "noise.ex2", "no mesh at all, only words");
  expectSays(refusal(folder / "noise.ex2"), "does not begin like NetCDF");
  writeText(folder / "page.vtu", "<!doctype html><html></html>");
  expectSays(refusal(folder / "page.vtu"), "other XML");
}

TEST(BadInput, IdsOutOfRange) {
  const TempFolder folder;
  const std::string points = "0 0 0 1 0 0 0 1 0 0 0 1";
  writeText(folder / "high.vtu", tests::vtu(4, 1, points, "0 1 2 4", "4", "10"));
  expectSays(refusal(folder / "high.vtu"), "cell 0");
  expectSays(refusal(folder / "high.vtu"), "point 4");
  writeText(folder / "low.vtu", tests::vtu(4, 1, points, "0 1 2 -1", "4", "10"));
  expectSays(refusal(folder / "low.vtu"), "point -1");
  writeText(folder / "offsets.vtu", tests::vtu(4, 1, points, "0 1 2 3", "5", "10"));
  refusal(folder / "offsets.vtu");
  const std::string faces = "4 3 0 2 1 3 0 1 3 3 1 2 3 90 0 3 2";
  writeText(folder / "faces.vtu", tests::vtu(4, 1, points, "0 1 2 3", "4", "42|" + faces + "|17"));
  refusal(folder / "faces.vtu");
}

TEST(BadInput, NoSuchStepAndTwoChoices) {
  const TempFolder folder;
  tests::sample("box.exo").write(folder);
  io::ReadOptions options;
  options.step = 21;
  expectSays(refusal(folder / "box.exo", options), "has no step 21: it has 2 steps");
  options.time = 0.0;
  expectSays(refusal(folder / "box.exo", options), "choose one");
}

TEST(BadInput, PartsOfAListAreMissing) {
  const TempFolder folder;
  for (const char* list : {"box.pvtu", "box.pvd", "box.pvti"}) {
    tests::sample(list).write(folder);
    for (const char* part : {"half1.vtu", "half1.vti"})
      std::filesystem::remove(folder / part);
    try {
      readMesh(folder / list);
      FAIL() << list << " was read";
    } catch (const Error& error) {
      expectSays(error.what(), "half1");
    }
  }
  tests::sample("box.vtm").write(folder);
  std::filesystem::remove(folder / "half1.vtu");
  refusal(folder / "box.vtm");
}

// The reader would look for the missing time for ever.
TEST(BadInput, FewerTimesThanSteps) {
  const TempFolder folder;
  tests::sample("box.case").write(folder);
  std::string text = tests::readText(folder / "box.case");
  writeText(folder / "box.case", text.substr(0, text.find(" 0.5")));
  expectSays(refusal(folder / "box.case"), "2 steps, but has 1 time values");
}

TEST(BadInput, AListOfItself) {
  const TempFolder folder;
  tests::sample("box.pvd").write(folder);
  std::string text = tests::readText(folder / "box.pvd");
  text.replace(text.find("half0.vtu"), 9, "box.pvd");
  writeText(folder / "box.pvd", text);
  expectSays(refusal(folder / "box.pvd"), "itself a list");
}

TEST(BadInput, AsksForMoreMemoryThanThereIs) {
  const TempFolder folder;
  writeText(folder / "huge.vtk",
            "# vtk DataFile Version 3.0\nhuge\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 99999999999999 float\n0 0 0\n");
  refusal(folder / "huge.vtk");
  writeText(folder / "grid.vti",
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
            "<ImageData WholeExtent=\"0 99999 0 99999 0 99999\" Origin=\"0 0 0\" Spacing=\"1 1 1\">"
            "<Piece Extent=\"0 99999 0 99999 0 99999\"/></ImageData></VTKFile>\n");
  refusal(folder / "grid.vti");
}

// A file cut short is refused, or what is read of it is right: legacy files have no end mark, so that whole arrays may
// be missing there, but none may be wrong.
class Truncated : public testing::TestWithParam<const char*> {};

TEST_P(Truncated, IsNeverReadWrongly) {
  const Sample& sample = tests::sample(GetParam());
  const TempFolder folder;
  sample.write(folder);
  const std::string path = folder / sample.name, whole = tests::readText(path);
  const Source good = readMesh(path);
  int refused = 0;
  constexpr std::size_t cuts = 40;
  for (std::size_t cut = 0; cut < cuts; ++cut) {
    const std::size_t size = whole.size() * cut / cuts;
    writeText(path, whole.substr(0, size));
    SCOPED_TRACE(fmt::format("{} of {} bytes of {}", size, whole.size(), path));
    try {
      const Source source = readMesh(path);
      EXPECT_EQ(source.points, good.points);
      EXPECT_EQ(source.connectivity, good.connectivity);
      for (const mesh::Array& array : source.arrays) {
        const bool found = std::any_of(good.arrays.begin(), good.arrays.end(), [&](const mesh::Array& other) {
          return other.name == array.name && other.association == array.association && other.values == array.values;
        });
        EXPECT_TRUE(found) << array.name;
      }
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, static_cast<int>(cuts) / 4);
}

INSTANTIATE_TEST_SUITE_P(Formats, Truncated,
                         testing::Values("box.vtu", "appended.vtu", "binary.vtk", "box.vts", "box.vtr", "box.vti",
                                         "box.pvtu", "box.pvd", "box.vtm", "box.exo", "box.cgns"));

// The geometry of a PLOT3D file is told by its length, so that a short file may by chance fit another one.
TEST(BadInput, Plot3dOfTheWrongLength) {
  const TempFolder folder;
  tests::sample("boxxyz.bin").write(folder);
  const std::string geometry = tests::readText(folder / "boxxyz.bin"), solution = tests::readText(folder / "boxq.bin");
  for (const std::size_t size : {std::size_t{1}, std::size_t{12}, geometry.size() / 2, geometry.size() - 1}) {
    writeText(folder / "boxxyz.bin", geometry.substr(0, size));
    refusal(folder / "boxxyz.bin");
  }
  writeText(folder / "boxxyz.bin", geometry);
  for (const std::size_t size : {std::size_t{1}, std::size_t{12}, solution.size() / 2, solution.size() - 1}) {
    writeText(folder / "boxq.bin", solution.substr(0, size));
    refusal(folder / "boxxyz.bin");
  }
}

}  // namespace
