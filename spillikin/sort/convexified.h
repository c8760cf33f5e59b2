// MPVO on a mesh whose outside is filled.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "spillikin/sort/mpvo.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Max, Williams, Silva 2000, section III, "a final approach": the space between the mesh and its convex hull, holes and
// cavities too, is filled once with tetrahedra (tetgen_filling.h) that are sorted and never listed; beside cells of
// other kinds they are joined to larger convex ones (merged_filling.h). Exact: the filled mesh is convex, which is
// checked. Cost of a view: O(n + e), e filling cells. Keeps a copy of the mesh with them, in which cells with exterior
// quadrilaterals are polyhedra with triangles there (split_exterior.h), for the filling to match.
//
// Throws Error where no filling is found; the message says why.
class Convexified final : public Sorter {
 public:
  explicit Convexified(const mesh::Mesh& mesh);
  // Nothing, unless the mesh is convex once faces with crossed diagonals match, so that nothing need be filled: where
  // hexahedra lie on pyramids and tetrahedra. Cost: that of building the mesh, where it has exterior faces of both
  // kinds.
  static std::unique_ptr<Convexified> withoutFilling(const mesh::Mesh& mesh);
  void operator()(const Viewpoint& viewpoint, Order& order) override;
  Algorithm algorithm() const override { return Algorithm::convexified; }
  std::string why() const override;
  bool exact() const override { return true; }
  std::size_t bytes() const override;
  bool whileSerial(std::function<void()> start) override { return mpvo_->whileSerial(std::move(start)); }

  std::size_t fillingCells() const { return filled_->cell_count() - cells_; }

 private:
  Convexified(const mesh::Mesh& mesh, std::size_t crossed, std::unique_ptr<mesh::Mesh> filled, Convexity convexity);

  std::size_t cells_;        // of the mesh; those after them fill
  std::size_t crossed_ = 0;  // faces (split_exterior.h)
  std::unique_ptr<mesh::Mesh> filled_;
  std::unique_ptr<Mpvo> mpvo_;
  Cuts cuts_;  // scratch
};

}  // namespace spillikin::sort
