// A mesh, a view and a look to an image: what the library does, with everything kept that need not be redone.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "spillikin/base/image.h"
#include "spillikin/base/view.h"
#include "spillikin/composite/compositor.h"
#include "spillikin/integrate/optics.h"
#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/source.h"
#include "spillikin/render/stats.h"
#include "spillikin/sort/sort.h"

namespace spillikin::render {

// How cells are projected: whole under the face model, or as the tetrahedra of the consistent subdivision.
enum class Projection : std::uint8_t { automatic, zoo, tets };
const char* name(Projection projection);
Projection projection(std::string_view name);  // throws Error that lists the names

struct Engine {
  sort::Algorithm sort = sort::Algorithm::automatic;
  Projection projection = Projection::automatic;
  composite::Integration integration = composite::Integration::exact;
  composite::Backend backend = composite::Backend::automatic;
  // Only with automatic sorting, and where the compositor can: see composite::Compositor::needsOrder.
  composite::Walking walking = composite::Walking::automatic;
};

// Caps the threads of every session of the process while it lives; 0 means all cores.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;
  static int current();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Takes any of the five things that can change and redoes, at the next draw(), that tier and those after it: topology
// and geometry (source), viewpoint (view), scalar (field), transfer function. Without a call it has a default for
// each: the whole mesh in view, the first scalar, the default colour map over the field's range at the extinction at
// which a typical ray keeps a third of its light.
//
// Every function throws Error as documented in the room that does the work. Not for use by two threads at once.
class Session {
 public:
  explicit Session(mesh::Source source, const Engine& engine = {});
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  void setSource(mesh::Source source);                                      // tier (a) and (b): everything is redone
  void setView(const View& view);                                           // tier (c)
  void setField(const std::string& name, int component = mesh::magnitude);  // tier (d)
  void setTransferFunction(integrate::TransferFunction transfer_function);  // tier (e); extinction per world unit
  void setOptics(integrate::Optics optics);                                 // tier (e) too

  // The default view of this mesh for an image of the given size.
  View defaultView(int width = 1024, int height = 768) const;
  // The default look of the current field.
  integrate::TransferFunction defaultTransferFunction() const;

  Image draw();
  // The same into an image that the caller keeps: from frame to frame its memory is reused.
  void draw(Image& image);

  // The order of the current view by the engine's sort, on drawnMesh(). Sorts when needed. The picture may have been
  // made from another one: see Stats::sort.road.
  const sort::Order& order();

  const mesh::Source& source() const;  // its connectivity is given up once the mesh is built
  const mesh::Mesh& mesh() const;
  const mesh::BuildReport& buildReport() const;
  const mesh::Field& field() const;
  const View& view() const;
  const integrate::TransferFunction& transferFunction() const;
  integrate::Optics optics() const;
  // What is sorted and composited: the mesh, or its tetrahedra; parent() is empty, or the mesh's cell of each.
  const mesh::Mesh& drawnMesh();
  const mesh::Field& drawnField();
  const std::vector<mesh::Id>& parent() const;

  const Stats& stats() const;
  // What reading the file took, for the statistics; total_seconds grows by it.
  void setLoadSeconds(double seconds);
  // One line each; what a user should know about this picture. Filled by construction and by draw().
  const std::vector<std::string>& warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The shortest way: one mesh, one picture. Throws as Session does.
Image render(const mesh::Source& source, const View& view, const integrate::TransferFunction& transfer_function,
             const Engine& engine = {});

}  // namespace spillikin::render
