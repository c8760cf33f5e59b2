// A picture in memory.
#pragma once

#include <cstddef>
#include <vector>

namespace spillikin {

// Premultiplied float RGBA, row-major, row 0 at the top; pixel (i, j) is column i of row j and is sampled at its centre
// (i + 1/2, j + 1/2). Nothing behind the volume is in it: the background is composited when the image is written.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<float> rgba;  // width * height * 4 values

  Image() = default;
  Image(int w, int h)
      : width(w), height(h), rgba(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 4, 0.0F) {}

  float* pixel(int x, int y) {
    return rgba.data() +
           4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  }
  const float* pixel(int x, int y) const {
    return rgba.data() +
           4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  }
};

}  // namespace spillikin
