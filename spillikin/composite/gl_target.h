// The float framebuffer that a frame is drawn into, in tiles when the image is larger than the device's.
#pragma once

#include <vector>

#include "spillikin/base/image.h"
#include "spillikin/composite/gl_api.h"

namespace spillikin::composite {

// A rectangle of the image, in pixels from the top left corner.
struct Tile {
  int x = 0, y = 0, width = 0, height = 0;
};

inline constexpr int max_tile = 4096;  // 256 MiB of float RGBA

class GlTarget {
 public:
  // The tiles of an image; makes the framebuffer large enough for each. Throws Error when the device cannot.
  std::vector<Tile> tiles(const Gl& gl, int width, int height);
  // Clears and binds the framebuffer for a tile.
  void begin(const Gl& gl, const Tile& tile) const;
  // Waits for what was drawn and copies it into its place in the image.
  void read(const Gl& gl, const Tile& tile, Image& image) const;
  void destroy(const Gl& gl);

 private:
  GLuint framebuffer_ = 0, color_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace spillikin::composite
