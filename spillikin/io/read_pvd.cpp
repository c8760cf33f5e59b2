// ParaView's collections: files by time step and part.
#include <fmt/format.h>
#include <vtkSmartPointer.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>

#include "spillikin/base/error.h"
#include "spillikin/io/convert.h"
#include "spillikin/io/pipeline.h"

namespace spillikin::io {
namespace {

using Steps = std::map<double, std::vector<std::string>>;  // time to the files of its parts, in the order of the file

Steps stepsOf(const Request& request) {
  vtkSmartPointer<vtkXMLDataElement> root;
  guarded(request, [&] { root = vtk::TakeSmartPointer(vtkXMLUtilities::ReadElementFromFile(request.path.c_str())); });
  vtkXMLDataElement* collection = root == nullptr ? nullptr : root->FindNestedElementWithName("Collection");
  if (collection == nullptr) {
    throw Error(fmt::format("'{}' has no <Collection>; it is damaged, export it again", request.path));
  }
  const auto folder = std::filesystem::path(request.path).parent_path();
  Steps steps;
  for (int i = 0; i < collection->GetNumberOfNestedElements(); ++i) {
    vtkXMLDataElement* entry = collection->GetNestedElement(i);
    if (entry->GetName() == nullptr || std::strcmp(entry->GetName(), "DataSet") != 0) continue;
    const char* file = entry->GetAttribute("file");
    if (file == nullptr) {
      throw Error(fmt::format("entry {} of '{}' names no file; give it the attribute file", i, request.path));
    }
    double time = 0.0;
    entry->GetScalarAttribute("timestep", time);
    steps[time].push_back((folder / file).string());
  }
  if (steps.empty()) throw Error(fmt::format("'{}' lists no data set; export it again", request.path));
  return steps;
}

}  // namespace

mesh::Source readPvd(const Request& request) {
  const Steps steps = stepsOf(request);
  mesh::Source source;
  source.name = request.path;
  for (const auto& [time, files] : steps)
    source.times.push_back(time);
  source.step = chooseStep(request, source.times, source.times.size());
  if (request.times_only) return source;

  const std::vector<std::string>& files = steps.at(source.times[source.step]);
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (suffixOf(files[i]) == ".pvd") {
      throw Error(
          fmt::format("'{}' lists '{}', a collection in a collection; list its files instead", request.path, files[i]));
    }
    Request part;
    part.path = files[i];
    if (request.progress) {
      part.progress = [&, i](double done) {
        request.progress((static_cast<double>(i) + done) / static_cast<double>(files.size()));
      };
    }
    append(readPart(part), source);
  }
  return source;
}

}  // namespace spillikin::io
