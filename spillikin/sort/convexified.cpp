#include "spillikin/sort/convexified.h"

#include <algorithm>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/sort/tetgen_filling.h"

namespace spillikin::sort {
namespace {

[[noreturn]] void refuse(const mesh::Mesh& mesh, const std::string& why) {
  throw Error(mesh.name + ": the outside cannot be filled: " + why + "; use --sort auto or --sort xmpvo");
}

std::unique_ptr<mesh::Mesh> fill(const mesh::Mesh& mesh, const Filling& filling) {
  auto filled = std::make_unique<mesh::Mesh>();
  filled->name = mesh.name;
  filled->points = mesh.points;
  filled->points.insert(filled->points.end(), filling.points.begin(), filling.points.end());
  filled->point_file_id = mesh.point_file_id;
  filled->point_file_id.resize(filled->points.size(), mesh::none);
  filled->cell_vertex = mesh.cell_vertex;
  for (const auto& t : filling.tetrahedra)
    filled->cell_vertex.insert(filled->cell_vertex.end(), t.begin(), t.end());
  const std::size_t cells = filled->cell_vertex.size() / 4;
  filled->cell_type.assign(cells, mesh::CellType::tetrahedron);
  filled->cell_vertex_offset.resize(cells + 1);
  for (std::size_t c = 0; c <= cells; ++c)
    filled->cell_vertex_offset[c] = static_cast<mesh::Id>(4 * c);
  filled->cell_file_id = mesh.cell_file_id;
  filled->cell_file_id.resize(cells, mesh::none);
  mesh::matchFaces(*filled);
  return filled;
}

}  // namespace

Convexified::Convexified(const mesh::Mesh& mesh) : cells_(mesh.cell_count()) {
  if (!mesh.tetrahedral()) refuse(mesh, "it has cells other than tetrahedra");
  const auto exterior = exteriorTriangles(mesh);
  Filling filling;
  if (!convexity(mesh, exterior).convex) filling = fillOutside(mesh, exterior);
  if (!filling.failure.empty()) refuse(mesh, filling.failure);
  filled_ = fill(mesh, filling);
  Convexity filled = convexity(*filled_, exteriorTriangles(*filled_));
  if (!filled.convex) refuse(mesh, "what TetGen made is not convex (" + filled.why + ")");
  mpvo_ = std::make_unique<Mpvo>(*filled_, std::move(filled));
}

void Convexified::operator()(const Viewpoint& viewpoint, Order& order) {
  (*mpvo_)(viewpoint, order);
  // Layers and cuts move up as filling cells are taken out.
  std::size_t kept = 0, layer = 1, cut = 0, cuts_kept = 0;
  for (std::size_t i = 0; i < order.cells.size(); ++i) {
    while (layer < order.layer_offset.size() && order.layer_offset[layer] == i) {
      order.layer_offset[layer++] = static_cast<std::uint32_t>(kept);
    }
    const bool keep = order.cells[i] < cells_;
    if (cut < order.cuts.size() && order.cuts[cut].entry == i) {
      if (keep) {
        if (cuts_kept != cut) order.cuts[cuts_kept] = std::move(order.cuts[cut]);
        order.cuts[cuts_kept++].entry = static_cast<std::uint32_t>(kept);
      }
      ++cut;
    }
    order.cells[kept] = order.cells[i];
    kept += keep ? 1 : 0;
  }
  for (; layer < order.layer_offset.size(); ++layer)
    order.layer_offset[layer] = static_cast<std::uint32_t>(kept);
  order.layer_offset.erase(std::unique(order.layer_offset.begin(), order.layer_offset.end()), order.layer_offset.end());
  order.cells.resize(kept);
  order.cuts.resize(cuts_kept);
  for (auto& cycle : order.cycles) {
    cycle.erase(std::remove_if(cycle.begin(), cycle.end(), [&](mesh::Id c) { return c >= cells_; }), cycle.end());
  }
}

std::string Convexified::why() const {
  return "the space around the mesh is filled with " + std::to_string(fillingCells()) +
         " cells that are never drawn, which makes it convex";
}

std::size_t Convexified::bytes() const {
  const mesh::Mesh& m = *filled_;
  return mpvo_->bytes() + m.points.capacity() * sizeof(Vec3) + m.triangle.capacity() * 12 +
         m.triangle_cells.capacity() * 8 +
         4 * (m.point_file_id.capacity() + m.cell_vertex.capacity() + m.cell_vertex_offset.capacity() +
              m.cell_file_id.capacity() + m.cell_face.capacity() + m.cell_face_offset.capacity()) +
         m.cell_type.capacity();
}

}  // namespace spillikin::sort
