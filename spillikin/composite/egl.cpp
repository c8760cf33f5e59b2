// Surfaceless EGL: a GPU where there is one, Mesa's software rasterizer elsewhere. libEGL is opened by libepoxy when
// the first function is called, so that it need not be installed where it is not used.
#include <epoxy/egl.h>
#include <fmt/format.h>

#include <array>

#include "spillikin/base/error.h"
#include "spillikin/composite/backends.h"
#include "spillikin/composite/gl_compositor.h"
#include "spillikin/composite/gl_context.h"

namespace spillikin::composite {

namespace {

constexpr int max_devices = 16;

// The first device that can be initialised, in the driver's order (GPUs come before software); else Mesa's
// surfaceless platform, which needs no device at all.
EGLDisplay openDisplay() {
  if (!epoxy_has_egl()) {
    throw Error("EGL: libEGL.so.1 is not installed; install libegl1, or use --backend osmesa or native");
  }
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
      epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, max_devices> devices{};
    EGLint count = 0;
    eglQueryDevicesEXT(max_devices, devices.data(), &count);
    for (EGLint i = 0; i < count; ++i) {
      EGLDisplay display =
          eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr);
      if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) {
        return display;
      }
    }
  }
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
    EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) {
      return display;
    }
  }
  throw Error("EGL: no device and no surfaceless platform can be opened; use --backend osmesa or native");
}

class EglContext : public GlContext {
 public:
  EglContext() : display_(openDisplay()) {
    if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) {
      throw Error("EGL: the driver has no OpenGL, only OpenGL ES; use --backend osmesa or native");
    }
    constexpr std::array<EGLint, 3> config_attributes{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint configs = 0;
    if (eglChooseConfig(display_, config_attributes.data(), &config, 1, &configs) == EGL_FALSE || configs == 0) {
      config = nullptr;  // EGL_KHR_no_config_context; a driver without it refuses the context below
    }
    constexpr std::array<EGLint, 7> attributes{
        EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, attributes.data());
    if (context_ == EGL_NO_CONTEXT) {
      throw Error(fmt::format("EGL: no OpenGL 4.5 core context (error {:#06x}); use --backend osmesa or native",
                              eglGetError()));
    }
  }
  // The display stays open: it is one for the whole process, and others may be using it.
  ~EglContext() override { eglDestroyContext(display_, context_); }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  void makeCurrent() override {
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE) {
      throw Error(
          fmt::format("EGL: no surfaceless context (error {:#06x}); use --backend osmesa or native", eglGetError()));
    }
    if (gl_.Clear == nullptr) {
      gl_ = loadGl([](const char* name) { return reinterpret_cast<GlProc>(eglGetProcAddress(name)); });
    }
  }
  void release() noexcept override { eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }
  Backend backend() const override { return Backend::egl; }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

std::unique_ptr<Compositor> makeEgl() {
  return makeGlCompositor(std::make_unique<EglContext>());
}

}  // namespace spillikin::composite
