// The orders that ask no geometry: depth of the centroid, and file order.
#pragma once

#include <vector>

#include "spillikin/sort/radix_sort.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Farthest mean of a cell's vertices first, as vtkCellCenterDepthSort does; right for no mesh in general. 12 bytes a
// cell and the scratch space of a radix sort.
class CentroidSort final : public Sorter {
 public:
  explicit CentroidSort(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::centroid; }
  std::string why() const override { return "the depth of the centroid is not a visibility order, except by luck"; }
  bool exact() const override { return false; }
  std::size_t bytes() const override;

 private:
  Vec3 origin_{0.0};
  std::vector<float> x_, y_, z_;
  RadixSort radix_;
};

// The order of the file; for optics that do not depend on any order.
class FileOrder final : public Sorter {
 public:
  explicit FileOrder(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::none; }
  std::string why() const override { return "cells come in the order of the file, whatever the viewpoint"; }
  bool exact() const override { return false; }
  std::size_t bytes() const override { return cells_.capacity() * sizeof(mesh::Id); }

 private:
  std::vector<mesh::Id> cells_;
};

}  // namespace spillikin::sort
