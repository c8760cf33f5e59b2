#include "spillikin/composite/gl_compositor.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <glm/geometric.hpp>
#include <optional>

#include "spillikin/base/error.h"
#include "spillikin/composite/gl_cells.h"
#include "spillikin/composite/gl_frame.h"
#include "spillikin/composite/gl_polygons.h"
#include "spillikin/composite/gl_program.h"
#include "spillikin/composite/gl_shaders.h"
#include "spillikin/composite/gl_target.h"
#include "spillikin/composite/gl_transfer.h"
#include "spillikin/integrate/preintegrated.h"
#include "spillikin/project/cell_projection.h"

namespace spillikin::composite {

namespace {

using mesh::Id;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr std::size_t grain = 8192;             // vertices or cells per task
constexpr std::size_t polygon_chunks = 16;      // of chunk_cells in a batch of polygons
constexpr std::size_t streams = 3;              // batches in flight
constexpr GLuint64 fence_wait = 1'000'000'000;  // nanoseconds between looks at a fence

// The shaders' uniform block View.
struct ViewBlock {
  std::array<float, 4> pixel{}, lens{}, window{};
  std::array<std::int32_t, 4> counts{};
};

// The buffers of one batch.
struct Stream {
  GlStream cells, vertices, triangles;
  GLsync fence = nullptr;
};

static_assert(sizeof(TransferPiece) % sizeof(std::array<float, 4>) == 0);
constexpr std::size_t texels_per_piece = sizeof(TransferPiece) / sizeof(std::array<float, 4>);

struct Program {
  CellShader shader;
  GLuint id = 0;
};

class GlCompositor : public Compositor {
 public:
  explicit GlCompositor(std::unique_ptr<GlContext> context);
  ~GlCompositor() override;
  GlCompositor(const GlCompositor&) = delete;
  GlCompositor& operator=(const GlCompositor&) = delete;

  FrameStats draw(const Frame& frame, Image& image) override;
  Backend backend() const override { return context_->backend(); }

 private:
  void prepareMesh(const Frame& frame);
  void prepareField(const Frame& frame);
  void preparePaint(const Frame& frame);
  void prepareTransfer(const Frame& frame, const FrameMap& map);
  void prepareTable(const Frame& frame);
  void prepareOpacity();
  void preparePlanes(const Frame& frame, const FrameMap& map);
  void uploadView(const Frame& frame, const FrameMap& map, const Tile& tile);
  void drawTile(const Frame& frame, const FrameMap& map, const Tile& tile, FrameStats& stats);
  void drawCells(const Frame& frame, const FrameMap& map, const Window& window, FrameStats& stats);
  void drawPolygons(const Frame& frame, const FrameMap& map, FrameStats& stats);
  void fill(const Frame& frame, const FrameMap& map, const Window& window, Stream& stream, Chunk& chunk) const;
  void wait(Stream& stream) const;
  bool thin(const FrameMap& map) const;
  GLuint program(const CellShader& shader);

  std::unique_ptr<GlContext> context_;
  const Gl& gl_;
  GlTarget target_;
  GLuint vertex_array_ = 0, polygon_array_ = 0, samples_ = 0;
  GLuint polygon_program_ = 0;
  GlBuffer index_, view_;
  GlTexels transfer_buffer_, plane_buffer_;
  std::array<Stream, streams> streams_;
  std::vector<Program> programs_;

  // Kept from frame to frame.
  Bounds bounds_;
  std::optional<CellTopology> topology_;
  BatchCapacity capacity_;
  ScalarMap scalar_map_;
  std::vector<float> scalar_;                // per vertex
  std::vector<std::array<float, 4>> paint_;  // per cell, of a cell field
  double paint_unit_ = 0.0;
  std::int32_t pieces_ = 0;  // 0: not those of this field
  double pieces_unit_ = 0.0;
  double max_extinction_ = 0.0;     // of the pieces
  GLuint table_ = 0, opacity_ = 0;  // textures
  bool table_fits_ = false;         // was made of the field and transfer function at hand

