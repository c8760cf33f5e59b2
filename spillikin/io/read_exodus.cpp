// Exodus II: every element block, every variable, coordinates as stored.
#include <fmt/format.h>
#include <vtkExodusIIReader.h>
#include <vtkNew.h>

#include <filesystem>

#include "spillikin/base/error.h"
#include "spillikin/io/netcdf_size.h"
#include "spillikin/io/pipeline.h"

namespace spillikin::io {
namespace {

void setAll(vtkExodusIIReader* reader, int type, int status) {
  for (int i = 0; i < reader->GetNumberOfObjects(type); ++i)
    reader->SetObjectStatus(type, i, status);
}

void checkLength(const std::string& path) {
  const std::optional<std::uint64_t> needed = netcdfSize(path);
  std::error_code error;
  const std::uintmax_t there = std::filesystem::file_size(path, error);
  if (error || !needed || there >= *needed) return;
  throw Error(
      fmt::format("'{}' is truncated or damaged: it has {} bytes, and its header speaks of more; copy or export "
                  "it again",
                  path, there));
}

}  // namespace

mesh::Source readExodus(const Request& request) {
  checkLength(request.path);
  vtkNew<vtkExodusIIReader> reader;
  reader->SetFileName(request.path.c_str());
  // Displacements stay arrays among the others: whoever draws decides whether to apply them.
  reader->ApplyDisplacementsOff();
  reader->GenerateObjectIdCellArrayOff();
  reader->GenerateGlobalElementIdArrayOff();
  reader->GenerateGlobalNodeIdArrayOff();
  reader->GenerateImplicitElementIdArrayOff();
  reader->GenerateImplicitNodeIdArrayOff();
  reader->GenerateFileIdArrayOff();
  return run(reader, request, [&] {
    // Sets repeat cells that blocks have already; blocks of faces and edges hold none that are drawn.
    for (const int type : {vtkExodusIIReader::ELEM_SET, vtkExodusIIReader::SIDE_SET, vtkExodusIIReader::FACE_SET,
                           vtkExodusIIReader::EDGE_SET, vtkExodusIIReader::NODE_SET, vtkExodusIIReader::FACE_BLOCK,
                           vtkExodusIIReader::EDGE_BLOCK}) {
      setAll(reader, type, 0);
    }
    setAll(reader, vtkExodusIIReader::ELEM_BLOCK, 1);
    reader->SetAllArrayStatus(vtkExodusIIReader::NODAL, 1);
    reader->SetAllArrayStatus(vtkExodusIIReader::ELEM_BLOCK, 1);
  });
}

}  // namespace spillikin::io
