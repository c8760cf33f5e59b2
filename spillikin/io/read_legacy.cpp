// Legacy VTK files of any data set: unstructured, structured, rectilinear, image.
#include <vtkDataSetReader.h>
#include <vtkNew.h>

#include "spillikin/io/pipeline.h"

namespace spillikin::io {

mesh::Source readLegacy(const Request& request) {
  vtkNew<vtkDataSetReader> reader;
  reader->SetFileName(request.path.c_str());
  // By default only the first array of each kind is read.
  reader->ReadAllScalarsOn();
  reader->ReadAllVectorsOn();
  reader->ReadAllNormalsOn();
  reader->ReadAllTensorsOn();
  reader->ReadAllColorScalarsOn();
  reader->ReadAllTCoordsOn();
  reader->ReadAllFieldsOn();
  mesh::Source source = run(reader, request);
  // The reader gives every file the one time 0.
  if (source.times == std::vector<double>{0.0}) source.times.clear();
  return source;
}

}  // namespace spillikin::io
