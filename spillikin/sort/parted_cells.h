// Cells with problem faces in parts, so that a curved face alone makes no cycle.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/problem_faces.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// A cell inside half-spaces.
struct CellPiece {
  mesh::Id cell;
  std::vector<HalfSpace> keep;
};

// Through a problem face rays leave the problem cell P by the triangle S, cross the other cell B and enter P again by
// the triangle T (problem_faces.h), which makes P and B a cycle of two. P is nonconvex there: S and with it a thin part
// of P, a sliver, lie on the viewpoint's side of the plane of T, which every ray crosses once. Cut by that plane, the
// rest of P comes first, then B, then the sliver. For several problem faces the slivers are cut off one after the
// other; the rest, beyond all their planes, stands for the cell.
//
// A sliver is a node of its own, with the edges of those triangles of P that touch it: it comes after the rest and
// after B, and before what it lies behind across other faces; of two slivers of a cell the one cut off later comes
// first. That is all a ray can tell, so an order of the nodes is an order of the parts: exact. Whether a triangle
// touches a sliver is told by the exact sides of its corners; in doubt it does. A doubt can close a cycle that there
// is not, which is then found and cut like any other (cycles.h), but never hides one.
//
// (Max, Williams, Silva 2000, section V, subdivide the problem cell instead.)
//
// Cost of a view: linear in the problem faces, on all cores but for lists. Kept: 8 bytes a cell, 44 a sliver
// and 4 an edge of one.
class PartedCells {
 public:
  // What lies of `cell` beyond the planes of its slivers before this one and on the viewpoint's side of its own.
  struct Sliver {
    mesh::Id cell;
    mesh::Id face : 31;
    mesh::Id second : 1;  // T is the second half of the face
    HalfSpace near;       // the viewpoint's side of the plane of T
  };

  // All must outlive it.
  PartedCells(const mesh::Mesh& mesh, FaceSigns& signs, const ProblemFaces& problems);

  // For the viewpoint that the signs were last found for. Of a problem face that it deals with, signs.interiorBits()
  // then says that the problem cell comes first.
  void part();

  bool any() const { return !slivers_.empty(); }
  // Nodes are the cells and, after them, the slivers.
  std::size_t nodes() const { return mesh_.cell_count() + slivers_.size(); }
  mesh::Id cell(mesh::Id node) const { return node < mesh_.cell_count() ? node : sliver(node).cell; }
  const Sliver& sliver(mesh::Id node) const { return slivers_[node - mesh_.cell_count()]; }
  std::span<const Sliver> slivers(mesh::Id cell) const {
    const std::uint32_t first = slivers_.empty() ? unset : first_[cell];
    if (first == unset) return {};
    std::size_t end = first + std::size_t{1};
    while (end < slivers_.size() && slivers_[end].cell == cell)
      ++end;
    return {slivers_.data() + first, slivers_.data() + end};
  }
  mesh::Id node(const Sliver& sliver) const {
    return static_cast<mesh::Id>(mesh_.cell_count() + static_cast<std::size_t>(&sliver - slivers_.data()));
  }

  // Edges beside those of the faces, for nodes: calls f(successor).
  template <class F>
  void forEachAfter(mesh::Id node, const F& f) const {
    for (std::uint32_t e = first_edge_[node]; e < first_edge_[node + 1]; ++e)
      f(edge_[e]);
  }
  template <class F>
  void forEachEdge(const F& f) const {
    for (const mesh::Id to : edge_)
      f(to);
  }

  // Replaces nodes by cells in the order and writes its cuts, for all that it lists; ids from nodes() on are `pieces`.
  void list(Order& order, std::span<const CellPiece> pieces = {}) const;
  // Of a node that is to be listed next.
  void addCut(mesh::Id node, Order& order) const;
  std::size_t halfSpaces(mesh::Id node) const {
    const auto own = slivers(cell(node));
    return node < mesh_.cell_count() ? own.size() : static_cast<std::size_t>(&sliver(node) - own.data()) + 1;
  }
  // The half-spaces of a node; it is the cell inside all of them.
  void keep(mesh::Id node, std::vector<HalfSpace>& out) const;

  std::size_t bytes() const;

 private:
  static constexpr std::uint32_t unset = 0xFFFFFFFFU;
  // Of a cell's vertices: those strictly on a sliver's side of its plane, those strictly beyond, and the corners of T.
  struct Sides {
    std::uint64_t out = 0, in = 0, t = 0;
  };
  struct Pair {
    mesh::Id from, to;
  };
  struct ProblemFace {
    mesh::Id cell, face;
    unsigned side;  // of the cell
  };

  std::vector<std::uint32_t> group();
  template <class F>
  void forEachHalf(mesh::Id node, const F& f) const;
  void reserveCuts(Order& order) const;
  void putCut(mesh::Id node, std::uint32_t entry, Order& order) const;
  bool partable(mesh::Id problem, mesh::Id other) const;
  void measure(std::size_t i);
  void arrange(std::size_t begin, std::size_t end);
  void collect(const std::vector<std::vector<Pair>>& found);
  void link(mesh::Id cell, std::vector<Pair>& out) const;
  void linkOwn(std::span<const Sliver> own, const Sliver& problem, mesh::Id other, std::vector<Pair>& out) const;
  void linkSlivers(std::span<const Sliver> own, std::size_t i, bool closed, std::vector<Pair>& out) const;
  std::uint64_t corners(mesh::Id cell, mesh::Id face, bool second) const;
  static const Sliver* find(std::span<const Sliver> slivers, mesh::Id face);
  const Sides& sides(const Sliver& sliver) const { return sides_[static_cast<std::size_t>(&sliver - slivers_.data())]; }
  bool touches(std::span<const Sliver> own, std::size_t i, std::uint64_t triangle) const;
  bool meet(const Sliver& a, const Sliver& b) const;

  const mesh::Mesh& mesh_;
  FaceSigns& signs_;
  const ProblemFaces& problems_;
  std::vector<Sliver> slivers_;            // by cell
  std::vector<Sides> sides_;               // beside them, while they are linked
  std::size_t cells_ = 0;                  // that they are cut off
  std::vector<std::uint32_t> first_;       // per cell: its first sliver, or unset
  std::vector<std::uint32_t> first_edge_;  // per node, and the end
  std::vector<mesh::Id> edge_;             // what comes after
};

}  // namespace spillikin::sort
