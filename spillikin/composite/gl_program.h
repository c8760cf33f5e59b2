// Programs and buffers: the few objects that the compositor keeps in a context.
#pragma once

#include <cstddef>
#include <string>

#include "spillikin/composite/gl_api.h"

namespace spillikin::composite {

// Compiles and links. Throws Error with the driver's first line of complaint.
GLuint makeProgram(const Gl& gl, const std::string& vertex_source, const std::string& fragment_source);

// Of the texture bound to `target`: linear interpolation, the outermost texels beyond the ends.
void filterLinearly(const Gl& gl, GLenum target);

// A buffer that is replaced as a whole now and then.
class GlBuffer {
 public:
  void upload(const Gl& gl, GLenum target, const void* data, std::size_t bytes);
  void destroy(const Gl& gl);
  GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

// A buffer that shaders read as texels of one format.
class GlTexels {
 public:
  void upload(const Gl& gl, GLenum format, const void* data, std::size_t bytes);
  void bind(const Gl& gl, unsigned unit) const;
  void destroy(const Gl& gl);

 private:
  GlBuffer buffer_;
  GLuint texture_ = 0;
};

// The same for data that the CPU writes while the GPU may be reading another stream: mapped once, for good.
class GlStream {
 public:
  void reserve(const Gl& gl, GLenum format, std::size_t bytes);
  void bind(const Gl& gl, unsigned unit) const;
  void destroy(const Gl& gl);
  void* data() const { return data_; }

 private:
  GLuint id_ = 0, texture_ = 0;
  std::size_t bytes_ = 0;
  void* data_ = nullptr;
};

// The fragments that are not discarded between begin and end. A count that an error broke off is begun anew.
class GlSampleCount {
 public:
  void begin(const Gl& gl);
  std::size_t end(const Gl& gl);
  void destroy(const Gl& gl);

 private:
  GLuint id_ = 0;
  bool running_ = false;
};

}  // namespace spillikin::composite
