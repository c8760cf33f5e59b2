// VTK's volume mappers for unstructured grids, given the same mesh, camera and transfer function as Spillikin.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "spillikin/base/image.h"
#include "spillikin/base/view.h"
#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::bench {

enum class Mapper : unsigned char { projected_tetrahedra, bunyk_preintegrated, bunyk_linear, zsweep };
const char* name(Mapper mapper);

// A mesh of tetrahedra with a point field, as VTK holds it; shared by the mappers.
class VtkMesh {
 public:
  // Throws Error for other cells and for cell fields: the mappers take neither.
  VtkMesh(const mesh::Mesh& mesh, const mesh::Field& field);
  ~VtkMesh();
  VtkMesh(const VtkMesh&) = delete;
  VtkMesh& operator=(const VtkMesh&) = delete;

  // The cells back to front by vtkCellCenterDepthSort, counted. Cost: n log n.
  std::size_t sortByDepth(const View& view) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

// One mapper in a window of its own. Full resolution always: no coarser sampling to keep a frame rate.
class VtkPeer {
 public:
  // `mesh` outlives the peer. The transfer function is handed over at its own points and 256 equally spaced ones, the
  // same for colour and opacity, so that no integrator drops one. All four take "opacity" as the extinction over the
  // unit distance, whatever the name says: so it is given, scaled to at most 1, and a homogeneous block comes out
  // right.
  VtkPeer(Mapper mapper, const VtkMesh& mesh, const integrate::TransferFunction& look, int width, int height);
  ~VtkPeer();
  VtkPeer(const VtkPeer&) = delete;
  VtkPeer& operator=(const VtkPeer&) = delete;

  // Draws and waits until it is drawn. False when it was given up after `limit_seconds`.
  bool draw(const View& view, double limit_seconds);
  // Of the last draw: colours on black, in steps of 1/255; alpha 0, as the mappers do not agree on it.
  Image image() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// "9.1.0"
std::string vtkVersion();

}  // namespace spillikin::bench
