// The topological sort of MPVO: counts of what must come first, and a queue worked off layer by layer on all cores.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/parted_cells.h"
#include "spillikin/sort/sort.h"
#include "spillikin/sort/tetrahedron_states.h"
#include "spillikin/sort/turns.h"

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
// Kept: for each way of a cell to a face the cell behind it (16 bytes for a tetrahedron), and what changes with the
// view: for a tetrahedron one byte, which holds the count of what must come before it and which neighbours come after,
// so that the queue's random accesses of a million cells fit into a core's own cache. The mesh must outlive it.
class LayeredSort {
 public:
  explicit LayeredSort(const mesh::Mesh& mesh);

  // Fills cells and layer_offset of the order. Returns whether all could be listed: not when some are in or behind a
  // cycle; those have left() true.
  //
  // `turn`, for each cell, if given: every cell takes the latest turn of its own and of those before it. `parted`, if
  // given, which must be so until the next call: nodes take the place of cells throughout, in the order too.
  bool operator()(const FaceSigns& signs, Order& order, const ExtraEdges* extra = nullptr, Turn* turn = nullptr,
                  const PartedCells* parted = nullptr);

  // `start` is called in each call when its passes over all cells are done and the queue begins, most of which is
  // worked off by one core. Empty: nothing is.
  void whileSerial(std::function<void()> start) { start_ = std::move(start); }

  // Of the last call: cells, and slivers after them.
  std::size_t nodes() const { return parted_ == nullptr ? mesh_.cell_count() : parted_->nodes(); }
  const PartedCells* parted() const { return parted_; }
  mesh::Id cell(mesh::Id node) const { return parted_ == nullptr ? node : parted_->cell(node); }
  bool left(mesh::Id cell) const { return (tetrahedral_ ? state_[cell] & state_count : count_[cell]) != 0; }
  // Calls f(successor) for every cell that must come after this one, by a face of it or inside a parted cell.
  template <class F>
  void forEachAfter(mesh::Id cell, F&& f) const {
    if (tetrahedral_) {
      for (unsigned k = 0; k < 4; ++k) {
        if ((state_[cell] & (state_first_after << k)) != 0) f(neighbour_[4 * std::size_t{cell} + k]);
      }
      return;
    }
    if (cell < mesh_.cell_count()) {
      for (std::size_t k = mesh_.cell_face_offset[cell]; k < mesh_.cell_face_offset[cell + 1]; ++k) {
        if (((after_[k >> 6] >> (k & 63U)) & 1U) != 0) f(neighbour_[k]);
      }
    }
    if (parted_ != nullptr) parted_->forEachAfter(cell, f);
  }
  std::size_t bytes() const;

 private:
  void countTetrahedra(const FaceSigns& signs);
  void countCells(const FaceSigns& signs);
  void countParted();
  void countExtra(const ExtraEdges& extra);
  void firstLayer(Order& order);
  template <bool tetrahedral, bool parallel, bool turns, class Emit>
  void release(mesh::Id cell, const Emit& emit);
  template <bool tetrahedral, bool turns>
  void workOff(Order& order);
  template <bool tetrahedral, bool turns>
  void serialLayer(std::size_t begin, std::size_t end, Order& order);
  template <bool tetrahedral, bool turns>
  void parallelLayer(std::size_t begin, std::size_t end, Order& order);
  template <bool tetrahedral>
  void prefetchRow(mesh::Id cell) const;
  void appendMarked(Order& order);

  const mesh::Mesh& mesh_;
  std::function<void()> start_;
  bool tetrahedral_ = false;
  const ExtraEdges* extra_ = nullptr;       // of the call
  Turn* turn_ = nullptr;                    // of the call
  const PartedCells* parted_ = nullptr;     // of the call, where cells are parted
  std::size_t listed_ = 0;                  // cells in the order so far
  std::vector<mesh::Id> neighbour_;         // beside mesh.cell_face: the cell behind the face, or none
  std::vector<std::uint8_t> state_;         // of tetrahedra, see tetrahedron_states.h
  std::vector<std::uint64_t> after_;        // other cells: bit k, the cell at neighbour_[k] comes after
  std::vector<std::uint16_t> count_;        // other nodes: edges from what must come first, 1 for all extras
  std::vector<std::uint32_t> extra_count_;  // per cell, only with extra edges
  std::vector<std::uint64_t> marked_;       // bit per cell: belongs to the next layer
  std::vector<std::uint32_t> block_count_;  // of marked bits
};

}  // namespace spillikin::sort
