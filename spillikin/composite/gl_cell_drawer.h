// Whole cells, integrated in the fragment shader: batches of the order through a few buffers that stay mapped.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/composite/gl_cells.h"
#include "spillikin/composite/gl_frame.h"
#include "spillikin/composite/gl_look.h"
#include "spillikin/composite/gl_program.h"
#include "spillikin/composite/gl_shaders.h"

namespace spillikin::composite {

class GlCellDrawer {
 public:
  explicit GlCellDrawer(const Gl& gl);
  void destroy();

  // Before the first window of a frame; `changed`: the mesh is another than in the frame before.
  void prepare(const Frame& frame, const FrameMap& map, const GlLook& look, bool changed);
  // For a frame that does without, of another mesh.
  void forgetMesh() { topology_.reset(); }
  // Draws the whole order into the part of the image that is bound. The uniform block must be bound.
  void draw(const Frame& frame, const FrameMap& map, const GlLook& look, const Window& window, FrameStats& stats);

 private:
  // The buffers of one batch.
  struct Stream {
    GlStream cells, vertices, triangles;
    GLsync fence = nullptr;
  };
  struct Program {
    CellShader shader;
    GLuint id = 0;
  };
  static constexpr std::size_t streams = 3;  // batches in flight

  void prepareMesh(const mesh::Mesh& mesh);
  void preparePlanes(const Frame& frame, const FrameMap& map);
  void bind(const Stream& stream) const;
  void fill(const Frame& frame, const FrameMap& map, const GlLook& look, const Window& window, Stream& stream,
            Chunk& chunk) const;
  void wait(Stream& stream) const;
  GLuint program(const CellShader& shader);

  const Gl& gl_;
  GLuint vertex_array_ = 0;
  GlBuffer index_;
  GlTexels plane_buffer_;
  std::array<Stream, streams> streams_;
  std::vector<Program> programs_;

  // Kept while the mesh stays.
  std::optional<CellTopology> topology_;
  BatchCapacity capacity_;

  // Reused from frame to frame.
  CellShader shader_;
  std::vector<ScreenVertex> screen_;
  std::vector<ScreenPlane> planes_;
  std::vector<std::uint32_t> cut_planes_;  // per cut of the order, its planes (first << 8 | count)
  std::vector<Chunk> chunks_;
};

}  // namespace spillikin::composite
