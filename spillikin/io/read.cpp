#include "spillikin/io/read.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>

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

// Readers take some 0.1 s per megabyte of text; one that takes a hundred times as long is lost.
unsigned cpuSeconds(const std::string& path, const Format& format) {
  constexpr unsigned for_lists = 3600, at_least = 60, per_megabyte = 10;
  if (format.lists_files) return for_lists;
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  return error ? for_lists
               : at_least + static_cast<unsigned>(std::min<std::uintmax_t>(bytes >> 20, 100000)) * per_megabyte;
}

mesh::Source read(const Request& request, bool isolated) {
  const Format& format = formatOf(request.path);
  checkFile(request.path, format);
  if (!isolated) return format.read(request);
  const auto work = [&](const std::function<void(double)>& progress) {
    Request inner = request;
    inner.progress = progress;
    return format.read(inner);
  };
  return isolate(request.path, request.progress, work, cpuSeconds(request.path, format));
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
