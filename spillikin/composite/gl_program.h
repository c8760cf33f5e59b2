// Programs and buffers: the few objects that the compositor keeps in a context.
#pragma once

#include <cstddef>
#include <string>

#include "spillikin/composite/gl_api.h"

namespace spillikin::composite {

// Compiles and links. Throws Error with the driver's first line of complaint.
GLuint makeProgram(const Gl& gl, const std::string& vertex_source, const std::string& fragment_source);

// A storage or uniform buffer that is replaced as a whole now and then.
class GlBuffer {
 public:
  void upload(const Gl& gl, GLenum target, const void* data, std::size_t bytes);
  void destroy(const Gl& gl);
  GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

// A storage buffer that the CPU writes while the GPU may be reading another: mapped once, for good.
class GlStream {
 public:
  void reserve(const Gl& gl, std::size_t bytes);
  void destroy(const Gl& gl);
  void bind(const Gl& gl, unsigned binding) const;
  void* data() const { return data_; }

 private:
  GLuint id_ = 0;
  std::size_t bytes_ = 0;
  void* data_ = nullptr;
};

}  // namespace spillikin::composite