  // Reused from frame to frame.
  std::vector<ScreenVertex> screen_;
  std::vector<ScreenPlane> planes_;
  std::vector<std::uint32_t> cut_planes_;  // per cut of the order, its planes (first << 8 | count)
  std::vector<Chunk> chunks_;
  std::vector<Vec3> screen_points_;
  std::array<std::vector<PolygonVertex>, polygon_chunks> polygons_;
  GlBuffer polygon_buffer_;
};

bool cellField(const Frame& frame) {
  return frame.field.association == mesh::Association::cells;
}

// What a fragment does with its segment. On a field that is constant in each cell all ways agree.
SegmentShader segmentShader(const Frame& frame) {
  if (cellField(frame)) {
    return SegmentShader::constant;
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

// Attributes of a PolygonVertex: location, floats, byte offset.
struct Attribute {
  GLuint index;
  GLint size;
  std::size_t offset;
};
constexpr std::array<Attribute, 3> polygon_attributes{
    {{0, 2, offsetof(PolygonVertex, x)}, {1, 2, offsetof(PolygonVertex, u)}, {2, 3, offsetof(PolygonVertex, r)}}};

void filterLinearly(const Gl& gl, GLenum target) {
  gl.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    gl.TexParameteri(target, axis, GL_CLAMP_TO_EDGE);
  }
}

GlCompositor::GlCompositor(std::unique_ptr<GlContext> context) : context_(std::move(context)), gl_(context_->gl()) {
  const CurrentContext current(*context_);
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
  gl_.GenVertexArrays(1, &polygon_array_);
  gl_.BindVertexArray(polygon_array_);
  for (const Attribute& attribute : polygon_attributes) {
    gl_.EnableVertexAttribArray(attribute.index);
  }
  gl_.GenQueries(1, &samples_);
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  check(gl_, "preparing the context");
}

GlCompositor::~GlCompositor() {
  try {
    const CurrentContext current(*context_);
    for (Stream& stream : streams_) {
      if (stream.fence != nullptr) {
        gl_.DeleteSync(stream.fence);
      }
      stream.cells.destroy(gl_);
      stream.vertices.destroy(gl_);
      stream.triangles.destroy(gl_);
    }
    for (const Program& made : programs_) {
      gl_.DeleteProgram(made.id);
    }
    index_.destroy(gl_);
    view_.destroy(gl_);
    transfer_buffer_.destroy(gl_);
    plane_buffer_.destroy(gl_);
    target_.destroy(gl_);
    gl_.DeleteQueries(1, &samples_);
    gl_.DeleteVertexArrays(1, &vertex_array_);
    gl_.DeleteVertexArrays(1, &polygon_array_);
    gl_.DeleteProgram(polygon_program_);
    gl_.DeleteTextures(1, &table_);
    gl_.DeleteTextures(1, &opacity_);
    polygon_buffer_.destroy(gl_);
  } catch (const Error&) {
    // A context that cannot be made current any more takes its objects with it.
  }
}

FrameStats GlCompositor::draw(const Frame& frame, Image& image) {
  const auto start = Clock::now();
  const CurrentContext current(*context_);
  FrameStats stats;
  prepareMesh(frame);
  prepareField(frame);
  const FrameMap map(frame.camera, bounds_);
  if (frame.integration == Integration::vertex) {
    prepareOpacity();
    project::screenPoints(frame.mesh, frame.camera, screen_points_);
  } else {
    prepareTransfer(frame, map);
    preparePlanes(frame, map);
    projectVertices(frame.mesh, map, scalar_, screen_);
  }
  stats.project_seconds = secondsSince(start);

  image.width = frame.camera.width();
  image.height = frame.camera.height();
  image.rgba.resize(4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  gl_.BeginQuery(GL_SAMPLES_PASSED, samples_);
  for (const Tile& tile : target_.tiles(gl_, image.width, image.height)) {
    drawTile(frame, map, tile, stats);
    target_.read(gl_, tile, image);
  }
  gl_.EndQuery(GL_SAMPLES_PASSED);
  GLuint64 samples = 0;
  gl_.GetQueryObjectui64v(samples_, GL_QUERY_RESULT, &samples);
  stats.fragments = samples;
  check(gl_, "drawing");
  stats.composite_seconds = secondsSince(start) - stats.project_seconds;
  return stats;
}

void GlCompositor::prepareMesh(const Frame& frame) {
  if (frame.same_mesh && topology_) {
    return;
  }
  topology_.reset();
  topology_.emplace(frame.mesh);
  bounds_ = bounds(frame.mesh);
  capacity_ = batchCapacity(*topology_);
  scalar_.clear();
  paint_.clear();
  for (Stream& stream : streams_) {
    wait(stream);
    stream.cells.reserve(gl_, GL_RGBA32UI, capacity_.cells * sizeof(CellRecord));
    stream.vertices.reserve(gl_, GL_RGBA32F, capacity_.vertices * sizeof(ScreenVertex));
    stream.triangles.reserve(gl_, GL_R32UI, std::max<std::size_t>(1, capacity_.triangles) * sizeof(std::uint32_t));
  }
}

void GlCompositor::prepareField(const Frame& frame) {
  const bool kept = frame.same_mesh && frame.same_field;
  if (cellField(frame)) {
    scalar_.clear();
    if (!kept) {
      paint_.clear();
    }
    return;
  }
  paint_.clear();
  if (kept && scalar_.size() == frame.field.values.size()) {
    return;
  }
  scalar_map_ = {frame.field.lo, frame.field.hi};
  pieces_ = 0;
  scalar_.resize(frame.field.values.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, scalar_.size(), grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        scalar_[i] = scalar_map_(frame.field.values[i]);
                      }
                    });
}

// Colour and extinction of constant cells, in double precision.
void GlCompositor::preparePaint(const Frame& frame) {
  paint_.resize(frame.field.values.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, paint_.size(), grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        const integrate::Optical o = frame.transfer_function(frame.field.values[i]);
                        paint_[i] = {static_cast<float>(o.color[0]), static_cast<float>(o.color[1]),
                                     static_cast<float>(o.color[2]), static_cast<float>(o.extinction * paint_unit_)};
                      }
                    });
}

