#include "spillikin/composite/gl_cell_drawer.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "spillikin/base/error.h"
#include "spillikin/composite/gl_clock.h"

namespace spillikin::composite {

namespace {

using mesh::Id;

constexpr GLuint64 fence_wait = 1'000'000'000;  // nanoseconds between looks at a fence

// What a fragment does with its segment. On a field that is constant in each cell all ways agree.
SegmentShader segmentShader(const Frame& frame) {
  if (cellField(frame)) {
    return frame.peaks ? SegmentShader::constant_peak : SegmentShader::constant;
  }
  if (frame.peaks) {
    return SegmentShader::peak;
  }
  switch (frame.integration) {
    case Integration::average:
      return SegmentShader::average;
    case Integration::preintegrated:
      return SegmentShader::preintegrated;
    case Integration::exact:
    case Integration::vertex:
      break;
  }
  return SegmentShader::exact;
}

}  // namespace

GlCellDrawer::GlCellDrawer(const Gl& gl) : gl_(gl) {
  // Two triangles for each cell's cover; its corners are found by the number of the vertex.
  std::vector<std::uint32_t> indices;
  indices.reserve(6 * chunk_cells);
  for (std::uint32_t cell = 0; cell < chunk_cells; ++cell) {
    for (const std::uint32_t corner : {0U, 1U, 2U, 0U, 2U, 3U}) {
      indices.push_back(4 * cell + corner);
    }
  }
  gl_.GenVertexArrays(1, &vertex_array_);
  gl_.BindVertexArray(vertex_array_);
  index_.upload(gl_, GL_ELEMENT_ARRAY_BUFFER, indices.data(), indices.size() * sizeof(std::uint32_t));
}

void GlCellDrawer::destroy() {
  for (Stream& stream : streams_) {
    wait(stream);
    stream.cells.destroy(gl_);
    stream.vertices.destroy(gl_);
    stream.triangles.destroy(gl_);
  }
  for (const Program& made : programs_) {
    gl_.DeleteProgram(made.id);
  }
  index_.destroy(gl_);
  plane_buffer_.destroy(gl_);
  gl_.DeleteVertexArrays(1, &vertex_array_);
}

void GlCellDrawer::prepare(const Frame& frame, const FrameMap& map, const GlLook& look, bool changed) {
  if (changed || !topology_) {
    prepareMesh(frame.mesh);
  }
  preparePlanes(frame, map);
  projectVertices(frame.mesh, map, look.scalar(), screen_);
  const SegmentShader segment = segmentShader(frame);
  const double deepest = look.max_extinction() * topology_->longest_chord() / map.unit();
  shader_ = {topology_->shape(), segment == SegmentShader::exact && deepest < thin_depth, segment};
  program(shader_);
}

void GlCellDrawer::prepareMesh(const mesh::Mesh& mesh) {
  topology_.reset();
  topology_.emplace(mesh);
  GLint texels = 0;
  gl_.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
  capacity_ = batchCapacity(*topology_, static_cast<std::size_t>(texels));
  for (Stream& stream : streams_) {
    wait(stream);
    stream.cells.reserve(gl_, GL_RGBA32UI, capacity_.cells * sizeof(CellRecord));
    stream.vertices.reserve(gl_, GL_RGBA32F, capacity_.vertices * sizeof(ScreenVertex));
    stream.triangles.reserve(gl_, GL_R32UI, std::max<std::size_t>(1, capacity_.triangles) * sizeof(std::uint32_t));
  }
}

// The view's clip planes, then those of each cut.
void GlCellDrawer::preparePlanes(const Frame& frame, const FrameMap& map) {
  planes_.clear();
  cut_planes_.clear();
  for (const ClipPlane& clip : frame.camera.view().clips) {
    planes_.push_back(map.plane({clip.normal, -glm::dot(clip.normal, clip.point)}));
  }
  for (std::size_t i = 0; i < frame.order.cuts.size(); ++i) {
    const sort::Cut cut = frame.order.cuts[i];
    if (cut.keep.size() > max_planes_of_cell) {
      throw Error(fmt::format(
          "{}: cell {} was cut {} times, more than the {} that the OpenGL backends number; use "
          "--backend native",
          frame.mesh.name, frame.mesh.cell_file_id[frame.order.cells[cut.entry]], cut.keep.size(), max_planes_of_cell));
    }
    cut_planes_.push_back(static_cast<std::uint32_t>(planes_.size() << 8U | cut.keep.size()));
    for (const sort::HalfSpace& keep : cut.keep) {
      planes_.push_back(map.plane(keep));
    }
  }
  const ScreenPlane nothing;
  const bool empty = planes_.empty();
  plane_buffer_.upload(gl_, GL_RGBA32F, empty ? &nothing : planes_.data(),
                       (empty ? 1 : planes_.size()) * sizeof(ScreenPlane));
}

void GlCellDrawer::draw(const Frame& frame, const FrameMap& map, const GlLook& look, const Window& window,
                        FrameStats& stats) {
  gl_.BindVertexArray(vertex_array_);
  gl_.Enable(GL_CULL_FACE);  // a cover's triangle that snapping has turned over must not cover a pixel twice
  gl_.UseProgram(program(shader_));
  look.bind(gl_);
  std::size_t turn = 0;
  for (std::size_t entry = 0; entry < frame.order.cells.size(); ++turn) {
    Stream& stream = streams_[turn % streams];
    wait(stream);
    const auto start = Clock::now();
    entry = planBatch(*topology_, frame.order.cells, entry, capacity_, chunks_);
    tbb::parallel_for(std::size_t{0}, chunks_.size(),
                      [&](std::size_t i) { fill(frame, map, look, window, stream, chunks_[i]); });
    stats.project_seconds += secondsSince(start);
    bind(stream);
    for (const Chunk& chunk : chunks_) {
      gl_.DrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(6 * chunk.kept), GL_UNSIGNED_INT, nullptr,
                                 static_cast<GLint>(4 * chunk.record));
      stats.polygons += chunk.kept;
    }
    stream.fence = gl_.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  }
}

