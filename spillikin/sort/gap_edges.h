// Which cells order each other across empty space.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/sort/exterior_tree.h"
#include "spillikin/sort/exterior_windows.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/layered_sort.h"

namespace spillikin::sort {

// A ray that leaves the mesh through an exterior triangle and enters it again through another orders their cells. Found
// by their windows in the view, searched for what each triangle turned towards the viewpoint may lie behind; exact
// predicates decide, but an overlap no wider than a sliver (triangle_order.h) orders nothing.
//
// Each of two such triangles must reach beyond the other's plane. Those that can face no other, as on the convex hull,
// are found once, exactly, and left out: here, the tree has the others alone.
//
// A quadrilateral that abuts two triangles with the other diagonal leaves gaps or overlaps of no account between them:
// its two sides are taken for one face, whichever is nearer.
using CellPairs = std::vector<std::pair<mesh::Id, mesh::Id>>;  // (behind, front)

enum class Exterior : std::uint8_t { facing, all };  // triangles: those that may face another, or all

class GapEdges {
 public:
  GapEdges(const mesh::Mesh& mesh, const FaceSigns& signs, Exterior exterior = Exterior::facing);

  // Reads the signs of the last view, which must be of this viewpoint. Cost: O(b log b + k) for b triangles and k pairs
  // that lie behind one another, on all cores.
  void operator()(const Viewpoint& viewpoint, ExtraEdges& out);

  // Of the same pairs only such whose cells have one group, by cell, which is not none: appended, (behind, front).
  // Cost: a search for each of their triangles turned towards the viewpoint.
  void inside(const Viewpoint& viewpoint, std::span<const mesh::Id> group, CellPairs& out);

  // Does a ray leave through `exit` (turned away) and then enter through `entry` (turned towards the viewpoint)?
  bool related(std::uint32_t exit, std::uint32_t entry, const Viewpoint& viewpoint) const;

  // Whether related() can be true of t and any other triangle, as exit or entry, from any viewpoint: each of the two
  // must reach beyond the other's plane. False is certain; true where too many triangles lie near. Cost: logarithmic.
  bool facesAny(std::uint32_t t) const;

  const ExteriorTree& tree() const { return tree_; }
  const ExteriorWindows& windows() const { return *windows_; }
  ExteriorWindows& windows() { return *windows_; }
  // Pairs of exterior triangles of different cells that are taken for one face; few.
  const std::vector<std::pair<std::uint32_t, std::uint32_t>>& abutting() const { return abutting_; }
  // The first pair of cells whose exterior triangles cross, but for the sides of one face; none of either when no two
  // do. Where cells overlap no order is right.
  const std::array<mesh::Id, 2>& overlapping() const { return overlapping_; }
  std::span<const std::uint32_t> trianglesOf(mesh::Id cell) const;
  int sign(std::uint32_t triangle) const { return signs_.sign(row_[triangle]); }
  std::size_t bytes() const;

 private:
  void keepFacing();
  void index();
  void pairNonmatching();
  std::array<mesh::Id, 2> findOverlapping() const;
  void findAll(const Viewpoint& viewpoint, std::span<const mesh::Id> group);
  enum class Beside : std::uint8_t { no, yes, unsure };
  template <class Orient>
  Beside within(std::uint32_t triangle, std::uint32_t other, const Orient& orient) const;
  bool turnedAway(std::uint32_t a, std::uint32_t b) const;
  bool mayFace(std::uint32_t a, std::uint32_t b) const;
  bool clearlyWithin(std::uint32_t triangle, std::uint32_t other) const;
  bool oneFace(std::uint32_t a, std::uint32_t b) const {
    return partner_[a] != mesh::none && partner_[a] == partner_[b];
  }

  const mesh::Mesh& mesh_;
  const FaceSigns& signs_;
  ExteriorTree tree_;
  std::optional<ExteriorWindows> windows_;  // once the tree is as it stays
  std::array<mesh::Id, 2> overlapping_;
  std::vector<std::size_t> row_;   // of FaceSigns, for each triangle of the tree
  std::vector<Vec3> normal_;       // of each, outward, unit length; zero where rounding spoils it
  double clear_ = 0.0;             // world units: no height over such a plane is wrong by as much
  std::vector<mesh::Id> partner_;  // a quadrilateral face that it is half of, or that it and another abut, or none
  std::vector<std::pair<std::uint32_t, std::uint32_t>> abutting_;
  std::vector<std::uint32_t> by_cell_;   // triangles by ascending cell
  std::vector<std::uint32_t> first_of_;  // per cell + 1: where its triangles begin there
  std::vector<CellPairs> found_;         // by fixed block of triangles
};

// Edges by the cell behind, in the sequence of the pairs.
void setEdges(const CellPairs& pairs, std::size_t cells, ExtraEdges& out);

// A sentence that names two cells by their file ids.
std::string overlapMessage(const mesh::Mesh& mesh, const std::array<mesh::Id, 2>& cells);

// What completing an order needs to know of gaps: the edges found for the view and who found them.
struct Gaps {
  const GapEdges& finder;
  const ExtraEdges& edges;
};

}  // namespace spillikin::sort