void GlCompositor::prepareTransfer(const Frame& frame, const FrameMap& map) {
  if (cellField(frame)) {
    if (!frame.same_transfer_function || paint_.empty() || paint_unit_ != map.unit()) {
      paint_unit_ = map.unit();
      preparePaint(frame);
    }
    return;
  }
  if (!(frame.same_transfer_function && frame.same_field && frame.same_mesh)) {
    table_fits_ = false;
  }
  if (frame.integration == Integration::preintegrated) {
    prepareTable(frame);
    return;
  }
  if (frame.same_transfer_function && pieces_ > 0 && pieces_unit_ == map.unit()) {
    return;
  }
  const std::vector<TransferPiece> pieces = transferPieces(frame.transfer_function, scalar_map_, map.unit());
  std::vector<std::array<float, 4>> texels = searchStarts(pieces, transfer_bins);
  const auto* const first = reinterpret_cast<const std::array<float, 4>*>(pieces.data());
  texels.insert(texels.begin(), first, first + texels_per_piece * pieces.size());
  transfer_buffer_.upload(gl_, GL_RGBA32F, texels.data(), texels.size() * sizeof(texels[0]));
  max_extinction_ = 0.0;
  for (const TransferPiece& piece : pieces) {
    max_extinction_ = std::max<double>(max_extinction_, std::max(piece.low[3], piece.low[3] + piece.rise[3]));
  }
  pieces_ = static_cast<std::int32_t>(pieces.size());
  pieces_unit_ = map.unit();
}

void GlCompositor::prepareTable(const Frame& frame) {
  if (table_fits_) {
    return;
  }
  const integrate::Preintegrated table(frame.transfer_function, frame.field.lo, frame.field.hi);
  if (table_ == 0) {
    gl_.GenTextures(1, &table_);
  }
  const auto n = static_cast<GLsizei>(table.n());
  gl_.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl_.BindTexture(GL_TEXTURE_3D, table_);
  gl_.TexImage3D(GL_TEXTURE_3D, 0, GL_RGBA32F, n, n, static_cast<GLsizei>(table.layers()), 0, GL_RGBA, GL_FLOAT,
                 table.texels().data());
  filterLinearly(gl_, GL_TEXTURE_3D);
  check(gl_, "sending the pre-integrated table");
  table_fits_ = true;
}

void GlCompositor::prepareOpacity() {
  if (opacity_ != 0) {
    return;
  }
  const std::vector<float> texels = integrate::opacityTexture(opacity_size, opacity_range);
  gl_.GenTextures(1, &opacity_);
  gl_.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl_.BindTexture(GL_TEXTURE_2D, opacity_);
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_R32F, opacity_size, opacity_size, 0, GL_RED, GL_FLOAT, texels.data());
  filterLinearly(gl_, GL_TEXTURE_2D);
  check(gl_, "sending the opacity texture");
}

