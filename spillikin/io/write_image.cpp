#include "spillikin/io/write_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "spillikin/base/error.h"
#include "spillikin/io/codecs.h"

namespace spillikin::io {
namespace {

enum class Format { png, exr, npy };

Format formatOf(const std::string& path) {
  std::string suffix = std::filesystem::path(path).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  if (suffix == ".png") return Format::png;
  if (suffix == ".exr") return Format::exr;
  if (suffix == ".npy") return Format::npy;
  throw Error(fmt::format("'{}' has no suffix of a picture; name it .png, .exr or .npy", path));
}

Bytes bytesOf(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    throw Error(fmt::format("picture '{}' does not exist; check the name", path));
  }
  if (std::filesystem::is_directory(path, error)) {
    throw Error(fmt::format("'{}' is a folder; name a picture in it", path));
  }
  std::ifstream in(path, std::ios::binary);
  Bytes bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in) throw Error(fmt::format("cannot read picture '{}'; check its permissions", path));
  if (bytes.empty()) throw Error(fmt::format("picture '{}' is empty; write it again", path));
  return bytes;
}

}  // namespace

void writeImage(const std::string& path, const Image& image, const std::array<double, 4>& background) {
  const Format format = formatOf(path);
  if (image.width < 1 || image.height < 1 ||
      image.rgba.size() != 4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw Error(fmt::format("cannot write '{}': the image has no pixels; render at least 1x1", path));
  }
  Bytes bytes;
  try {
    bytes = format == Format::png   ? encodePng(image, background)
            : format == Format::exr ? encodeExr(image)
                                    : encodeNpy(image);
  } catch (const std::exception& error) {
    throw Error(fmt::format("cannot write '{}': {}; try another format or size", path, error.what()));
  }
  writeFile(path, bytes.data(), bytes.size());
}

Image readImage(const std::string& path) {
  const Format format = formatOf(path);
  const Bytes bytes = bytesOf(path);
  try {
    return format == Format::png ? decodePng(bytes) : format == Format::exr ? decodeExr(bytes) : decodeNpy(bytes);
  } catch (const std::exception& error) {
    throw Error(fmt::format("cannot read picture '{}': {}; write it again", path, error.what()));
  }
}

}  // namespace spillikin::io
