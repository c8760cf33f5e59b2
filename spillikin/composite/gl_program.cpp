#include "spillikin/composite/gl_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "spillikin/base/error.h"

namespace spillikin::composite {

namespace {

constexpr GLsizei max_log = 1024;

std::string firstLine(const char* log) {
  const std::string text = log;
  return text.substr(0, text.find('\n'));
}

GLuint compile(const Gl& gl, GLenum stage, const std::string& source) {
  const GLuint shader = gl.CreateShader(stage);
  const char* text = source.c_str();
  gl.ShaderSource(shader, 1, &text, nullptr);
  gl.CompileShader(shader);
  GLint ok = GL_FALSE;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_FALSE) {
    std::array<char, max_log> log{};
    gl.GetShaderInfoLog(shader, max_log, nullptr, log.data());
    gl.DeleteShader(shader);
    throw Error(fmt::format("OpenGL: the driver refuses a shader: {}; use --backend native", firstLine(log.data())));
  }
  return shader;
}

// Makes the texture if need be and lets it read the buffer.
void attach(const Gl& gl, GLuint& texture, GLenum format, GLuint buffer) {
  if (texture == 0) {
    gl.GenTextures(1, &texture);
  }
  gl.BindTexture(GL_TEXTURE_BUFFER, texture);
  gl.TexBuffer(GL_TEXTURE_BUFFER, format, buffer);
}

}  // namespace

GLuint makeProgram(const Gl& gl, const std::string& vertex_source, const std::string& fragment_source) {
  const GLuint vertex = compile(gl, GL_VERTEX_SHADER, vertex_source);
  const GLuint fragment = compile(gl, GL_FRAGMENT_SHADER, fragment_source);
  const GLuint program = gl.CreateProgram();
  gl.AttachShader(program, vertex);
  gl.AttachShader(program, fragment);
  gl.LinkProgram(program);
  gl.DeleteShader(vertex);
  gl.DeleteShader(fragment);
  GLint ok = GL_FALSE;
  gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
  if (ok == GL_FALSE) {
    std::array<char, max_log> log{};
    gl.GetProgramInfoLog(program, max_log, nullptr, log.data());
    gl.DeleteProgram(program);
    throw Error(
        fmt::format("OpenGL: the driver cannot link a program: {}; use --backend native", firstLine(log.data())));
  }
  return program;
}

void GlBuffer::upload(const Gl& gl, GLenum target, const void* data, std::size_t bytes) {
  if (id_ == 0) {
    gl.GenBuffers(1, &id_);
  }
  gl.BindBuffer(target, id_);
  gl.BufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_DYNAMIC_DRAW);
}

void GlBuffer::destroy(const Gl& gl) {
  gl.DeleteBuffers(1, &id_);
  id_ = 0;
}

void GlTexels::upload(const Gl& gl, GLenum format, const void* data, std::size_t bytes) {
  buffer_.upload(gl, GL_TEXTURE_BUFFER, data, bytes);
  attach(gl, texture_, format, buffer_.id());
  check(gl, "sending a buffer");
}

void GlTexels::bind(const Gl& gl, unsigned unit) const {
  gl.ActiveTexture(GL_TEXTURE0 + unit);
  gl.BindTexture(GL_TEXTURE_BUFFER, texture_);
}

void GlTexels::destroy(const Gl& gl) {
  gl.DeleteTextures(1, &texture_);
  buffer_.destroy(gl);
  texture_ = 0;
}

void GlStream::reserve(const Gl& gl, GLenum format, std::size_t bytes) {
  if (bytes <= bytes_) {
    return;
  }
  destroy(gl);
  gl.GenBuffers(1, &id_);
  gl.BindBuffer(GL_TEXTURE_BUFFER, id_);
  constexpr GLbitfield access = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const auto size = static_cast<GLsizeiptr>(bytes);
  gl.BufferStorage(GL_TEXTURE_BUFFER, size, nullptr, access);
  data_ = gl.MapBufferRange(GL_TEXTURE_BUFFER, 0, size, access);
  attach(gl, texture_, format, id_);
  check(gl, "making a stream buffer");
  if (data_ == nullptr) {
    throw Error("OpenGL: a stream buffer cannot be mapped; use --backend native");
  }
  bytes_ = bytes;
}

void GlStream::bind(const Gl& gl, unsigned unit) const {
  gl.ActiveTexture(GL_TEXTURE0 + unit);
  gl.BindTexture(GL_TEXTURE_BUFFER, texture_);
}

void GlStream::destroy(const Gl& gl) {
  gl.DeleteTextures(1, &texture_);
  gl.DeleteBuffers(1, &id_);
  id_ = texture_ = 0;
  bytes_ = 0;
  data_ = nullptr;
}

void filterLinearly(const Gl& gl, GLenum target) {
  gl.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    gl.TexParameteri(target, axis, GL_CLAMP_TO_EDGE);
  }
}

void GlSampleCount::begin(const Gl& gl) {
  if (id_ == 0) {
    gl.GenQueries(1, &id_);
  }
  if (running_) {
    gl.EndQuery(GL_SAMPLES_PASSED);
  }
  gl.BeginQuery(GL_SAMPLES_PASSED, id_);
  running_ = true;
}

std::size_t GlSampleCount::end(const Gl& gl) {
  gl.EndQuery(GL_SAMPLES_PASSED);
  running_ = false;
  GLuint64 samples = 0;
  gl.GetQueryObjectui64v(id_, GL_QUERY_RESULT, &samples);
  return samples;
}

void GlSampleCount::destroy(const Gl& gl) {
  gl.DeleteQueries(1, &id_);
  id_ = 0;
}

}  // namespace spillikin::composite