void GlCompositor::preparePlanes(const Frame& frame, const FrameMap& map) {
  planes_.clear();
  cut_planes_.clear();
  for (const ClipPlane& clip : frame.camera.view().clips) {
    planes_.push_back(map.plane({clip.normal, -glm::dot(clip.normal, clip.point)}));
  }
  for (const sort::Cut& cut : frame.order.cuts) {
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

void GlCompositor::uploadView(const Frame& frame, const FrameMap& map, const Tile& tile) {
  ViewBlock block;
  const auto left = static_cast<float>(tile.x - map.center_x());
  const auto top = static_cast<float>(tile.y - map.center_y());
  const auto width = static_cast<float>(tile.width);
  const auto height = static_cast<float>(tile.height);
  block.pixel = {left, top, map.weightTerms()[0], map.weightTerms()[1]};
  block.lens = {map.eyeDepth(), map.squaredSlope(), static_cast<float>(map.unit()), 0.0F};
  // Row 0 of the framebuffer is the image's top row: y down in the image is y up in clip space.
  block.window = {2.0F / width, 2.0F / height, -1.0F - 2.0F * left / width, -1.0F - 2.0F * top / height};
  block.counts = {static_cast<std::int32_t>(frame.camera.view().clips.size()), pieces_, transfer_bins, 0};
  view_.upload(gl_, GL_UNIFORM_BUFFER, &block, sizeof block);
}

void GlCompositor::drawTile(const Frame& frame, const FrameMap& map, const Tile& tile, FrameStats& stats) {
  target_.begin(gl_, tile);
  uploadView(frame, map, tile);
  gl_.BindBufferBase(GL_UNIFORM_BUFFER, gl_binding::view, view_.id());
  if (frame.integration == Integration::vertex) {
    drawPolygons(frame, map, stats);
    return;
  }
  const auto left = static_cast<float>(tile.x - map.center_x());
  const auto top = static_cast<float>(tile.y - map.center_y());
  drawCells(frame, map, {left, top, left + static_cast<float>(tile.width), top + static_cast<float>(tile.height)},
            stats);
}

void GlCompositor::drawCells(const Frame& frame, const FrameMap& map, const Window& window, FrameStats& stats) {
  gl_.BindVertexArray(vertex_array_);
  gl_.Enable(GL_CULL_FACE);
  gl_.UseProgram(program({topology_->shape(), thin(map), segmentShader(frame)}));
  plane_buffer_.bind(gl_, gl_binding::planes);
  transfer_buffer_.bind(gl_, gl_binding::transfer);
  gl_.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl_.BindTexture(GL_TEXTURE_3D, table_);
  std::size_t turn = 0;
  for (std::size_t entry = 0; entry < frame.order.cells.size(); ++turn) {
    Stream& stream = streams_[turn % streams];
    wait(stream);
    const auto start = Clock::now();
    entry = planBatch(*topology_, frame.order.cells, entry, capacity_, chunks_);
    tbb::parallel_for(std::size_t{0}, chunks_.size(),
                      [&](std::size_t i) { fill(frame, map, window, stream, chunks_[i]); });
    stats.project_seconds += secondsSince(start);
    stream.cells.bind(gl_, gl_binding::cells);
    stream.vertices.bind(gl_, gl_binding::vertices);
    stream.triangles.bind(gl_, gl_binding::triangles);
    for (const Chunk& chunk : chunks_) {
      gl_.DrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(6 * chunk.kept), GL_UNSIGNED_INT, nullptr,
                                 static_cast<GLint>(4 * chunk.record));
      stats.polygons += chunk.kept;
    }
    stream.fence = gl_.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  }
}

void GlCompositor::drawPolygons(const Frame& frame, const FrameMap& map, FrameStats& stats) {
  if (polygon_program_ == 0) {
    polygon_program_ = makeProgram(gl_, polygonVertexShader(), polygonFragmentShader());
  }
  gl_.UseProgram(polygon_program_);
  gl_.Disable(GL_CULL_FACE);
  gl_.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl_.BindTexture(GL_TEXTURE_2D, opacity_);
  gl_.BindVertexArray(polygon_array_);
  struct Worker {
    project::CellProjector projector;
    project::Regions regions;
  };
  tbb::enumerable_thread_specific<Worker> workers([&] {
    return Worker{{frame.mesh, frame.camera, screen_points_, project::Faces::planar}, {}};
  });
  const std::size_t cells = frame.order.cells.size();
  std::array<std::size_t, polygon_chunks> counts{};
  for (std::size_t first = 0; first < cells; first += polygon_chunks * chunk_cells) {
    const auto start = Clock::now();
    tbb::parallel_for(std::size_t{0}, polygon_chunks, [&](std::size_t i) {
      Worker& worker = workers.local();
      const std::size_t begin = std::min(cells, first + i * chunk_cells);
      polygons_[i].clear();
      counts[i] = appendPolygons(frame, map, begin, std::min(cells, begin + chunk_cells), worker.projector,
                                 worker.regions, polygons_[i]);
    });
    stats.project_seconds += secondsSince(start);
    for (std::size_t i = 0; i < polygon_chunks; ++i) {
      stats.polygons += counts[i];
      polygon_buffer_.upload(gl_, GL_ARRAY_BUFFER, polygons_[i].data(), polygons_[i].size() * sizeof(PolygonVertex));
      for (const auto& [index, size, offset] : polygon_attributes) {
        gl_.VertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, sizeof(PolygonVertex),
                                reinterpret_cast<const void*>(offset));
      }
      gl_.DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(polygons_[i].size()));
    }
  }
}

