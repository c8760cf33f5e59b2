// Cells that are tetrahedra for the time being, in blocks that are taken and given back (Max, Williams, Silva 2000, V).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/subdivide.h"

namespace spillikin::mesh {

// A face between two tetrahedra of one cell; its normal (right hand) points from tetrahedron[0] to tetrahedron[1],
// which are places in the block.
struct InnerFace {
  std::array<Id, 3> vertex{};
  std::array<std::uint8_t, 2> tetrahedron{};
};

// One subdivided cell, as views into its block: good until the next subdivide(). `outer[t]` is the tetrahedron that has
// triangle t of surface(parent): what the pointers of a face's two triangles are turned to while the cell is
// subdivided.
struct SubdividedCell {
  Id parent = none;
  std::span<const Tetrahedron> tetrahedra;
  std::span<const InnerFace> inner;
  std::span<const std::uint8_t> outer;
};

// The paper's four large arrays: blocks of 2, 3, 5 and 6 tetrahedra with the faces between them, together in memory,
// each array with a list of its unused blocks. A cell that is asked for again keeps its block; one that is not is
// restored, which costs nothing but its place in the list. The mesh must outlive the pools with its points unchanged.
class SubdivisionPools {
 public:
  explicit SubdivisionPools(const Mesh& mesh);

  // Whether the cell is now subdivided, that is, whether its tetrahedra fill it: all have positive volume, exactly.
  // Prisms of five and more sides, polyhedra and cells too twisted for the smallest-vertex rule are left whole. A cell
  // that already is subdivided is only marked. Cost: a microsecond for a cell that was not, in proportion to nothing
  // else.
  bool subdivide(Id cell);
  // Gives back the blocks of all cells that subdivide() was not called for since the last call, in the number of
  // subdivided cells.
  void restoreOthers();

  bool subdivided(Id cell) const { return cell < block_.size() && block_[cell] != none; }
  SubdividedCell operator[](Id cell) const;  // of a subdivided one

  std::size_t size() const { return cells_.size(); }  // subdivided cells
  std::size_t made() const { return made_; }          // blocks filled since the beginning
  std::array<std::size_t, 4> blocks() const;          // in each array, used or not
  std::array<std::size_t, 4> unused() const;          // of these
  std::size_t bytes() const;

 private:
  template <std::size_t tetrahedra, std::size_t inner, std::size_t outer>
  struct Block {
    Id parent = none;
    std::array<Tetrahedron, tetrahedra> tetrahedron{};
    std::array<InnerFace, inner> between{};
    std::array<std::uint8_t, outer> at{};
    SubdividedCell view() const { return {parent, tetrahedron, between, at}; }
  };
  template <class B>
  struct Pool {
    std::vector<B> blocks;
    std::vector<Id> unused;
    Id take();
  };
  template <class P>
  bool fill(P& pool, unsigned which, Id cell);
  bool fillsTheCell() const;

  const Mesh& mesh_;
  Pool<Block<2, 1, 6>> pyramids_;
  Pool<Block<3, 2, 8>> wedges_;
  Pool<Block<5, 4, 12>> five_;
  Pool<Block<6, 6, 12>> six_;
  std::vector<Id> block_;             // per cell, once there is one: 4 * block + array, or none
  std::vector<Id> cells_;             // the subdivided ones
  std::vector<std::uint8_t> wanted_;  // beside cells_: asked for since the last restoreOthers()
  std::vector<Id> place_;             // per cell: where it stands in cells_
  std::size_t made_ = 0;
  std::vector<Tetrahedron> pieces_;  // of the cell in hand
  Surface boundary_;
};

}  // namespace spillikin::mesh
