#include "spillikin/sort/convexified.h"

#include <algorithm>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/sort/merged_filling.h"
#include "spillikin/sort/split_exterior.h"
#include "spillikin/sort/tetgen_filling.h"

namespace spillikin::sort {
namespace {

[[noreturn]] void refuse(const mesh::Mesh& mesh, const std::string& why) {
  throw Error(mesh.name + ": the outside cannot be filled: " + why + "; use --sort auto or --sort xmpvo");
}

std::unique_ptr<mesh::Mesh> fill(mesh::Mesh&& solid, const Filling& filling) {
  auto filled = std::make_unique<mesh::Mesh>(std::move(solid));
  filled->points.insert(filled->points.end(), filling.points.begin(), filling.points.end());
  filled->point_file_id.resize(filled->points.size(), mesh::none);
  for (const auto& t : filling.tetrahedra) {
    filled->cell_vertex.insert(filled->cell_vertex.end(), t.begin(), t.end());
    filled->cell_vertex_offset.push_back(static_cast<mesh::Id>(filled->cell_vertex.size()));
  }
  const std::size_t cells = filled->cell_count() + filling.tetrahedra.size();
  filled->cell_type.resize(cells, mesh::CellType::tetrahedron);
  filled->cell_file_id.resize(cells, mesh::none);
  if (filled->has_polyhedra()) filled->polyhedron_index.resize(cells, mesh::none);
  mesh::matchFaces(*filled);
  return filled;
}

}  // namespace

Convexified::Convexified(const mesh::Mesh& mesh) : cells_(mesh.cell_count()) {
  mesh::Mesh solid = withFillableOutside(mesh, crossed_);
  const auto exterior = exteriorTriangles(solid);
  Filling filling;
  if (!convexity(solid, exterior).convex) filling = fillOutside(solid, exterior);
  if (!filling.failure.empty()) refuse(mesh, filling.failure);
  filled_ = fill(std::move(solid), filling);
  Convexity filled = convexity(*filled_, exteriorTriangles(*filled_));
  if (!filled.convex) refuse(mesh, "what TetGen made is not convex (" + filled.why + ")");
  // A mesh of tetrahedra alone is sorted by a byte a cell: what larger cells save is less than that.
  if (!filled_->tetrahedral()) filled_ = mergeFilling(*filled_, cells_);
  mpvo_ = std::make_unique<Mpvo>(*filled_, std::move(filled));
}

Convexified::Convexified(const mesh::Mesh& mesh, std::size_t crossed, std::unique_ptr<mesh::Mesh> filled,
                         Convexity convexity)
    : cells_(mesh.cell_count()),
      crossed_(crossed),
      filled_(std::move(filled)),
      mpvo_(std::make_unique<Mpvo>(*filled_, std::move(convexity))) {}

std::unique_ptr<Convexified> Convexified::withoutFilling(const mesh::Mesh& mesh) {
  bool triangles = false, quads = false;
  for (const auto& cells : mesh.triangle_cells)
    triangles = triangles || cells[1] == mesh::none;
  for (const auto& cells : mesh.quad_cells)
    quads = quads || cells[1] == mesh::none;
  if (!triangles || !quads) return nullptr;
  std::size_t crossed = 0;
  auto solid = std::make_unique<mesh::Mesh>(withFillableOutside(mesh, crossed));
  Convexity found = convexity(*solid, exteriorTriangles(*solid));
  if (!found.convex) return nullptr;
  return std::unique_ptr<Convexified>(new Convexified(mesh, crossed, std::move(solid), std::move(found)));
}

void Convexified::operator()(const Viewpoint& viewpoint, Order& order) {
  (*mpvo_)(viewpoint, order);
  // Layers and cuts move up as filling cells are taken out.
  std::size_t kept = 0, layer = 1, cut = 0;
  cuts_.clear();
  for (std::size_t i = 0; i < order.cells.size(); ++i) {
    while (layer < order.layer_offset.size() && order.layer_offset[layer] == i) {
      order.layer_offset[layer++] = static_cast<std::uint32_t>(kept);
    }
    const bool keep = order.cells[i] < cells_;
    if (cut < order.cuts.size() && order.cuts[cut].entry == i) {
      if (keep) cuts_.add(static_cast<std::uint32_t>(kept), order.cuts[cut].keep);
      ++cut;
    }
    order.cells[kept] = order.cells[i];
    kept += keep ? 1 : 0;
  }
  for (; layer < order.layer_offset.size(); ++layer)
    order.layer_offset[layer] = static_cast<std::uint32_t>(kept);
  order.layer_offset.erase(std::unique(order.layer_offset.begin(), order.layer_offset.end()), order.layer_offset.end());
  order.cells.resize(kept);
  std::swap(order.cuts, cuts_);
  for (auto& cycle : order.cycles)
    std::erase_if(cycle, [&](mesh::Id c) { return c >= cells_; });
  std::erase_if(order.cycles, [](const auto& cycle) { return cycle.size() < 2; });  // of one cell and what fills
}

std::string Convexified::why() const {
  if (fillingCells() == 0 && crossed_ > 0) {
    return "the mesh is convex once " + std::to_string(crossed_) + " faces with crossed diagonals count as matching";
  }
  return "the space around the mesh is filled with " + std::to_string(fillingCells()) +
         " cells that are never drawn, which makes it convex" +
         (crossed_ == 0 ? "" : "; " + std::to_string(crossed_) + " faces with crossed diagonals count as matching");
}

std::size_t Convexified::bytes() const {
  return mpvo_->bytes() + sort::bytes(*filled_);
}

}  // namespace spillikin::sort
