#include "spillikin/composite/gl_target.h"

#include <fmt/format.h>

#include <algorithm>

#include "spillikin/base/error.h"

namespace spillikin::composite {

std::vector<Tile> GlTarget::tiles(const Gl& gl, int width, int height) {
  GLint limit = 0;
  gl.GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &limit);
  const int side = std::min<int>(limit, max_tile);
  const int w = std::min(side, width);
  const int h = std::min(side, height);
  if (w > width_ || h > height_) {
    destroy(gl);
    gl.GenRenderbuffers(1, &color_);
    gl.BindRenderbuffer(GL_RENDERBUFFER, color_);
    gl.RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA32F, w, h);
    gl.GenFramebuffers(1, &framebuffer_);
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color_);
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw Error(fmt::format("OpenGL: no float framebuffer of {}x{} pixels; use --backend native", w, h));
    }
    check(gl, "making the framebuffer");
    width_ = w;
    height_ = h;
  }
  std::vector<Tile> out;
  for (int y = 0; y < height; y += h) {
    for (int x = 0; x < width; x += w) {
      out.push_back({x, y, std::min(w, width - x), std::min(h, height - y)});
    }
  }
  return out;
}

void GlTarget::begin(const Gl& gl, const Tile& tile) const {
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  gl.Viewport(0, 0, tile.width, tile.height);
  gl.ClearColor(0.0F, 0.0F, 0.0F, 0.0F);
  gl.Clear(GL_COLOR_BUFFER_BIT);
}

void GlTarget::read(const Gl& gl, const Tile& tile, Image& image) const {
  gl.PixelStorei(GL_PACK_ROW_LENGTH, image.width);
  gl.ReadPixels(0, 0, tile.width, tile.height, GL_RGBA, GL_FLOAT, image.pixel(tile.x, tile.y));
}

void GlTarget::destroy(const Gl& gl) {
  gl.DeleteFramebuffers(1, &framebuffer_);
  gl.DeleteRenderbuffers(1, &color_);
  framebuffer_ = color_ = 0;
  width_ = height_ = 0;
}

}  // namespace spillikin::composite
