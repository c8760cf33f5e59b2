#include "spillikin/io/xml_index.h"

#include <fmt/format.h>
#include <vtkSmartPointer.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include <cstring>
#include <filesystem>

#include "spillikin/base/error.h"
#include "spillikin/io/convert.h"
#include "spillikin/io/pipeline.h"

namespace spillikin::io {

void forEachEntry(const Request& request, const char* list, const char* entry,
                  const std::function<void(vtkXMLDataElement*)>& visit) {
  vtkSmartPointer<vtkXMLDataElement> root;
  guarded(request, [&] { root = vtk::TakeSmartPointer(vtkXMLUtilities::ReadElementFromFile(request.path.c_str())); });
  vtkXMLDataElement* found = root == nullptr ? nullptr : root->FindNestedElementWithName(list);
  if (found == nullptr) {
    throw Error(fmt::format("'{}' has no <{}>; it is damaged, export it again", request.path, list));
  }
  for (int i = 0; i < found->GetNumberOfNestedElements(); ++i) {
    vtkXMLDataElement* nested = found->GetNestedElement(i);
    if (nested->GetName() != nullptr && std::strcmp(nested->GetName(), entry) == 0) visit(nested);
  }
}

std::string fileOf(vtkXMLDataElement* entry, const char* attribute, const Request& request) {
  const char* file = entry->GetAttribute(attribute);
  if (file == nullptr || *file == '\0') {
    throw Error(fmt::format("an entry <{}> of '{}' names no file; give it the attribute {}", entry->GetName(),
                            request.path, attribute));
  }
  return (std::filesystem::path(request.path).parent_path() / file).string();
}

void appendParts(const std::vector<std::string>& files, const Request& request, mesh::Source& source) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string suffix = suffixOf(files[i]);
    if (suffix == ".pvd" || (suffix.starts_with(".pv") && suffixOf(request.path) != ".pvd")) {
      throw Error(
          fmt::format("'{}' lists '{}', which is itself a list; list its files instead", request.path, files[i]));
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
}

}  // namespace spillikin::io
