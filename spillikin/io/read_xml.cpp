// VTK's XML files of one data set, and multi-block files.
#include <fmt/format.h>
#include <vtkSmartPointer.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLMultiBlockDataReader.h>
#include <vtkXMLRectilinearGridReader.h>
#include <vtkXMLStructuredGridReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include "spillikin/base/error.h"
#include "spillikin/io/pipeline.h"

namespace spillikin::io {
namespace {

template <typename T>
vtkSmartPointer<vtkXMLReader> make() {
  return vtkSmartPointer<T>::New();
}

vtkSmartPointer<vtkXMLReader> readerFor(const std::string& suffix) {
  if (suffix == ".vtu") return make<vtkXMLUnstructuredGridReader>();
  if (suffix == ".vts") return make<vtkXMLStructuredGridReader>();
  if (suffix == ".vtr") return make<vtkXMLRectilinearGridReader>();
  if (suffix == ".vti") return make<vtkXMLImageDataReader>();
  return make<vtkXMLMultiBlockDataReader>();
}

}  // namespace

mesh::Source readXml(const Request& request) {
  const vtkSmartPointer<vtkXMLReader> reader = readerFor(suffixOf(request.path));
  reader->SetFileName(request.path.c_str());
  return run(reader, request);
}

}  // namespace spillikin::io
