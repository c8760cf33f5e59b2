// An OpenGL 4.5 core context that draws into no window.
#pragma once

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/gl_api.h"

namespace spillikin::composite {

class GlContext {
 public:
  virtual ~GlContext() = default;
  // Of the calling thread, until release(). Throws Error.
  virtual void makeCurrent() = 0;
  virtual void release() noexcept = 0;
  virtual Backend backend() const = 0;
  // Filled by the first makeCurrent().
  const Gl& gl() const { return gl_; }

 protected:
  Gl gl_;
};

// Holds a context current for a scope, so that it may be used from whichever thread draws.
class CurrentContext {
 public:
  explicit CurrentContext(GlContext& context) : context_(context) { context_.makeCurrent(); }
  ~CurrentContext() { context_.release(); }
  CurrentContext(const CurrentContext&) = delete;
  CurrentContext& operator=(const CurrentContext&) = delete;

 private:
  GlContext& context_;
};

}  // namespace spillikin::composite
