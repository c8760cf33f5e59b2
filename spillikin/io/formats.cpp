// The table of file families, and what is checked before a reader of VTK sees a file.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "spillikin/base/error.h"
#include "spillikin/io/reader.h"
#include "spillikin/io/sniff.h"

namespace spillikin::io {
namespace {

const std::vector<Format>& formats() {
  static const std::vector<Format> table = {
      {{".vtu"}, "VTK XML UnstructuredGrid", readXml},
      {{".pvtu"}, "VTK XML PUnstructuredGrid", readParallel, true},
      {{".vts"}, "VTK XML StructuredGrid", readXml},
      {{".pvts"}, "VTK XML PStructuredGrid", readParallel, true},
      {{".vtr"}, "VTK XML RectilinearGrid", readXml},
      {{".pvtr"}, "VTK XML PRectilinearGrid", readParallel, true},
      {{".vti"}, "VTK XML ImageData", readXml},
      {{".pvti"}, "VTK XML PImageData", readParallel, true},
      {{".vtm"}, "VTK XML vtkMultiBlockDataSet", readXml, true},
      {{".pvd"}, "VTK XML Collection", readPvd, true},
      {{".vtk"}, "legacy VTK", readLegacy},
      {{".ex2", ".e", ".exo", ".g"}, "NetCDF|HDF5", readExodus},
      {{".case"}, "EnSight case", readEnsight, true},
      {{".cgns"}, "HDF5|ADF", readCgns},
      {{".foam"}, "", readOpenFoam, true, true},
      {{"xyz.bin", ".xyz", ".x", ".p3d"}, "", readPlot3d},
  };
  return table;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

std::string knownSuffixes() {
  std::vector<std::string> names;
  for (const Format& format : formats()) {
    for (const std::string& suffix : format.suffixes) {
      names.push_back(suffix.front() == '.' ? suffix : "NAME" + suffix);
    }
  }
  return fmt::format("{}", fmt::join(names, " "));
}

std::string headOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string head(4096, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (in.bad() || (!in && !in.eof())) {
    throw Error(fmt::format("cannot read '{}'; check its permissions", path));
  }
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

bool accepts(const Format& format, const std::string& content) {
  return ("|" + format.content + "|").find("|" + content + "|") != std::string::npos;
}

}  // namespace

std::string suffixOf(const std::string& path) {
  return lower(std::filesystem::path(path).extension().string());
}

const Format& formatOf(const std::string& path) {
  const std::string name = lower(std::filesystem::path(path).filename().string());
  for (const Format& format : formats()) {
    for (const std::string& suffix : format.suffixes) {
      if (name.size() > suffix.size() && name.ends_with(suffix)) return format;
    }
  }
  // A file that is there and says what it is gets the name it should have.
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) {
    const std::string content = sniff(headOf(path));
    const std::string suffix = suffixFor(content);
    if (!suffix.empty()) {
      throw Error(fmt::format("'{}' holds {} data but is not named so; rename it to end in {}", path, content, suffix));
    }
  }
  throw Error(fmt::format("'{}' has no suffix of a mesh; known are {}", path, knownSuffixes()));
}

void checkFile(const std::string& path, const Format& format) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw Error(fmt::format("mesh '{}' does not exist; check the name and the folder", path));
  }
  if (std::filesystem::is_directory(status)) {
    throw Error(fmt::format("'{}' is a folder, not a mesh; name a file in it", path));
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw Error(fmt::format("'{}' is a device or a pipe, not a file; copy the mesh to a file", path));
  }
  const std::string head = headOf(path);
  if (format.empty_allowed) return;
  if (head.empty()) throw Error(fmt::format("mesh '{}' is empty; write or copy it again", path));

  const std::string content = sniff(head);
  if (format.content.empty() || accepts(format, content)) return;
  const std::string expected = format.content.substr(0, format.content.find('|'));
  if (content == "gzip" || content == "zip" || content == "bzip2" || content == "xz" || content == "zstd") {
    throw Error(fmt::format("'{}' is compressed by {}; unpack it first", path, content));
  }
  const std::string suffix = suffixFor(content);
  if (!suffix.empty()) {
    throw Error(fmt::format("'{}' holds {} data, not {}; rename it to end in {}", path, content, expected, suffix));
  }
  if (!content.empty()) {
    throw Error(
        fmt::format("'{}' holds {} data, not {}; convert it to one of {}", path, content, expected, knownSuffixes()));
  }
  throw Error(fmt::format("'{}' does not begin like {} data; it is damaged or has the wrong suffix (known are {})",
                          path, expected, knownSuffixes()));
}

mesh::Source readPart(const Request& request) {
  const Format& format = formatOf(request.path);
  checkFile(request.path, format);
  return format.read(request);
}

std::size_t chooseStep(const Request& request, const std::vector<double>& times, std::size_t count) {
  if (request.step) {
    if (*request.step < count) return *request.step;
    throw Error(fmt::format("'{}' has no step {}: it has {} {}; choose 0{}", request.path, *request.step, count,
                            count == 1 ? "step" : "steps",
                            count == 1 ? std::string() : fmt::format(" to {}", count - 1)));
  }
  if (!request.time || times.empty()) return 0;
  const auto nearer = [&](double a, double b) { return std::abs(a - *request.time) < std::abs(b - *request.time); };
  return static_cast<std::size_t>(std::min_element(times.begin(), times.end(), nearer) - times.begin());
}

}  // namespace spillikin::io
