// The OpenGL functions of one context, as a table.
//
// libepoxy dispatches to whatever GLX or EGL context is current and knows nothing of OSMesa; a table per context, with
// epoxy's types, serves both and lets two contexts live in one process.
#pragma once

#include <epoxy/gl.h>

#include <functional>

namespace spillikin::composite {

#define SPILLIKIN_GL_FUNCTIONS(F) \
  F(ActiveTexture)                \
  F(AttachShader)                 \
  F(BeginQuery)                   \
  F(BindBuffer)                   \
  F(BindBufferBase)               \
  F(BindFramebuffer)              \
  F(BindRenderbuffer)             \
  F(BindTexture)                  \
  F(BindVertexArray)              \
  F(BindVertexBuffer)             \
  F(BlendEquation)                \
  F(BlendFunc)                    \
  F(BufferData)                   \
  F(BufferStorage)                \
  F(CheckFramebufferStatus)       \
  F(Clear)                        \
  F(ClearColor)                   \
  F(ClientWaitSync)               \
  F(CompileShader)                \
  F(CreateProgram)                \
  F(CreateShader)                 \
  F(DeleteBuffers)                \
  F(DeleteFramebuffers)           \
  F(DeleteProgram)                \
  F(DeleteQueries)                \
  F(DeleteRenderbuffers)          \
  F(DeleteShader)                 \
  F(DeleteSync)                   \
  F(DeleteTextures)               \
  F(DeleteVertexArrays)           \
  F(Disable)                      \
  F(DrawArrays)                   \
  F(DrawElementsBaseVertex)       \
  F(Enable)                       \
  F(EnableVertexAttribArray)      \
  F(EndQuery)                     \
  F(FenceSync)                    \
  F(FramebufferRenderbuffer)      \
  F(GenBuffers)                   \
  F(GenFramebuffers)              \
  F(GenQueries)                   \
  F(GenRenderbuffers)             \
  F(GenTextures)                  \
  F(GenVertexArrays)              \
  F(GetError)                     \
  F(GetIntegerv)                  \
  F(GetProgramInfoLog)            \
  F(GetProgramiv)                 \
  F(GetQueryObjectui64v)          \
  F(GetShaderInfoLog)             \
  F(GetShaderiv)                  \
  F(LinkProgram)                  \
  F(MapBufferRange)               \
  F(PixelStorei)                  \
  F(ReadPixels)                   \
  F(RenderbufferStorage)          \
  F(ShaderSource)                 \
  F(TexBuffer)                    \
  F(TexImage2D)                   \
  F(TexImage3D)                   \
  F(TexParameteri)                \
  F(UseProgram)                   \
  F(VertexAttribBinding)          \
  F(VertexAttribFormat)           \
  F(Viewport)

struct Gl {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration takes none
#define SPILLIKIN_GL_MEMBER(name) decltype(epoxy_gl##name) name = nullptr;
  SPILLIKIN_GL_FUNCTIONS(SPILLIKIN_GL_MEMBER)
#undef SPILLIKIN_GL_MEMBER
};

using GlProc = void (*)();

// Fills the table; the context must be current. Throws Error that names the first function that is missing.
Gl loadGl(const std::function<GlProc(const char*)>& address);

// Throws Error with the OpenGL error that stands, if one does; `doing` says what was being done.
void check(const Gl& gl, const char* doing);

}  // namespace spillikin::composite
