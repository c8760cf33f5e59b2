// NumPy's .npy, version 1.0 written, 1.0 to 3.0 read.
#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

#include "spillikin/base/error.h"
#include "spillikin/io/codecs.h"
#include "spillikin/io/write_image.h"

namespace spillikin::io {
namespace {

static_assert(std::endian::native == std::endian::little, "values are written as they stand in memory");

constexpr const char magic[] = "\x93NUMPY";

Bytes encode(const char* descr, const std::string& shape, const void* values, std::size_t size) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", descr, shape);
  // The values start at a multiple of 64 bytes: 10 bytes of preamble, the header, padding, a newline.
  header.append(63 - (10 + header.size()) % 64, ' ');
  header.push_back('\n');
  Bytes bytes(10 + header.size() + size);
  std::memcpy(bytes.data(), magic, 6);
  bytes[6] = 1;
  bytes[8] = static_cast<unsigned char>(header.size() & 0xff);
  bytes[9] = static_cast<unsigned char>(header.size() >> 8);
  std::memcpy(bytes.data() + 10, header.data(), header.size());
  if (size > 0) std::memcpy(bytes.data() + 10 + header.size(), values, size);
  return bytes;
}

// What follows 'key': in the header, from its first character that is not blank.
std::string_view entry(std::string_view header, const std::string& key) {
  std::size_t at = header.find("'" + key + "'");
  if (at == std::string_view::npos) throw Error(fmt::format("its header has no '{}'", key));
  at = header.find(':', at);
  at = header.find_first_not_of(' ', at == std::string_view::npos ? at : at + 1);
  if (at == std::string_view::npos) throw Error(fmt::format("its header has no value for '{}'", key));
  return header.substr(at);
}

std::vector<std::size_t> shapeOf(std::string_view text) {
  std::vector<std::size_t> shape;
  std::size_t number = 0;
  bool in_number = false;
  for (const char c : text) {
    if (c >= '0' && c <= '9') {
      if (number > (std::size_t{1} << 40)) throw Error("its shape is out of all proportion");
      number = number * 10 + static_cast<std::size_t>(c - '0');
      in_number = true;
      continue;
    }
    if (in_number) shape.push_back(number);
    number = 0;
    in_number = false;
    if (c == ')') break;
  }
  return shape;
}

}  // namespace

Bytes encodeNpy(const Image& image) {
  return encode("<f4", fmt::format("({}, {}, 4)", image.height, image.width), image.rgba.data(),
                image.rgba.size() * sizeof(float));
}

void writeNpy(const std::string& path, const std::vector<std::int64_t>& values) {
  const Bytes bytes =
      encode("<i8", fmt::format("({},)", values.size()), values.data(), values.size() * sizeof(std::int64_t));
  writeFile(path, bytes.data(), bytes.size());
}

Image decodeNpy(const Bytes& bytes) {
  if (bytes.size() < 10 || std::memcmp(bytes.data(), magic, 6) != 0) throw Error("it does not begin like a .npy file");
  const std::size_t preamble = bytes[6] == 1 ? 10 : 12;
  if (bytes.size() < preamble) throw Error("it ends too early");
  std::size_t header_size = bytes[8] | static_cast<std::size_t>(bytes[9]) << 8;
  if (preamble == 12) {
    header_size |= static_cast<std::size_t>(bytes[10]) << 16 | static_cast<std::size_t>(bytes[11]) << 24;
  }
  if (bytes.size() - preamble < header_size) throw Error("it ends too early");
  const std::string_view header(reinterpret_cast<const char*>(bytes.data()) + preamble, header_size);
  if (!entry(header, "descr").starts_with("'<f4'")) throw Error("its values are not of type '<f4'");
  if (!entry(header, "fortran_order").starts_with("False")) throw Error("it is in Fortran order");
  const std::vector<std::size_t> shape = shapeOf(entry(header, "shape"));
  if (shape.size() != 3 || shape[2] != 4) throw Error("its shape is not height x width x 4");
  if (shape[0] < 1 || shape[1] < 1 || shape[0] > 65536 || shape[1] > 65536) {
    throw Error(fmt::format("its size {} x {} is not that of a picture", shape[1], shape[0]));
  }
  const std::size_t size = shape[0] * shape[1] * 4 * sizeof(float);
  if (bytes.size() - preamble - header_size < size) throw Error("it ends too early");
  Image image(static_cast<int>(shape[1]), static_cast<int>(shape[0]));
  std::memcpy(image.rgba.data(), bytes.data() + preamble + header_size, size);
  return image;
}

}  // namespace spillikin::io
