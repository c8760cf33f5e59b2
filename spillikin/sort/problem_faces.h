// Which cells a ray can leave and enter again through one curved face (Max, Williams, Silva 2000, section V).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/subdivision_pools.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// A quadrilateral is a problem for the cell on one of its sides when the viewpoint lies behind one of its triangles and
// before the other, seen from that cell, and the two make a valley there. For the cell on the other side it is a ridge,
// which a ray meets once on its way in and once on its way out: of two neighbours exactly one has the problem.
//
// The sides of the viewpoint are those of FaceSigns, exact; valley or ridge is the exact side of the fourth corner,
// found once per geometry. A view is then a pass over words of 32 quadrilaterals, and from view to view only faces
// whose state changes are looked at any further. Kept: half a byte a quadrilateral and 4 bytes a cell.
class ProblemFaces {
 public:
  // Both must outlive it.
  ProblemFaces(const mesh::Mesh& mesh, const FaceSigns& signs);

  // For the viewpoint that the signs were last found for. Cost: one pass over 4 bits a quadrilateral, serial (0.1 ms
  // for a million hexahedra), and the changes.
  void update();

  std::size_t faces() const { return faces_; }  // problem faces, exterior ones included
  std::size_t cells() const { return cells_; }  // problem cells
  // The side of a quadrilateral's cell for which it is a valley; 2 where it is planar or no such cell is.
  unsigned valleySide(mesh::Id face) const {
    const std::size_t quad = face - mesh_.triangle_count();
    const auto bits = static_cast<unsigned>(valley_[quad / 32] >> (2 * (quad % 32))) & 3U;
    return bits == 0 ? 2 : bits - 1;
  }
  bool problem(mesh::Id cell) const { return !count_.empty() && (count_[cell] & count_mask) != 0; }
  // Cells that became a problem or ceased to be one in the last update, in no order that matters.
  std::span<const mesh::Id> changed() const { return changed_; }
  std::size_t bytes() const;

 private:
  static constexpr std::uint32_t count_mask = 0x7FFFFFFF, was_problem = 0x80000000;

  const mesh::Mesh& mesh_;
  const FaceSigns& signs_;
  // Two bits a quadrilateral, 32 a word as in FaceSigns: a valley for the cell on side 0, on side 1; a problem for it.
  std::vector<std::uint64_t> valley_, problem_;
  std::vector<std::uint32_t> count_;  // per cell: its problem faces, and whether it was a problem cell
  std::vector<mesh::Id> touched_, changed_;
  std::size_t faces_ = 0, cells_ = 0;
};

// The problem cells of a view and, where cells are to be subdivided, their tetrahedra: kept from view to view.
class ProblemCells {
 public:
  ProblemCells(const mesh::Mesh& mesh, const FaceSigns& signs, CurvedCells curved)
      : faces_(mesh, signs), pools_(mesh), curved_(curved) {}

  // Once the signs of a view are known.
  void begin(Order& order) {
    faces_.update();
    order.problems = {true, faces_.faces(), faces_.cells()};
  }
  const ProblemFaces& faces() const { return faces_; }
  bool subdivides() const { return curved_ == CurvedCells::tetrahedra; }
  // The cell as tetrahedra: whether it is a problem, it is wanted so, and they fill it.
  bool subdivide(mesh::Id cell) { return subdivides() && faces_.problem(cell) && pools_.subdivide(cell); }
  mesh::SubdividedCell operator[](mesh::Id cell) const { return pools_[cell]; }
  // Once the order is known: cells that were not subdivided for it are restored.
  void end() { pools_.restoreOthers(); }

  std::size_t bytes() const { return faces_.bytes() + pools_.bytes(); }

 private:
  ProblemFaces faces_;
  mesh::SubdivisionPools pools_;
  CurvedCells curved_;
};

}  // namespace spillikin::sort
