#include "spillikin/sort/newell_facets.h"

#include <algorithm>
#include <limits>

#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

using Corners = std::array<mesh::Id, 3>;

// Whether all vertices lie behind the plane or in it, whether some do not lie in it, and which.
struct Support {
  bool all = true, some = false;
  std::uint32_t behind = 0;
};
Support support(const mesh::Mesh& mesh, const Corners& t, std::span<const mesh::Id> vertices) {
  Support s;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const mesh::Id v = vertices[i];
    if (v == t[0] || v == t[1] || v == t[2]) continue;
    const int side = mesh::orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], mesh.points[v]);
    s.all = s.all && side <= 0;
    s.some = s.some || side < 0;
    if (side < 0 && i < 32) s.behind |= 1U << i;
  }
  return s;
}

}  // namespace

// What one thread makes of some cells that follow each other.
struct CellFacets::Block {
  std::vector<Plane> plane;
  std::vector<Corners> corner;
  std::vector<std::uint32_t> behind;
  std::vector<std::uint8_t> kind;
};

CellFacets::CellFacets(const mesh::Mesh& mesh)
    : mesh_(mesh), offset_(mesh.cell_count() + 1), convex_(mesh.cell_count()) {
  std::vector<Block> blocks(mesh::blockCount(mesh.cell_count()));
  mesh::parallelBlocks(mesh.cell_count(), [&](std::size_t b, std::size_t begin, std::size_t end) {
    mesh::Surface surface;
    for (std::size_t c = begin; c < end; ++c) {
      add(static_cast<mesh::Id>(c), surface, blocks[b]);
      offset_[c + 1] = static_cast<std::uint32_t>(blocks[b].plane.size());  // within the block
    }
  });
  std::vector<std::size_t> first(blocks.size() + 1, 0);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    first[b + 1] = first[b] + blocks[b].plane.size();
  plane_.resize(first.back());
  corner_.resize(first.back());
  behind_.resize(first.back());
  kind_.resize(first.back());
  mesh::parallelBlocks(mesh.cell_count(), [&](std::size_t b, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      offset_[c + 1] += static_cast<std::uint32_t>(first[b]);
    const auto at = static_cast<std::ptrdiff_t>(first[b]);
    std::copy(blocks[b].plane.begin(), blocks[b].plane.end(), plane_.begin() + at);
    std::copy(blocks[b].corner.begin(), blocks[b].corner.end(), corner_.begin() + at);
    std::copy(blocks[b].behind.begin(), blocks[b].behind.end(), behind_.begin() + at);
    std::copy(blocks[b].kind.begin(), blocks[b].kind.end(), kind_.begin() + at);
    blocks[b] = {};
  });
}

void CellFacets::add(mesh::Id cell, mesh::Surface& surface, Block& block) {
  mesh::surface(mesh_, cell, surface);
  const auto vertices = mesh_.vertices(cell);
  const auto put = [&](const Corners& t, const Support& s, unsigned kind) {
    block.plane.push_back(plane(t));
    block.corner.push_back(t);
    block.behind.push_back(s.behind);
    block.kind.push_back(static_cast<std::uint8_t>(kind));
  };
  bool convex = true;
  const auto& triangles = surface.triangles;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Support s = support(mesh_, triangles[i], vertices);
    put(triangles[i], s, s.all && s.some ? bounds | supports : bounds);
    convex = convex && s.all;
    // The second half of a quadrilateral a, b, c, d.
    if (s.all || i == 0 || surface.face[i - 1].packed != surface.face[i].packed) continue;
    const mesh::Id a = triangles[i][0], b = triangles[i - 1][1], c = triangles[i][1], d = triangles[i][2];
    for (const Corners& other : {Corners{a, b, d}, Corners{b, c, d}}) {
      const Support o = support(mesh_, other, vertices);
      if (o.all && o.some) put(other, o, supports);
    }
  }
  convex_[cell] = convex ? 1 : 0;
}

CellFacets::Plane CellFacets::plane(const Corners& corners) const {
  const Vec3 &a = mesh_.points[corners[0]], u = mesh_.points[corners[1]] - a, v = mesh_.points[corners[2]] - a;
  double n[3], largest = 0.0, magnitude = 0.0;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double p = u[i] * v[j], q = u[j] * v[i];
    n[k] = p - q;
    largest = std::max(largest, std::abs(n[k]));
    magnitude = std::max(magnitude, std::abs(p) + std::abs(q));
  }
  // Beyond these, powers of two would not be exact; such planes leave all to the exact predicate.
  if (!(largest > 0x1p-900 && magnitude < 0x1p900)) return {0.0F, 0.0F, 0.0F, std::numeric_limits<float>::infinity()};
  const int exponent = -std::ilogb(largest) - 1;  // to [1/2, 1)
  const auto scaled = [&](double x) { return static_cast<float>(std::ldexp(x, exponent)); };
  const double bound = 0x1p-23 + 0x1p-49 * std::ldexp(magnitude, exponent);
  return {scaled(n[0]), scaled(n[1]), scaled(n[2]), static_cast<float>(std::min(bound, 1e30))};
}

std::size_t CellFacets::bytes() const {
  return offset_.capacity() * 4 + plane_.capacity() * sizeof(Plane) + corner_.capacity() * sizeof(Corners) +
         behind_.capacity() * 4 + kind_.capacity() + convex_.capacity();
}

}  // namespace spillikin::sort
