// The compositor that every OpenGL context shares.
#pragma once

#include <memory>

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/gl_context.h"

namespace spillikin::composite {

std::unique_ptr<Compositor> makeGlCompositor(std::unique_ptr<GlContext> context);

}  // namespace spillikin::composite
