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
  mesh::Source source = run(reader, request, [&] {
    reader->EnableAllBases();
    reader->EnableAllFamilies();
    reader->EnableAllPointArrays();
    reader->EnableAllCellArrays();
  });
  // The reader gives a file without iterations the one time 0.
  if (source.times == std::vector<double>{0.0}) source.times.clear();
  return source;
}

}  // namespace spillikin::io