// The records, vertices and triangles of one chunk: of the cells that are neither hidden nor off the window.
void GlCompositor::fill(const Frame& frame, const FrameMap& map, const Window& window, Stream& stream,
                        Chunk& chunk) const {
  CellRecord* record = static_cast<CellRecord*>(stream.cells.data()) + chunk.record;
  auto* const vertices = static_cast<ScreenVertex*>(stream.vertices.data());
  auto* const triangles = static_cast<std::uint32_t*>(stream.triangles.data());
  const std::vector<sort::Cut>& cuts = frame.order.cuts;
  auto cut = std::lower_bound(cuts.begin(), cuts.end(), chunk.first,
                              [](const sort::Cut& c, std::size_t entry) { return c.entry < entry; });
  std::size_t vertex = chunk.vertex;
  std::size_t triangle = chunk.triangle;
  CoverScratch scratch;
  std::vector<ScreenVertex> corners;
  for (std::size_t entry = chunk.first; entry < chunk.end; ++entry) {
    const Id cell = frame.order.cells[entry];
    while (cut != cuts.end() && cut->entry < entry) {
      ++cut;
    }
    if (!frame.field.hidden.empty() && frame.field.hidden[cell] != 0) {
      continue;
    }
    corners.clear();
    for (const Id v : topology_->vertices(cell)) {
      corners.push_back(screen_[v]);
    }
    CellRecord made;
    if (!cover(corners, map, window, scratch, made.cover)) {
      continue;
    }
    const std::span<const std::uint32_t> faces = topology_->triangles(cell);
    const std::size_t second = topology_->shape() == CellShape::hexahedra ? topology_->diagonals(cell) : triangle;
    made.at = {
        static_cast<std::uint32_t>(vertex), static_cast<std::uint32_t>(second),
        static_cast<std::uint32_t>(faces.size()),
        cut != cuts.end() && cut->entry == entry ? cut_planes_[static_cast<std::size_t>(cut - cuts.begin())] : 0};
    if (!paint_.empty()) {
      made.paint = paint_[cell];
    }
    *record++ = made;
    std::copy(corners.begin(), corners.end(), vertices + vertex);
    std::copy(faces.begin(), faces.end(), triangles + triangle);
    vertex += corners.size();
    triangle += faces.size();
    ++chunk.kept;
  }
}

void GlCompositor::wait(Stream& stream) const {
  if (stream.fence == nullptr) {
    return;
  }
  while (gl_.ClientWaitSync(stream.fence, GL_SYNC_FLUSH_COMMANDS_BIT, fence_wait) == GL_TIMEOUT_EXPIRED) {
  }
  gl_.DeleteSync(stream.fence);
  stream.fence = nullptr;
}

// Whether no segment in any cell is so deep that it needs the weights for thick ones.
bool GlCompositor::thin(const FrameMap& map) const {
  return max_extinction_ * topology_->longest_chord() / map.unit() < thin_depth;
}

GLuint GlCompositor::program(const CellShader& shader) {
  for (const Program& made : programs_) {
    if (made.shader == shader) {
      return made.id;
    }
  }
  programs_.push_back({shader, makeProgram(gl_, cellVertexShader(shader), cellFragmentShader(shader))});
  return programs_.back().id;
}

}  // namespace

std::unique_ptr<Compositor> makeGlCompositor(std::unique_ptr<GlContext> context) {
  return std::make_unique<GlCompositor>(std::move(context));
}

}  // namespace spillikin::composite
