// Ordered cells to an image: one interface, one backend per file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "spillikin/base/image.h"
#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/project/camera.h"
#include "spillikin/sort/sort.h"

namespace spillikin::composite {

enum class Backend : std::uint8_t { automatic, native, osmesa, egl };
enum class Integration : std::uint8_t { exact, preintegrated, average, vertex };
// Whether rays may walk through the mesh in place of projecting it in an order.
enum class Walking : std::uint8_t { automatic, never, always };
const char* name(Backend backend);
const char* name(Integration integration);
const char* name(Walking walking);
Backend backend(std::string_view name);          // throws Error that lists the names
Integration integration(std::string_view name);  // throws Error that lists the names
Walking walking(std::string_view name);          // throws Error that lists the names

// Everything a frame is made of; all of it outlives the call. The field lies on `mesh`; on a mesh of tetrahedra it is
// linear in each, on other cells it follows the face model; a cell field is constant in each cell.
struct Frame {
  const mesh::Mesh& mesh;
  const mesh::Field& field;
  const integrate::TransferFunction& transfer_function;  // extinction per world unit, final
  const project::Camera& camera;
  const sort::Order& order;
  Integration integration = Integration::exact;
  // Which of the inputs are the very same as in the call before, so that what was made of them may be kept.
  bool same_mesh = false;
  bool same_topology = false;  // the mesh's vertices and cells are the same by their numbers, wherever they lie now
  bool same_field = false;
  bool same_transfer_function = false;
  bool order_matters = true;  // false where any order gives the same picture
  Walking walking = Walking::automatic;
  bool ordered = true;  // false: `order` is empty, since Compositor::needsOrder() has said that none is needed
  // The colour at the largest scalar on the ray, opaque, in place of the integral (integrate::Optics::mip; the other
  // optical models are looks of the integral).
  bool peaks = false;
  // Empty, or per cell: nonzero where nothing of the cell shows (clearCells), so that it need not be drawn.
  std::span<const std::uint8_t> clear = {};

  bool draws(mesh::Id cell) const {
    return (field.hidden.empty() || field.hidden[cell] == 0) && (clear.empty() || clear[cell] == 0);
  }
};

struct FrameStats {
  double project_seconds = 0.0;
  double composite_seconds = 0.0;
  std::size_t fragments = 0;
  std::size_t polygons = 0;
  std::size_t flagged = 0, resolved = 0, unresolved = 0;  // certificate; the OpenGL backends have none
  bool certified = false;
  std::size_t kept_bytes = 0;  // of the mesh, for frames that need no order
};

class Compositor {
 public:
  virtual ~Compositor() = default;
  // Does what of a frame needs no order, so that it may run while the order is still being made: everything but
  // frame.order is read. Not needed; if called, draw() must be next, with the very same frame.
  virtual void prepare(const Frame& /*frame*/) {}
  // Whether the frame is to be drawn in an order, which costs its finding: everything but frame.order is read. False
  // where the compositor can do without, and sooner; the same frame, not `ordered`, must be drawn next then.
  // It may turn out that an order is needed after all: the picture is not certified then, and means nothing.
  virtual bool needsOrder(const Frame& /*frame*/) { return true; }
  // `image` takes the camera's size. Throws Error when the device cannot hold the image.
  virtual FrameStats draw(const Frame& frame, Image& image) = 0;
  virtual Backend backend() const = 0;
  // Whether every pixel is certified and, where the order was wrong on it, sorted again: then any order gives the right
  // picture. Fragments shorter than this share of the mesh's depth escape that, 0 for a backend without a certificate.
  virtual double certificateGrain() const { return 0.0; }
};

// Throws Error when the backend is not available here, with the reason.
std::unique_ptr<Compositor> makeCompositor(Backend backend);

}  // namespace spillikin::composite
