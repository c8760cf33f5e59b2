#include "spillikin/composite/gl_api.h"

#include <fmt/format.h>

#include "spillikin/base/error.h"

namespace spillikin::composite {

Gl loadGl(const std::function<GlProc(const char*)>& address) {
  Gl gl;
#define SPILLIKIN_GL_LOAD(name)                                                                               \
  gl.name = reinterpret_cast<decltype(gl.name)>(address("gl" #name));                                         \
  if (gl.name == nullptr) {                                                                                   \
    throw Error("OpenGL: the driver has no gl" #name "; OpenGL 4.5 is needed, use another backend (native)"); \
  }
  SPILLIKIN_GL_FUNCTIONS(SPILLIKIN_GL_LOAD)
#undef SPILLIKIN_GL_LOAD
  return gl;
}

void check(const Gl& gl, const char* doing) {
  const GLenum error = gl.GetError();
  if (error == GL_NO_ERROR) {
    return;
  }
  if (error == GL_OUT_OF_MEMORY) {
    throw Error(fmt::format("OpenGL: out of memory while {}; give a smaller image or use the native backend", doing));
  }
  throw Error(fmt::format("OpenGL: error {:#06x} while {}; use the native backend", error, doing));
}

}  // namespace spillikin::composite
