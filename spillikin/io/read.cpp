#include "spillikin/io/read.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>

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

// Bytes that reading may meet: the file's, or those of all files beneath its folder where it names others.
std::uintmax_t bytesToRead(const std::string& path, const Format& format) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!format.lists_files) return fs::file_size(path, error);
  const fs::path folder = fs::absolute(path, error).parent_path();
  std::uintmax_t sum = 0;
  std::size_t looked_at = 0;
  constexpr std::size_t at_most = 5000;  // files; where there are more, time is no bound
  fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, error), end;
  for (; !error && at != end && looked_at < at_most; at.increment(error), ++looked_at) {
    std::error_code none;
    if (at->is_regular_file(none)) sum += at->file_size(none);
  }
  return looked_at < at_most ? sum : std::numeric_limits<std::uint32_t>::max();
}

// Readers take some 0.1 s per megabyte of text; one that takes a hundred times as long is lost.
unsigned cpuSeconds(const std::string& path, const Format& format) {
  const std::uintmax_t at_least = format.lists_files ? 60 : 20;
  constexpr std::uintmax_t per_megabyte = 10, at_most = 100000;
  return static_cast<unsigned>(std::min(at_least + per_megabyte * (bytesToRead(path, format) >> 20), at_most));
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
