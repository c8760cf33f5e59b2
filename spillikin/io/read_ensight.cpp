// EnSight 6 and Gold, ASCII and binary, through their case file.
#include <vtkGenericEnSightReader.h>
#include <vtkNew.h>

#include "spillikin/io/pipeline.h"

namespace spillikin::io {

mesh::Source readEnsight(const Request& request) {
  vtkNew<vtkGenericEnSightReader> reader;
  reader->SetCaseFileName(request.path.c_str());
  reader->ReadAllVariablesOn();
  return run(reader, request);
}

}  // namespace spillikin::io
