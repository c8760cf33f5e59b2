#include "spillikin/io/read.h"

#include <fmt/format.h>

#include "spillikin/base/error.h"
#include "spillikin/io/isolate.h"
#include "spillikin/io/reader.h"

namespace spillikin::io {
namespace {

// A part of a mesh may be empty, the whole may not: readers that fail without a word leave nothing.
void checkNotEmpty(const mesh::Source& source) {
  const char* missing = source.points.empty() ? "points" : source.types.empty() ? "cells" : nullptr;
  if (missing == nullptr) return;
  throw Error(
      fmt::format("'{}' holds no {}; it is truncated or damaged, or no mesh: export it again", source.name, missing));
}

mesh::Source read(const Request& request, bool isolated) {
  const Format& format = formatOf(request.path);
  checkFile(request.path, format);
  if (!isolated) return format.read(request);
  return isolate(request.path, request.progress, [&](const std::function<void(double)>& progress) {
    Request inner = request;
    inner.progress = progress;
    return format.read(inner);
  });
}

}  // namespace

mesh::Source readMesh(const std::string& path, const ReadOptions& options) {
  if (options.step && options.time) {
    throw Error(fmt::format("both a step and a time of '{}' are asked for; choose one", path));
  }
  mesh::Source source = read({path, options.step, options.time, options.progress, false}, options.isolate);
  checkNotEmpty(source);
  return source;
}

std::vector<double> readTimes(const std::string& path) {
  return read({path, {}, {}, {}, true}, true).times;
}

}  // namespace spillikin::io
