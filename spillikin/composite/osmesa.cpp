// OSMesa: Mesa's software rasterizer in this process, without a display.
#include <epoxy/gl.h>
// epoxy first: it stands in for GL/gl.h, which OSMesa's header asks for.
#include <GL/osmesa.h>

#include <array>

#include "spillikin/base/error.h"
#include "spillikin/composite/backends.h"
#include "spillikin/composite/gl_compositor.h"
#include "spillikin/composite/gl_context.h"

namespace spillikin::composite {

namespace {

class OsmesaContext : public GlContext {
 public:
  OsmesaContext() {
    constexpr std::array<int, 13> attributes{OSMESA_FORMAT,
                                             OSMESA_RGBA,
                                             OSMESA_DEPTH_BITS,
                                             0,
                                             OSMESA_STENCIL_BITS,
                                             0,
                                             OSMESA_PROFILE,
                                             OSMESA_CORE_PROFILE,
                                             OSMESA_CONTEXT_MAJOR_VERSION,
                                             4,
                                             OSMESA_CONTEXT_MINOR_VERSION,
                                             5,
                                             0};
    context_ = OSMesaCreateContextAttribs(attributes.data(), nullptr);
    if (context_ == nullptr) {
      throw Error(
          "OSMesa: no OpenGL 4.5 core context; install libosmesa6 of Mesa 20 or later, or use --backend native");
    }
  }
  ~OsmesaContext() override { OSMesaDestroyContext(context_); }
  OsmesaContext(const OsmesaContext&) = delete;
  OsmesaContext& operator=(const OsmesaContext&) = delete;

  void makeCurrent() override {
    if (OSMesaMakeCurrent(context_, pixel_.data(), GL_UNSIGNED_BYTE, 1, 1) == GL_FALSE) {
      throw Error("OSMesa: the context cannot be made current; use --backend native");
    }
    if (gl_.Clear == nullptr) {
      gl_ = loadGl([](const char* name) { return OSMesaGetProcAddress(name); });
    }
  }
  void release() noexcept override { OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0); }
  Backend backend() const override { return Backend::osmesa; }

 private:
  OSMesaContext context_ = nullptr;
  std::array<unsigned char, 4> pixel_{};  // OSMesa wants a default framebuffer; everything is drawn into another
};

}  // namespace

std::unique_ptr<Compositor> makeOsmesa() {
  return makeGlCompositor(std::make_unique<OsmesaContext>());
}

}  // namespace spillikin::composite
