// The ground truth: an Embree ray caster in double precision. Knows meshes and transfer functions, and nothing of
// sorting, projection or compositing.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "spillikin/base/image.h"
#include "spillikin/base/view.h"
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
  bool quadrature = false;                          // adaptive quadrature instead of the closed form
  std::function<void(double)> progress;
};

struct Report {
  std::size_t rays = 0, intervals = 0;
  std::size_t overlaps = 0, gaps = 0;                // between neighbours in space that share a face
  std::vector<std::array<mesh::Id, 2>> overlapping;  // the first pairs found, by ray order
};

class RayCaster {
 public:
  // Prepares Embree for the mesh; both outlive the caster.
  RayCaster(const mesh::Mesh& mesh, const mesh::Field& field);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  Image render(const View& view, const integrate::TransferFunction& tf, const Options& options,
               Report* report = nullptr) const;

  // The cells on the ray of image position (x, y), front to back; `out` is overwritten.
  void intervals(const View& view, double x, double y, const Options& options, std::vector<Interval>& out) const;

 private:
  struct Impl;
  Impl* impl_;
};

}  // namespace spillikin::reference
