// Breaks a visibility cycle by cutting cells of it.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "spillikin/mesh/subdivide.h"
#include "spillikin/mesh/subdivision_pools.h"
#include "spillikin/sort/convex_polygons.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/parted_cells.h"
#include "spillikin/sort/problem_faces.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Orders the cells of one strongly connected component. While the pieces are cyclic, a shortest cycle is taken, and of
// it a piece and the plane of a face of one of its cells that parts what lies behind the piece from what lies before
// it, with the former on the viewpoint's side: of the two halves the far one comes first, and nothing leads from the
// near one back to it. Where no face's plane does, one through the viewpoint and an edge is taken. The relations of a
// cut piece are those of the parts of its faces (the purpose of MPVOC: Kraus and Ertl 2001). Where cycles are long and
// many, as around the middle of a pinwheel, cutting them one by one leaves the others: a plane through the viewpoint
// then cuts all pieces in its way, and nothing on one side of it has to do with anything on the other.
//
// Which pieces are related at first is exact; the parts of faces are clipped in double, and what is thinner than
// `thin` times the extent of the component is dropped.
class CycleCutter {
 public:
  // `gaps`, which may be null: rays leave the mesh and enter it again. `problems`: the problem cells of the view,
  // which are subdivided first where that is wanted. `parted`, which may be null: the parts that cells are in.
  CycleCutter(const mesh::Mesh& mesh, const FaceSigns& signs, const Viewpoint& viewpoint, const Gaps* gaps,
              ProblemCells& problems, const PartedCells* parted);

  // Of cells, or of nodes of parted cells. Appends the cells to the order, with the pieces of cut ones in order.cuts.
  // Returns false when it gave up, as for cells that overlap, or after `most_cuts` per cell: it then ignores the
  // relation of a cycle that is seen through the smallest window, one after the other, until there is an order;
  // thousands of cells that stay cyclic are sorted by depth.
  bool operator()(std::span<const mesh::Id> component, Order& order);

  static constexpr double thin = 1e-9;
  static constexpr std::size_t most_cuts = 6;

 private:
  using Polygon = ConvexPolygon;
  struct Piece {
    mesh::Id cell;
    std::vector<HalfSpace> keep;
    mesh::Id node;  // that it is (part of), none for a tetrahedron
  };
  // A triangular face, or half of a quadrilateral.
  struct Half {
    mesh::Id face;
    bool second;
  };
  // `from` comes before `to`. Across a gap the ray enters `from` through `entry` and leaves `to` through `exit`; a
  // shared face has an `exit` alone.
  struct Edge {
    std::uint32_t from, to;
    Polygon exit, entry;
  };
  struct Plane {
    HalfSpace half;  // unit normal
    int viewer;      // its side of the plane, 0 on it
  };
  struct Choice {
    std::uint32_t piece = 0;
    Plane plane{};
    std::size_t crossed = 0;  // edges that stay in the way
    bool found = false;
  };
  using Nodes = std::vector<std::uint32_t>;
  using Edges = std::vector<std::uint32_t>;

  void gather(std::span<const mesh::Id> nodes);
  double tolerance() const;
  void makePieces();
  void makeTetrahedra(const mesh::SubdividedCell& cell);
  void keepInside(const mesh::SubdividedCell& cell, std::size_t tetrahedron, Piece& piece) const;
  template <class F>
  void forEachPieceAt(std::uint32_t i, const Half& half, Polygon polygon, const F& f);
  Polygon bounding(const Piece& piece, const Half& half, Polygon polygon);
  std::uint32_t triangleOf(mesh::Id cell, const Half& half) const;
  void faceEdges();
  void partEdges();
  void gapEdges();
  void gapsBetween(std::uint32_t i, std::uint32_t j);
  void addHalf(std::uint32_t i, std::uint32_t j, const Half& half, std::size_t row,
               const std::array<mesh::Id, 3>& corner);
  void narrow(Edge& edge);
  bool resolve(Nodes nodes, Edges edges, std::size_t long_rounds, Order& order);
  void dropLeast(const Edges& cycle);
  Choice chooseCut(const Edges& cycle) const;
  void indexNodes(const Nodes& nodes, const Edges& edges);
  bool cutSome(Nodes& nodes, Edges& edges, std::size_t& long_rounds);
  void dropEmpty(Edges& edges) const;
  bool splitInTwo(Nodes& nodes, Edges& edges);
  void splitBy(const HalfSpace& half, const Nodes& crossed, Nodes& nodes, Edges& edges);
  void addPart(std::uint32_t piece, const HalfSpace& half);
  void findSides(const HalfSpace& half, const Edges& edges, std::vector<std::uint8_t>& sides) const;
  Edges shortestCycle(const Nodes& nodes, std::uint32_t root, std::size_t reach);
  void facePlanes(mesh::Id cell, std::vector<Plane>& out) const;
  void eyePlanes(Polygon polygon, std::vector<Plane>& out) const;
  Choice chooseCut(const Edges& cycle, const std::vector<Plane>& planes) const;
  void cut(const Choice& choice, const Edges& at_piece, Nodes& nodes, Edges& edges);
  void emit(std::uint32_t node, Order& order) const;
  void emitByDepth(const Nodes& nodes, Order& order) const;
  bool isSeen(Polygon polygon) const;
  bool areSeenTogether(Polygon a, Polygon b) const;
  std::vector<Polygon> section(const Piece& piece, const HalfSpace& half);

  const mesh::Mesh& mesh_;
  const FaceSigns& signs_;
  Viewpoint viewpoint_;
  const Gaps* gaps_;
  ProblemCells& problems_;
  const PartedCells* parted_;
  std::size_t cuts_left_ = 0;
  std::size_t large_rounds_ = 0;
  std::vector<Piece> pieces_;
  // Of each piece, whether a search for a short cycle through it found none. It would find none later either: a cut
  // makes no cycle shorter, since any cycle is one of before with the halves for one.
  std::vector<std::uint8_t> on_no_short_cycle_;
  ConvexPolygons polygons_;  // of the edges
  std::vector<Edge> edges_;
  std::vector<std::pair<mesh::Id, mesh::Id>> by_cell_;  // the nodes of the component, with their cells first
  std::vector<mesh::Id> cells_;                         // of the component, ascending
  std::vector<std::uint32_t> first_piece_;              // of each of them, and the end
  // Of the nodes in hand, by their place among them:
  std::vector<std::uint32_t> local_;  // piece to place
  std::vector<Edges> incident_;
  std::vector<std::uint32_t> came_by_;  // the edge by which a search came, unset between searches
};

}  // namespace spillikin::sort
