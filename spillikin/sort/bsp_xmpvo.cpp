#include "spillikin/sort/bsp_xmpvo.h"

#include <algorithm>

#include "spillikin/sort/splice.h"

namespace spillikin::sort {

BspXmpvo::BspXmpvo(const mesh::Mesh& mesh) : mesh_(mesh), signs_(mesh), gaps_(mesh, signs_), tree_(gaps_.tree()) {
  waits_.resize(mesh.cell_count());
  listed_.resize(mesh.cell_count());
  partial_mark_.resize(mesh.cell_count());
  neighbour_.resize(mesh.cell_face.size());
  for (std::size_t k = 0; k < neighbour_.size(); ++k)
    neighbour_[k] = mesh.neighbour(mesh.cell_face[k]);
}

void BspXmpvo::count() {
  for (std::size_t c = 0; c < mesh_.cell_count(); ++c) {
    std::uint32_t waits = 0;
    for (std::size_t k = mesh_.cell_face_offset[c]; k < mesh_.cell_face_offset[c + 1]; ++k) {
      if (neighbour_[k] == mesh::none) continue;
      waits += signs_.bit(signs_.bitIndex(mesh_.cell_face[k]) ^ 1U) ? 1U : 0U;
    }
    waits_[c] = waits;
  }
  const auto& triangles = gaps_.tree().triangles();
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (gaps_.sign(t) < 0) waits_[triangles[t].cell] += tree_.fragmentsOf(t);
  }
  std::fill(listed_.begin(), listed_.end(), std::uint8_t{0});
  std::fill(partial_mark_.begin(), partial_mark_.end(), std::uint8_t{0});
  queue_.clear();
  partial_.clear();
  held_.clear();
  most_partial_ = 0;
}

// Where a quadrilateral abuts two triangles the nearer may be either: no order of fragments tells.
void BspXmpvo::abutting(const Viewpoint& viewpoint) {
  for (const auto& [a, b] : gaps_.abutting()) {
    for (const auto& [exit, entry] : {std::pair{a, b}, std::pair{b, a}}) {
      if (gaps_.sign(exit) >= 0 || gaps_.sign(entry) <= 0 || !gaps_.related(exit, entry, viewpoint)) continue;
      const auto& triangles = gaps_.tree().triangles();
      held_.emplace_back(triangles[entry].cell, triangles[exit].cell);
      ++waits_[triangles[exit].cell];
    }
  }
}

bool BspXmpvo::hides(mesh::Id front, mesh::Id behind, const Viewpoint& viewpoint) const {
  for (const std::uint32_t exit : gaps_.trianglesOf(front)) {
    if (gaps_.sign(exit) >= 0) continue;
    for (const std::uint32_t entry : gaps_.trianglesOf(behind)) {
      if (gaps_.sign(entry) > 0 && gaps_.related(exit, entry, viewpoint)) return true;
    }
  }
  return false;
}

void BspXmpvo::freed(mesh::Id cell) {
  if (--waits_[cell] == 0) queue_.push_back(cell);
}

// Lists what waits for nothing, unless it hides a partially projected cell.
void BspXmpvo::drain(const Viewpoint& viewpoint, Order& order) {
  while (!queue_.empty()) {
    const mesh::Id cell = queue_.back();
    queue_.pop_back();
    bool waits = false;
    const bool boundary = !gaps_.trianglesOf(cell).empty();
    for (std::size_t i = 0; boundary && i < partial_.size(); ++i) {
      if (partial_[i] == cell || !hides(cell, partial_[i], viewpoint)) continue;
      held_.emplace_back(partial_[i], cell);
      ++waits_[cell];
      waits = true;
    }
    if (waits) continue;
    order.cells.push_back(cell);
    listed_[cell] = 1;
    if (partial_mark_[cell] != 0) partial_.erase(std::find(partial_.begin(), partial_.end(), cell));
    for (std::size_t k = mesh_.cell_face_offset[cell]; k < mesh_.cell_face_offset[cell + 1]; ++k) {
      if (neighbour_[k] != mesh::none && signs_.before(mesh_.cell_face[k])) freed(neighbour_[k]);
    }
    for (std::size_t i = 0; i < held_.size();) {
      if (held_[i].first != cell) {
        ++i;
        continue;
      }
      const mesh::Id next = held_[i].second;
      held_[i] = held_.back();
      held_.pop_back();
      freed(next);
    }
  }
}

void BspXmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  order.layer_offset.clear();
  order.cells.clear();
  order.exact = true;
  signs_(viewpoint);
  count();
  abutting(viewpoint);
  for (mesh::Id c = 0; c < mesh_.cell_count(); ++c) {
    if (waits_[c] == 0) queue_.push_back(c);
  }
  drain(viewpoint, order);
  const auto& triangles = gaps_.tree().triangles();
  tree_.backToFront(
      viewpoint, [&](std::uint32_t t) { return gaps_.sign(t); },
      [&](std::uint32_t t) {
        const mesh::Id cell = triangles[t].cell;
        const int s = gaps_.sign(t);
        if (s < 0) {
          freed(cell);
          drain(viewpoint, order);
        } else if (s > 0 && listed_[cell] == 0 && partial_mark_[cell] == 0) {
          partial_mark_[cell] = 1;
          partial_.push_back(cell);
          most_partial_ = std::max(most_partial_, partial_.size());
        }
      });
  if (order.cells.size() < mesh_.cell_count()) finish(viewpoint, order);
}

// A cycle: what is left goes in XMPVO's order, which cuts it.
void BspXmpvo::finish(const Viewpoint& viewpoint, Order& order) {
  if (xmpvo_ == nullptr) xmpvo_ = std::make_unique<Xmpvo>(mesh_);
  (*xmpvo_)(viewpoint, rest_);
  appendUnlisted(rest_, listed_, order);
}

std::string BspXmpvo::why() const {
  return "a BSP tree of " + std::to_string(tree_.fragments()) +
         " fragments of exterior faces orders what lies across empty space";
}

std::size_t BspXmpvo::bytes() const {
  return signs_.bytes() + gaps_.bytes() + tree_.bytes() + 4 * (waits_.capacity() + neighbour_.capacity()) +
         listed_.capacity() + partial_mark_.capacity() + (xmpvo_ == nullptr ? 0 : xmpvo_->bytes());
}

}  // namespace spillikin::sort
