// XML files that only list other files. Private to io.
#pragma once

#include <string>
#include <vector>

#include "spillikin/io/reader.h"

class vtkXMLDataElement;

namespace spillikin::io {

// Parses request.path and calls `visit` for each element `entry` inside the element `list` (at any depth below the
// root's). Throws Error: not XML, no such list.
void forEachEntry(const Request& request, const char* list, const char* entry,
                  const std::function<void(vtkXMLDataElement*)>& visit);

// The file that `attribute` of `entry` names, relative to the folder of request.path. Throws Error when it is missing.
std::string fileOf(vtkXMLDataElement* entry, const char* attribute, const Request& request);

// Reads the files as blocks of one mesh. None may itself be such a list. Throws the Error of the first that fails.
void appendParts(const std::vector<std::string>& files, const Request& request, mesh::Source& source);

}  // namespace spillikin::io
