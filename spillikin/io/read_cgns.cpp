// CGNS: every base, zone and solution array.
#include <vtkCGNSReader.h>
#include <vtkNew.h>

#include "spillikin/io/pipeline.h"

namespace spillikin::io {

mesh::Source readCgns(const Request& request) {
  vtkNew<vtkCGNSReader> reader;
  reader->SetFileName(request.path.c_str());
  reader->DoublePrecisionMeshOn();
  reader->DistributeBlocksOff();
  return run(reader, request, [&] {
    reader->EnableAllBases();
    reader->EnableAllFamilies();
    reader->EnableAllPointArrays();
    reader->EnableAllCellArrays();
  });
}

}  // namespace spillikin::io
