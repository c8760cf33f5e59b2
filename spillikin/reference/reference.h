// The ground truth: an Embree ray caster in double precision. Knows meshes and transfer functions, and nothing of
// sorting, projection or compositing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "spillikin/base/image.h"
#include "spillikin/base/view.h"
#include "spillikin/integrate/optics.h"
#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::reference {

// One cell on one ray, from the front: distances in world units from the ray's origin.
struct Interval {
  mesh::Id cell = mesh::none;
  double enter = 0.0, leave = 0.0;
  double front = 0.0, back = 0.0;  // scalar at enter and leave
};

struct Options {
  mesh::FieldModel model = mesh::FieldModel::face;  // tets, face or isoparametric; cell fields are constant in each
  int samples = 1;                                  // per pixel, stratified; 1 is the pixel's centre
  integrate::Optics optics = integrate::Optics::absorption_emission;
  bool quadrature = false;               // adaptive quadrature instead of the closed form
  std::function<void(double)> progress;  // part done, 0 to 1; from one thread at a time, not always the same
};

struct Report {
  std::size_t rays = 0, intervals = 0;
  std::size_t overlaps = 0, gaps = 0;                 // between neighbours in space that share a face
  std::vector<std::array<mesh::Id, 2>> overlapping;   // the first pairs found, by ray order; at most 16
  std::vector<std::array<double, 2>> overlapping_at;  // for each of them, the image position of the ray
};

class RayCaster {
 public:
  // Prepares Embree for the mesh; both outlive the caster. Hidden cells are not there. Throws Error when Embree cannot
  // be had or runs out of memory, and for a field of another mesh. Cost: about a second per million cells; some 90
  // bytes per cell are kept.
  RayCaster(const mesh::Mesh& mesh, const mesh::Field& field);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  // The picture. The same bits whatever the number of threads; no early end of a ray; no allocation per ray. Overlaps
  // and gaps are counted beyond rounding (Tolerances in contacts.h) and before anything is clipped. Throws Error for a
  // view that defines no rays, samples below 1, an eye more than 1e9 mesh sizes away.
  Image render(const View& view, const integrate::TransferFunction& tf, const Options& options,
               Report* report = nullptr) const;

  // The cells on the ray of image position (x, y), front to back (by entry, then by leaving); `out` is overwritten. A
  // cell comes once per piece of the ray inside it (nonconvex cells), per tetrahedron with the model tets, and per
  // linear piece of its field with the model isoparametric. Trimmed to what is drawn; hidden cells are left out.
  // Cells that the ray only touches (at a vertex, along an edge) may show with lengths of the size of rounding, and
  // such intervals may come in any order among themselves; their part in the picture is of that size too.
  void intervals(const View& view, double x, double y, const Options& options, std::vector<Interval>& out) const;

  // For each pixel of the view, row by row: 1 where its centre lies within 1/256 pixel of the projection of an exterior
  // face that is seen edge-on, that is, where an infinitely small move of the camera decides whether the face's cell is
  // on the ray. Edge-on: the projection of one of the face's triangles is nowhere wider than edge_on_width pixels. A
  // geometric rule alone; nothing is cast. Cost: linear in the exterior faces and the pixels marked.
  std::vector<std::uint8_t> edgeOnMask(const View& view) const;
  static constexpr double edge_on_width = 1.0 / 256.0;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace spillikin::reference
