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
// Cost of a view: linear in the problem faces, on all cores but for lists. Kept: 8 bytes a cell.
class PartedCells {
 public:
  // What lies of `cell` beyond the planes of its slivers before this one and on the viewpoint's side of its own.
  struct Sliver {
    mesh::Id cell, face;
    HalfSpace near;  // the viewpoint's side of the plane of T
    bool second;     // T is the second half of the face
    // Of the cell's vertices: those strictly on that side, those strictly beyond, and the corners of T.
    std::uint64_t out = 0, in = 0, t = 0;
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
    const std::uint32_t g = slivers_.empty() ? unset : group_[cell];
    if (g == unset) return {};
    return {slivers_.data() + begin_[g], slivers_.data() + begin_[g + 1]};
  }
  mesh::Id node(const Sliver& sliver) const {
    return static_cast<mesh::Id>(mesh_.cell_count() + static_cast<std::size_t>(&sliver - slivers_.data()));
  }

  // Edges beside those of the faces, for nodes: calls f(successor).
  template <class F>
  void forEachAfter(mesh::Id node, const F& f) const {
    for (std::uint32_t e = head_[node]; e != unset; e = edges_[e].next)
      f(edges_[e].to);
  }
  template <class F>
  void forEachEdge(const F& f) const {
    for (const Edge& edge : edges_)
      f(edge.to);
  }

  // Replaces nodes by cells in the order and writes its cuts, for all that it lists; ids from nodes() on are `pieces`.
  void list(Order& order, std::span<const CellPiece> pieces = {}) const;
  // Of a node that is to be listed next.
  void addCut(mesh::Id node, Order& order) const;
  // The half-spaces of a node; it is the cell inside all of them.
  void keep(mesh::Id node, std::vector<HalfSpace>& out) const;

  std::size_t bytes() const;

 private:
  static constexpr std::uint32_t unset = 0xFFFFFFFFU;
  struct Edge {
    mesh::Id to;
    std::uint32_t next;
  };
  struct Pair {
    mesh::Id from, to;
  };
  struct ProblemFace {
    mesh::Id cell, face;
    unsigned side;  // of the cell
  };

  void group();
  bool partable(mesh::Id problem, mesh::Id other) const;
  void measure(Sliver& sliver) const;
  void arrange(std::span<Sliver> own) const;
  void link(std::uint32_t group, std::vector<Pair>& out) const;
  void linkOwn(std::span<const Sliver> own, const Sliver& problem, mesh::Id other, std::vector<Pair>& out) const;
  void linkSlivers(std::span<const Sliver> own, std::size_t i, bool closed, std::vector<Pair>& out) const;
  std::uint64_t corners(mesh::Id cell, mesh::Id face, bool second) const;
  static const Sliver* find(std::span<const Sliver> slivers, mesh::Id face);
  static bool touches(std::span<const Sliver> own, std::size_t i, std::uint64_t triangle);
  bool meet(const Sliver& a, const Sliver& b) const;

  const mesh::Mesh& mesh_;
  FaceSigns& signs_;
  const ProblemFaces& problems_;
  std::vector<ProblemFace> faces_;
  std::vector<Sliver> slivers_;       // by cell
  std::vector<std::uint32_t> group_;  // per cell, of its slivers, or unset
  std::vector<std::uint32_t> begin_;  // per group, and the end
  std::vector<mesh::Id> parted_;      // the cells of the groups
  std::vector<std::uint32_t> head_;   // per node: its first edge, or unset
  std::vector<Edge> edges_;
  std::vector<std::vector<Pair>> found_;  // by block of groups
};

}  // namespace spillikin::sort
