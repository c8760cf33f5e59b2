// OpenFOAM: the internal mesh of every region, polyhedra whole.
#include <vtkNew.h>
#include <vtkOpenFOAMReader.h>

#include <string>

#include "spillikin/io/pipeline.h"

namespace spillikin::io {

mesh::Source readOpenFoam(const Request& request) {
  vtkNew<vtkOpenFOAMReader> reader;
  reader->SetFileName(request.path.c_str());
  reader->DecomposePolyhedraOff();
  // Cell values are also given at the points, averaged, as viewers of these files expect.
  reader->CreateCellToPointOn();
  return run(reader, request, [&] {
    for (int i = 0; i < reader->GetNumberOfPatchArrays(); ++i) {
      const std::string patch = reader->GetPatchArrayName(i);
      reader->SetPatchArrayStatus(patch.c_str(), patch.ends_with("internalMesh") ? 1 : 0);
    }
    reader->EnableAllCellArrays();
    reader->EnableAllPointArrays();
    reader->DisableAllLagrangianArrays();
  });
}

}  // namespace spillikin::io
