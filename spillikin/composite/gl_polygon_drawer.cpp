#include "spillikin/composite/gl_polygon_drawer.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

#include "spillikin/composite/gl_clock.h"
#include "spillikin/composite/gl_shaders.h"
#include "spillikin/integrate/preintegrated.h"
#include "spillikin/project/cell_projection.h"

namespace spillikin::composite {

namespace {

// Attributes of a PolygonVertex: location, floats, byte offset.
struct Attribute {
  GLuint index;
  GLint size;
  GLuint offset;
};
constexpr std::array<Attribute, 3> attributes{
    {{0, 2, offsetof(PolygonVertex, x)}, {1, 2, offsetof(PolygonVertex, u)}, {2, 3, offsetof(PolygonVertex, r)}}};

GLuint opacityTexture(const Gl& gl) {
  const std::vector<float> texels = integrate::opacityTexture(opacity_size, opacity_range);
  GLuint texture = 0;
  gl.GenTextures(1, &texture);
  gl.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl.BindTexture(GL_TEXTURE_2D, texture);
  gl.TexImage2D(GL_TEXTURE_2D, 0, GL_R32F, opacity_size, opacity_size, 0, GL_RED, GL_FLOAT, texels.data());
  filterLinearly(gl, GL_TEXTURE_2D);
  check(gl, "sending the opacity texture");
  return texture;
}

// One thread's.
struct Worker {
  project::CellProjector projector;
  project::Regions regions;
};

}  // namespace

GlPolygonDrawer::GlPolygonDrawer(const Gl& gl) : gl_(gl) {
  gl_.GenVertexArrays(1, &vertex_array_);
  gl_.BindVertexArray(vertex_array_);
  for (const Attribute& attribute : attributes) {
    gl_.EnableVertexAttribArray(attribute.index);
    gl_.VertexAttribFormat(attribute.index, attribute.size, GL_FLOAT, GL_FALSE, attribute.offset);
    gl_.VertexAttribBinding(attribute.index, 0);
  }
}

void GlPolygonDrawer::destroy() {
  buffer_.destroy(gl_);
  gl_.DeleteTextures(1, &opacity_);
  gl_.DeleteProgram(program_);
  gl_.DeleteVertexArrays(1, &vertex_array_);
}

void GlPolygonDrawer::prepare(const Frame& frame) {
  if (program_ == 0) {
    program_ = makeProgram(gl_, polygonVertexShader(), polygonFragmentShader());
    opacity_ = opacityTexture(gl_);
  }
  project::screenPoints(frame.mesh, frame.camera, screen_);
}

void GlPolygonDrawer::draw(const Frame& frame, const FrameMap& map, FrameStats& stats) {
  gl_.UseProgram(program_);
  gl_.Disable(GL_CULL_FACE);
  gl_.BindVertexArray(vertex_array_);
  gl_.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl_.BindTexture(GL_TEXTURE_2D, opacity_);
  tbb::enumerable_thread_specific<Worker> workers([&] {
    return Worker{{frame.mesh, frame.camera, screen_, project::Faces::planar}, {}};
  });
  const std::size_t cells = frame.order.cells.size();
  std::array<std::size_t, batch_chunks> polygons{};
  for (std::size_t first = 0; first < cells; first += batch_chunks * chunk_cells) {
    const auto start = Clock::now();
    tbb::parallel_for(std::size_t{0}, batch_chunks, [&](std::size_t i) {
      Worker& worker = workers.local();
      const std::size_t begin = std::min(cells, first + i * chunk_cells);
      corners_[i].clear();
      polygons[i] = appendPolygons(frame, map, begin, std::min(cells, begin + chunk_cells), worker.projector,
                                   worker.regions, corners_[i]);
    });
    stats.project_seconds += secondsSince(start);
    for (std::size_t i = 0; i < batch_chunks; ++i) {
      stats.polygons += polygons[i];
      drawChunk(corners_[i]);
    }
  }
}

void GlPolygonDrawer::drawChunk(const std::vector<PolygonVertex>& corners) {
  if (corners.empty()) {
    return;
  }
  buffer_.upload(gl_, GL_ARRAY_BUFFER, corners.data(), corners.size() * sizeof(PolygonVertex));
  gl_.BindVertexBuffer(0, buffer_.id(), 0, sizeof(PolygonVertex));
  gl_.DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(corners.size()));
}

}  // namespace spillikin::composite
