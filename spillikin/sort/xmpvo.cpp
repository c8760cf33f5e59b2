#include "spillikin/sort/xmpvo.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "spillikin/sort/cycles.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t block = 64;  // triangles searched by one task, whose edges are kept together

}  // namespace

Xmpvo::Xmpvo(const mesh::Mesh& mesh) : mesh_(mesh), signs_(mesh), layered_(mesh), tree_(mesh, exteriorTriangles(mesh)) {
  const auto& triangles = tree_.triangles();
  row_.reserve(triangles.size());
  for (const auto& t : triangles) {
    std::size_t row = t.face;
    if (t.face >= mesh.triangle_count()) {
      const auto& quad = mesh.quad[t.face - mesh.triangle_count()];
      row = t.corner[1] == quad[1] ? signs_.firstHalf(t.face) : signs_.secondHalf(t.face);
    }
    row_.push_back(row);
  }
  sign_.resize(triangles.size());
  found_.resize((triangles.size() + block - 1) / block);
}

void Xmpvo::findEdges(const Viewpoint& viewpoint) {
  const auto& triangles = tree_.triangles();
  for (std::size_t t = 0; t < triangles.size(); ++t)
    sign_[t] = static_cast<std::int8_t>(signs_.sign(row_[t]));
  tbb::enumerable_thread_specific<std::vector<std::uint32_t>> scratch;
  tbb::parallel_for(std::size_t{0}, found_.size(), [&](std::size_t b) {
    auto& found = found_[b];
    auto& candidates = scratch.local();
    found.clear();
    for (std::size_t f = b * block; f < std::min(triangles.size(), (b + 1) * block); ++f) {
      if (sign_[f] >= 0) continue;  // rays leave through triangles turned away
      candidates.clear();
      tree_.inShadow(f, sign_[f], viewpoint, candidates);
      const Triangle exit = tree_.corners(f);
      const mesh::Id front = triangles[f].cell;
      for (const std::uint32_t g : candidates) {
        const mesh::Id behind = triangles[g].cell;
        if (sign_[g] <= 0 || behind == front) continue;
        const Triangle entry = tree_.corners(g);
        if (!projectionsOverlap(exit, sign_[f], entry, sign_[g], viewpoint)) continue;
        if (nearer(exit, sign_[f], entry, sign_[g], viewpoint) >= 0) found.emplace_back(behind, front);
      }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
  });
  // By the cell behind, in the order found.
  extra_.offset.assign(mesh_.cell_count() + 1, 0);
  for (const auto& found : found_) {
    for (const auto& edge : found)
      ++extra_.offset[edge.first + 1];
  }
  for (std::size_t c = 0; c < mesh_.cell_count(); ++c)
    extra_.offset[c + 1] += extra_.offset[c];
  extra_.successor.resize(extra_.offset.back());
  for (const auto& found : found_) {
    for (const auto& [behind, front] : found)
      extra_.successor[extra_.offset[behind]++] = front;
  }
  for (std::size_t c = mesh_.cell_count(); c > 0; --c)
    extra_.offset[c] = extra_.offset[c - 1];
  extra_.offset[0] = 0;
}

void Xmpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  signs_(viewpoint);
  findEdges(viewpoint);
  order.exact = true;
  const std::size_t listed = layered_(signs_, order, &extra_);
  if (listed < mesh_.cell_count() && !appendLeft(mesh_, signs_, layered_, &extra_, viewpoint, order))
    order.exact = false;
}

std::string Xmpvo::why() const {
  return "every pair of exterior faces that one ray crosses through empty space is ordered exactly";
}

std::size_t Xmpvo::bytes() const {
  std::size_t bytes = signs_.bytes() + layered_.bytes() + tree_.bytes() + row_.capacity() * sizeof(std::size_t) +
                      sign_.capacity() + 4 * (extra_.offset.capacity() + extra_.successor.capacity());
  for (const auto& found : found_)
    bytes += found.capacity() * sizeof(found[0]);
  return bytes;
}

}  // namespace spillikin::sort
