// VTK's parallel XML files. The pieces are read one by one and joined as blocks, rather than by VTK's own parallel
// readers, which copy a piece's bytes even where its types differ from those announced, and pass over missing pieces.
#include <fmt/format.h>
#include <vtkXMLDataElement.h>

#include "spillikin/base/error.h"
#include "spillikin/io/xml_index.h"

namespace spillikin::io {
namespace {

const char* listOf(const std::string& suffix) {
  if (suffix == ".pvtu") return "PUnstructuredGrid";
  if (suffix == ".pvts") return "PStructuredGrid";
  if (suffix == ".pvtr") return "PRectilinearGrid";
  return "PImageData";
}

}  // namespace

mesh::Source readParallel(const Request& request) {
  std::vector<std::string> pieces;
  forEachEntry(request, listOf(suffixOf(request.path)), "Piece",
               [&](vtkXMLDataElement* piece) { pieces.push_back(fileOf(piece, "Source", request)); });
  if (pieces.empty()) throw Error(fmt::format("'{}' lists no piece; export it again", request.path));
  mesh::Source source;
  source.name = request.path;
  source.step = chooseStep(request, {}, 1);
  if (!request.times_only) appendParts(pieces, request, source);
  return source;
}

}  // namespace spillikin::io