void GlCellDrawer::bind(const Stream& stream) const {
  stream.cells.bind(gl_, gl_binding::cells);
  stream.vertices.bind(gl_, gl_binding::vertices);
  stream.triangles.bind(gl_, gl_binding::triangles);
  plane_buffer_.bind(gl_, gl_binding::planes);
}

// The records, vertices and triangles of one chunk: of the cells that are drawn and not off the window.
void GlCellDrawer::fill(const Frame& frame, const FrameMap& map, const GlLook& look, const Window& window,
                        Stream& stream, Chunk& chunk) const {
  CellRecord* record = static_cast<CellRecord*>(stream.cells.data()) + chunk.record;
  auto* const vertices = static_cast<ScreenVertex*>(stream.vertices.data());
  auto* const triangles = static_cast<std::uint32_t*>(stream.triangles.data());
  const sort::Cuts& cuts = frame.order.cuts;
  std::size_t cut = cuts.first(chunk.first);
  std::size_t vertex = chunk.vertex;
  std::size_t triangle = chunk.triangle;
  CoverScratch scratch;
  std::vector<ScreenVertex> corners;
  for (std::size_t entry = chunk.first; entry < chunk.end; ++entry) {
    const Id cell = frame.order.cells[entry];
    while (cut < cuts.size() && cuts[cut].entry < entry) {
      ++cut;
    }
    corners.clear();
    for (const Id v : topology_->vertices(cell)) {
      corners.push_back(screen_[v]);
    }
    CellRecord made;
    if (!frame.draws(cell) || !cover(corners, map, window, scratch, made.cover)) {
      continue;
    }
    const std::span<const std::uint32_t> faces = topology_->triangles(cell);
    const std::size_t second = topology_->shape() == CellShape::hexahedra ? topology_->diagonals(cell) : triangle;
    const bool is_cut = cut < cuts.size() && cuts[cut].entry == entry;
    made.paint = look.paint(cell);
    made.at = {static_cast<std::uint32_t>(vertex), static_cast<std::uint32_t>(second),
               static_cast<std::uint32_t>(faces.size()), is_cut ? cut_planes_[cut] : 0};
    *record++ = made;
    std::copy(corners.begin(), corners.end(), vertices + vertex);
    std::copy(faces.begin(), faces.end(), triangles + triangle);
    vertex += corners.size();
    triangle += faces.size();
    ++chunk.kept;
  }
}

void GlCellDrawer::wait(Stream& stream) const {
  if (stream.fence == nullptr) {
    return;
  }
  while (gl_.ClientWaitSync(stream.fence, GL_SYNC_FLUSH_COMMANDS_BIT, fence_wait) == GL_TIMEOUT_EXPIRED) {
  }
  gl_.DeleteSync(stream.fence);
  stream.fence = nullptr;
}

GLuint GlCellDrawer::program(const CellShader& shader) {
  for (const Program& made : programs_) {
    if (made.shader == shader) {
      return made.id;
    }
  }
  programs_.push_back({shader, makeProgram(gl_, cellVertexShader(shader), cellFragmentShader(shader))});
  return programs_.back().id;
}

}  // namespace spillikin::composite
