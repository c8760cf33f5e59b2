#include "spillikin/sort/mpvonc.h"

#include <algorithm>

namespace spillikin::sort {

Mpvonc::Mpvonc(const mesh::Mesh& mesh) : mesh_(mesh), signs_(mesh) {
  neighbour_.resize(mesh.cell_face.size());
  state_.resize(mesh.cell_count());
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    bool exterior = false;
    for (std::size_t k = mesh.cell_face_offset[c]; k < mesh.cell_face_offset[c + 1]; ++k) {
      neighbour_[k] = mesh.neighbour(mesh.cell_face[k]);
      exterior = exterior || neighbour_[k] == mesh::none;
    }
    if (exterior) boundary_.push_back(c);
  }
}

void Mpvonc::sortBoundary(const Viewpoint& viewpoint) {
  front_.clear();
  for (const mesh::Id c : boundary_) {
    bool front = false;
    for (const mesh::FaceUse use : mesh_.faces(c)) {
      front = front || (mesh_.exterior(use.face()) && signs_.bit(signs_.bitIndex(use)));
    }
    if (!front) continue;
    Vec3 mean(0.0);
    for (const mesh::Id v : mesh_.vertices(c))
      mean += mesh_.points[v];
    mean /= static_cast<double>(mesh_.vertices(c).size());
    const Vec3 sight(viewpoint);
    const Vec3 away = mean - sight;
    const double nearness = viewpoint.w == 0.0 ? mean.x * sight.x + mean.y * sight.y + mean.z * sight.z
                                               : -(away.x * away.x + away.y * away.y + away.z * away.z);
    front_.emplace_back(nearness, c);
  }
  std::sort(front_.begin(), front_.end());
}

// Lists what lies behind the cell, then the cell. Returns false when it meets itself on the way.
bool Mpvonc::listFrom(mesh::Id root, Order& order) {
  if (state_[root] != 0) return true;
  bool acyclic = true;
  stack_.assign(1, {root, mesh_.cell_face_offset[root]});
  state_[root] = 1;
  while (!stack_.empty()) {
    auto& [cell, next] = stack_.back();
    if (next == mesh_.cell_face_offset[cell + 1]) {
      state_[cell] = 2;
      order.cells.push_back(cell);
      stack_.pop_back();
      continue;
    }
    const std::size_t k = next++;
    const mesh::Id behind = neighbour_[k];
    if (behind == mesh::none || !signs_.bit(signs_.bitIndex(mesh_.cell_face[k]) ^ 1U)) continue;
    acyclic = acyclic && state_[behind] != 1;
    if (state_[behind] != 0) continue;
    state_[behind] = 1;
    stack_.emplace_back(behind, mesh_.cell_face_offset[behind]);
  }
  return acyclic;
}

void Mpvonc::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cells.clear();
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  signs_(viewpoint);
  sortBoundary(viewpoint);
  std::fill(state_.begin(), state_.end(), std::uint8_t{0});
  for (const auto& [nearness, cell] : front_)
    listFrom(cell, order);
  for (mesh::Id c = 0; c < mesh_.cell_count(); ++c)
    listFrom(c, order);
  order.exact = order.cells.size() < 2;
}

std::size_t Mpvonc::bytes() const {
  return signs_.bytes() + 4 * (neighbour_.capacity() + boundary_.capacity()) + front_.capacity() * sizeof(front_[0]) +
         state_.capacity() + stack_.capacity() * sizeof(stack_[0]);
}

}  // namespace spillikin::sort
