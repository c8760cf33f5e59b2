#include "spillikin/io/sniff.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace spillikin::io {
namespace {

using namespace std::string_view_literals;

struct Magic {
  std::string_view bytes;
  std::string_view name;
};

constexpr std::array magics = {
    Magic{"# vtk DataFile"sv, "legacy VTK"sv},
    Magic{"CDF\001"sv, "NetCDF"sv},
    Magic{"CDF\002"sv, "NetCDF"sv},
    Magic{"CDF\005"sv, "NetCDF"sv},
    Magic{"\x89HDF\r\n\x1a\n"sv, "HDF5"sv},
    Magic{"\x1f\x8b"sv, "gzip"sv},
    Magic{"PK\003\004"sv, "zip"sv},
    Magic{"BZh"sv, "bzip2"sv},
    Magic{"\xfd"
          "7zXZ"sv,
          "xz"sv},
    Magic{"\x28\xb5\x2f\xfd"sv, "zstd"sv},
    Magic{"\x89PNG"sv, "PNG picture"sv},
    Magic{"\xff\xd8\xff"sv, "JPEG picture"sv},
    Magic{"%PDF"sv, "PDF"sv},
    Magic{"$MeshFormat"sv, "Gmsh"sv},
    Magic{"ply\n"sv, "PLY"sv},
    Magic{"solid "sv, "STL"sv},
    Magic{"\x93NUMPY"sv, "NumPy"sv},
    Magic{"\x7f"
          "ELF"sv,
          "program"sv},
};

constexpr std::array<std::pair<std::string_view, std::string_view>, 14> suffixes = {{
    {"legacy VTK", ".vtk"},
    {"VTK XML UnstructuredGrid", ".vtu"},
    {"VTK XML StructuredGrid", ".vts"},
    {"VTK XML RectilinearGrid", ".vtr"},
    {"VTK XML ImageData", ".vti"},
    {"VTK XML PUnstructuredGrid", ".pvtu"},
    {"VTK XML PStructuredGrid", ".pvts"},
    {"VTK XML PRectilinearGrid", ".pvtr"},
    {"VTK XML PImageData", ".pvti"},
    {"VTK XML vtkMultiBlockDataSet", ".vtm"},
    {"VTK XML Collection", ".pvd"},
    {"NetCDF", ".ex2"},
    {"EnSight case", ".case"},
    {"ADF", ".cgns"},
}};

// The value of the type attribute of <VTKFile ...>.
std::string xmlType(std::string_view head) {
  const std::size_t element = head.find("<VTKFile");
  if (element == std::string_view::npos) return {};
  const std::string_view tag = head.substr(element, head.find('>', element) - element);
  const std::size_t key = tag.find(" type=");
  if (key == std::string_view::npos || key + 7 >= tag.size()) return {};
  const char quote = tag[key + 6];
  const std::string_view value = tag.substr(key + 7, tag.substr(key + 7).find(quote));
  const bool name = std::all_of(value.begin(), value.end(), [](unsigned char c) { return std::isalnum(c) != 0; });
  return name ? std::string(value) : std::string();
}

bool caseFile(std::string_view head) {
  const std::size_t type = head.find("type:");
  return head.find("FORMAT") != std::string_view::npos && type != std::string_view::npos &&
         head.find("ensight", type) != std::string_view::npos;
}

}  // namespace

std::string sniff(std::string_view head) {
  for (const Magic& magic : magics) {
    if (head.starts_with(magic.bytes)) return std::string(magic.name);
  }
  const std::string type = xmlType(head);
  if (!type.empty()) return "VTK XML " + type;
  if (head.substr(0, 64).find("ADF Database") != std::string_view::npos) return "ADF";
  if (caseFile(head)) return "EnSight case";
  const std::size_t first = head.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first != std::string_view::npos && head.substr(first).starts_with("<")) return "other XML";
  return {};
}

std::string suffixFor(const std::string& content) {
  for (const auto& [name, suffix] : suffixes) {
    if (content == name) return std::string(suffix);
  }
  return {};
}

}  // namespace spillikin::io
