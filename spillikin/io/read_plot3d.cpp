// PLOT3D: a geometry file, and beside it the solution where there is one.
#include <vtkMultiBlockPLOT3DReader.h>
#include <vtkNew.h>

#include <filesystem>

#include "spillikin/io/pipeline.h"

namespace spillikin::io {
namespace {

// NAMExyz.bin -> NAMEq.bin; NAME.xyz, NAME.x, NAME.p3d -> NAME.q.
std::string solutionOf(const std::string& geometry) {
  constexpr std::string_view paired = "xyz.bin";
  if (suffixOf(geometry) == ".bin") return geometry.substr(0, geometry.size() - paired.size()) + "q.bin";
  return std::filesystem::path(geometry).replace_extension(".q").string();
}

}  // namespace

mesh::Source readPlot3d(const Request& request) {
  vtkNew<vtkMultiBlockPLOT3DReader> reader;
  reader->SetXYZFileName(request.path.c_str());
  const std::string solution = solutionOf(request.path);
  std::error_code error;
  if (std::filesystem::exists(solution, error)) reader->SetQFileName(solution.c_str());
  reader->AutoDetectFormatOn();
  return run(reader, request);
}

}  // namespace spillikin::io
