// PNG through libpng's simplified interface.
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "spillikin/base/error.h"
#include "spillikin/io/codecs.h"

namespace spillikin::io {
namespace {

unsigned char byteOf(double value) {
  if (!(value > 0.0)) return 0;  // NaN too
  return static_cast<unsigned char>(std::lround(std::min(value, 1.0) * 255.0));
}

}  // namespace

Bytes encodePng(const Image& image, const std::array<double, 4>& background) {
  const bool opaque = background[3] >= 1.0;
  const std::size_t channels = opaque ? 3 : 4;
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  const double base = std::clamp(background[3], 0.0, 1.0);
  Bytes flat(pixels * channels);
  for (std::size_t p = 0; p < pixels; ++p) {
    const float* in = image.rgba.data() + 4 * p;
    unsigned char* out = flat.data() + channels * p;
    const double through = (1.0 - static_cast<double>(in[3])) * base;
    const double alpha = static_cast<double>(in[3]) + through;
    for (std::size_t c = 0; c < 3; ++c) {
      const double premultiplied = static_cast<double>(in[c]) + through * background[c];
      out[c] = byteOf(opaque || alpha <= 0.0 ? premultiplied : premultiplied / alpha);
    }
    if (!opaque) out[3] = byteOf(alpha);
  }

  png_image header;
  std::memset(&header, 0, sizeof header);
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  Bytes bytes(size);
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, flat.data(), 0, nullptr) == 0) {
    throw Error(header.message);
  }
  bytes.resize(size);
  return bytes;
}

Image decodePng(const Bytes& bytes) {
  png_image header;
  std::memset(&header, 0, sizeof header);
  header.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&header, bytes.data(), bytes.size()) == 0) throw Error(header.message);
  header.format = PNG_FORMAT_RGBA;
  Bytes flat(PNG_IMAGE_SIZE(header));
  if (png_image_finish_read(&header, nullptr, flat.data(), 0, nullptr) == 0) throw Error(header.message);

  Image image(static_cast<int>(header.width), static_cast<int>(header.height));
  for (std::size_t p = 0; p < flat.size() / 4; ++p) {
    const double alpha = flat[4 * p + 3] / 255.0;
    for (std::size_t c = 0; c < 3; ++c)
      image.rgba[4 * p + c] = static_cast<float>(flat[4 * p + c] / 255.0 * alpha);
    image.rgba[4 * p + 3] = static_cast<float>(alpha);
  }
  return image;
}

}  // namespace spillikin::io
