// The topological sort of MPVO: counts of what must come first, and a queue worked off layer by layer on all cores.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Edges beside those of the faces: successor[offset[c] .. offset[c + 1]) come after cell c. Empty, or for every cell.
struct ExtraEdges {
  std::vector<mesh::Id> offset;
  std::vector<mesh::Id> successor;
  bool empty() const { return successor.empty(); }
  std::span<const mesh::Id> after(mesh::Id cell) const {
    return {successor.data() + offset[cell], successor.data() + offset[cell + 1]};
  }
};

// Max, Williams, Silva 2000, section III; Williams 1992. The cells that nothing forces back form the first layer; a
// cell joins the layer after the last of those that come before it. Cells of one layer do not obscure each other. Large
// layers are worked off in parallel and listed by ascending id, small ones serially: the order depends on the mesh and
// the signs, never on the number of threads.
//
// Keeps for each way of a cell to a face the cell behind it (16 bytes for a tetrahedron) and per cell a count and the
// bits of its outgoing edges. The mesh must outlive it.
class LayeredSort {
 public:
  explicit LayeredSort(const mesh::Mesh& mesh);

  // Fills cells and layer_offset of the order. Returns the number of cells that could be listed: fewer than all when
  // some are in or behind a cycle; those have left() true.
  std::size_t operator()(const FaceSigns& signs, Order& order, const ExtraEdges* extra = nullptr);

  bool left(mesh::Id cell) const { return count_[cell] != 0; }
  // Calls f(successor) for every cell that must come after this one, by a face of it.
  template <class F>
  void forEachAfter(mesh::Id cell, F&& f) const {
    for (std::size_t k = mesh_.cell_face_offset[cell]; k < mesh_.cell_face_offset[cell + 1]; ++k) {
      if (((after_[k >> 6] >> (k & 63U)) & 1U) != 0) f(neighbour_[k]);
    }
  }
  std::size_t bytes() const;

 private:
  void countEdges(const FaceSigns& signs, const ExtraEdges* extra);
  template <bool parallel, class Emit>
  void release(mesh::Id cell, const ExtraEdges* extra, const Emit& emit);
  void serialLayer(std::size_t begin, std::size_t end, const ExtraEdges* extra, Order& order);
  void parallelLayer(std::size_t begin, std::size_t end, const ExtraEdges* extra, Order& order);
  void appendMarked(Order& order);

  const mesh::Mesh& mesh_;
  bool tetrahedral_ = false;
  std::vector<mesh::Id> neighbour_;         // beside mesh.cell_face: the cell behind the face, or none
  std::vector<std::uint64_t> after_;        // bit k: the cell at neighbour_[k] comes after
  std::vector<std::uint16_t> count_;        // per cell: faces across which another must come first, and 1 for extras
  std::vector<std::uint32_t> extra_count_;  // per cell, only with extra edges
  std::vector<std::uint64_t> marked_;       // bit per cell: belongs to the next layer
  std::vector<std::uint32_t> block_count_;  // of marked bits
};

}  // namespace spillikin::sort
