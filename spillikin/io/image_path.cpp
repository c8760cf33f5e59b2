#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>

#include "spillikin/base/error.h"
#include "spillikin/io/write_image.h"

namespace spillikin::io {

bool knownImageSuffix(const std::string& path) {
  constexpr std::array<std::string_view, 3> known{".png", ".exr", ".npy"};
  std::string suffix = std::filesystem::path(path).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::find(known.begin(), known.end(), suffix) != known.end();
}

void checkImagePath(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path target(path);
  if (!knownImageSuffix(path)) {
    throw Error(fmt::format("{}: images are written as .png, .exr or .npy; choose one of these suffixes", path));
  }
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    throw Error(fmt::format("{}: cannot be written: there is no folder {}; make it first", path, folder.string()));
  }
  if (fs::is_directory(target, error)) throw Error(fmt::format("{}: is a folder; name a file in it", path));
  if (access(folder.c_str(), W_OK) != 0) {
    throw Error(
        fmt::format("{}: cannot be written: the folder {} takes no files; choose another", path, folder.string()));
  }
}

}  // namespace spillikin::io
