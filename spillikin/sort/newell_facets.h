// The planes that bound cells, prepared for tests of many vertices against them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// Facets of a cell are the triangles of its surface and, where a quadrilateral is folded inward along its diagonal,
// those of the other diagonal if they have the whole cell behind them. Facets are numbered from cell to cell.
//
// A facet's plane is kept in float with a bound: n . (p - corner) differs from the exact determinant (times a power of
// two) by at most bound |p - corner|_1, for any p. Proof: with u = b - a, v = c - a in double and e = 2^-53, a
// component u_j v_k - u_k v_j is wrong by at most 4.1 e (|u_j v_k| + |u_k v_j|) <= 4.1 e M; keeping it as a float adds
// 2^-24 |n_i|, or 2^-150 where it is tiny; a component of p - a is wrong by e |p_i - a_i|, three products and two sums
// in double by 3 e of the magnitudes. Together below (2^-24 |n|_inf + 2^-50 M + 2^-149) |p - a|_1; what is kept is
// about twice that.
//
// Cost: 33 bytes a facet; built on all cores.
class CellFacets {
 public:
  enum Kind : std::uint8_t {
    bounds = 1,    // a triangle of the surface
    supports = 2,  // the whole cell lies behind its plane, and not in it
  };

  explicit CellFacets(const mesh::Mesh& mesh);

  std::uint32_t begin(mesh::Id cell) const { return offset_[cell]; }
  std::uint32_t end(mesh::Id cell) const { return offset_[cell + 1]; }
  std::size_t count() const { return plane_.size(); }
  const std::array<mesh::Id, 3>& corners(std::uint32_t facet) const { return corner_[facet]; }
  bool is(std::uint32_t facet, Kind kind) const { return (kind_[facet] & kind) != 0; }
  bool convex(mesh::Id cell) const { return convex_[cell] != 0; }
  // Of a facet that supports its cell, a bit for each of the cell's first 32 vertices that lies strictly behind it.
  std::uint32_t behind(std::uint32_t facet) const { return behind_[facet]; }

  // The certain side of w = p - first corner, or of a direction w: 1 where the normal points to, -1 behind, 0 not
  // certain.
  int side(std::uint32_t facet, const Vec3& w) const {
    const Plane& n = plane_[facet];
    const double height = n.x * w.x + n.y * w.y + n.z * w.z;
    // Products that underflow lose far less than the second term.
    const double room = n.bound * (std::abs(w.x) + std::abs(w.y) + std::abs(w.z)) + 0x1p-900;
    return static_cast<int>(height > room) - static_cast<int>(height < -room);
  }

  std::size_t bytes() const;

 private:
  struct Plane {
    float x, y, z, bound;
  };
  struct Block;
  Plane plane(const std::array<mesh::Id, 3>& corners) const;
  void add(mesh::Id cell, mesh::Surface& surface, Block& block);

  const mesh::Mesh& mesh_;
  std::vector<std::uint32_t> offset_;  // per cell + 1
  std::vector<Plane> plane_;
  std::vector<std::array<mesh::Id, 3>> corner_;
  std::vector<std::uint32_t> behind_;
  std::vector<std::uint8_t> kind_, convex_;
};

}  // namespace spillikin::sort
