// ParaView's collections: files by time step and part.
#include <fmt/format.h>
#include <vtkXMLDataElement.h>

#include <map>

#include "spillikin/base/error.h"
#include "spillikin/io/xml_index.h"

namespace spillikin::io {
namespace {

using Steps = std::map<double, std::vector<std::string>>;  // time to the files of its parts, in the order of the file

Steps stepsOf(const Request& request) {
  Steps steps;
  forEachEntry(request, "Collection", "DataSet", [&](vtkXMLDataElement* entry) {
    double time = 0.0;
    entry->GetScalarAttribute("timestep", time);
    steps[time].push_back(fileOf(entry, "file", request));
  });
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
  if (!request.times_only) appendParts(steps.at(source.times[source.step]), request, source);
  return source;
}

}  // namespace spillikin::io
