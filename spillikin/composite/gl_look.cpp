#include "spillikin/composite/gl_look.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "spillikin/composite/gl_shaders.h"
#include "spillikin/integrate/preintegrated.h"

namespace spillikin::composite {

namespace {

constexpr std::size_t grain = 8192;  // values per task

using Texel = std::array<float, 4>;
static_assert(sizeof(TransferPiece) % sizeof(Texel) == 0);
constexpr std::size_t texels_per_piece = sizeof(TransferPiece) / sizeof(Texel);

// out[i] = f(values[i]) on all cores.
template <class Out, class Function>
void transform(const std::vector<double>& values, std::vector<Out>& out, const Function& f) {
  out.resize(values.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.size(), grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        out[i] = f(values[i]);
                      }
                    });
}

}  // namespace

void GlLook::forget(const Frame& frame) {
  if (!frame.same_mesh || !frame.same_field) {
    has_scalars_ = has_paint_ = has_pieces_ = has_table_ = false;
  }
  if (!frame.same_transfer_function) {
    has_paint_ = has_pieces_ = has_table_ = false;
  }
}

void GlLook::prepare(const Gl& gl, const Frame& frame, double unit) {
  forget(frame);
  if (unit != unit_) {
    has_paint_ = has_pieces_ = false;
    unit_ = unit;
  }
  if (cellField(frame)) {
    scalar_.clear();
    has_scalars_ = false;
    paintCells(frame);
    return;
  }
  paint_.clear();
  has_paint_ = false;
  mapScalars(frame);
  if (frame.integration == Integration::preintegrated) {
    sendTable(gl, frame);
  } else {
    sendPieces(gl, frame);
  }
}

void GlLook::mapScalars(const Frame& frame) {
  if (has_scalars_) {
    return;
  }
  scalar_map_ = {frame.field.lo, frame.field.hi};
  transform(frame.field.values, scalar_, scalar_map_);
  has_scalars_ = true;
}

// In double precision, so that a value at a jump of the transfer function stays on its side.
void GlLook::paintCells(const Frame& frame) {
  if (has_paint_) {
    return;
  }
  transform(frame.field.values, paint_, [&, scale = ScalarMap{frame.field.lo, frame.field.hi}](double value) {
    if (frame.peaks) {
      return Texel{scale(value), 0.0F, 0.0F, 1.0F};
    }
    const integrate::Optical o = frame.transfer_function(value);
    return Texel{static_cast<float>(o.color[0]), static_cast<float>(o.color[1]), static_cast<float>(o.color[2]),
                 static_cast<float>(o.extinction * unit_)};
  });
  has_paint_ = true;
}

void GlLook::sendPieces(const Gl& gl, const Frame& frame) {
  if (has_pieces_) {
    return;
  }
  const std::vector<TransferPiece> pieces = transferPieces(frame.transfer_function, scalar_map_, unit_);
  std::vector<Texel> texels = searchStarts(pieces, transfer_bins);
  const auto* const first = reinterpret_cast<const Texel*>(pieces.data());
  texels.insert(texels.begin(), first, first + texels_per_piece * pieces.size());
  piece_buffer_.upload(gl, GL_RGBA32F, texels.data(), texels.size() * sizeof(Texel));
  pieces_ = static_cast<std::int32_t>(pieces.size());
  max_extinction_ = 0.0;
  for (const TransferPiece& piece : pieces) {
    max_extinction_ = std::max<double>(max_extinction_, std::max(piece.low[3], piece.low[3] + piece.rise[3]));
  }
  has_pieces_ = true;
}

void GlLook::sendTable(const Gl& gl, const Frame& frame) {
  if (has_table_) {
    return;
  }
  const integrate::Preintegrated table(frame.transfer_function, frame.field.lo, frame.field.hi);
  if (table_ == 0) {
    gl.GenTextures(1, &table_);
  }
  const auto n = static_cast<GLsizei>(table.n());
  gl.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl.BindTexture(GL_TEXTURE_3D, table_);
  gl.TexImage3D(GL_TEXTURE_3D, 0, GL_RGBA32F, n, n, static_cast<GLsizei>(table.layers()), 0, GL_RGBA, GL_FLOAT,
                table.texels().data());
  filterLinearly(gl, GL_TEXTURE_3D);
  check(gl, "sending the pre-integrated table");
  has_table_ = true;
}

void GlLook::bind(const Gl& gl) const {
  piece_buffer_.bind(gl, gl_binding::transfer);
  gl.ActiveTexture(GL_TEXTURE0 + gl_binding::table);
  gl.BindTexture(GL_TEXTURE_3D, table_);
}

void GlLook::destroy(const Gl& gl) {
  piece_buffer_.destroy(gl);
  gl.DeleteTextures(1, &table_);
  table_ = 0;
}

}  // namespace spillikin::composite
