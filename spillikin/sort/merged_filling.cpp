#include "spillikin/sort/merged_filling.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t most_faces = 48;  // of a cell: all vertices are held against all of them

// Groups of tetrahedra, each a convex cell.
class Merger {
 public:
  Merger(const mesh::Mesh& mesh, std::size_t first) : mesh_(mesh), first_(first) {
    group_.resize(mesh.cell_count() - first);
    std::iota(group_.begin(), group_.end(), 0U);
    faces_.resize(group_.size());
    for (std::size_t g = 0; g < group_.size(); ++g) {
      const auto own = mesh.faces(static_cast<mesh::Id>(first + g));
      faces_[g].assign(own.begin(), own.end());
    }
  }

  std::unique_ptr<mesh::Mesh> operator()() {
    std::vector<std::pair<double, mesh::Id>> between;
    for (mesh::Id f = 0; f < mesh_.triangle_count(); ++f) {
      const auto [a, b] = mesh_.triangle_cells[f];
      if (b != mesh::none && a >= first_ && b >= first_) between.emplace_back(-squaredArea(f), f);
    }
    std::sort(between.begin(), between.end());
    for (const auto& [area, face] : between)
      tryToJoin(face);
    return build();
  }

 private:
  double squaredArea(mesh::Id face) const {
    const auto& t = mesh_.triangle[face];
    const Vec3 u = mesh_.points[t[1]] - mesh_.points[t[0]], v = mesh_.points[t[2]] - mesh_.points[t[0]];
    const Vec3 n(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
    return n.x * n.x + n.y * n.y + n.z * n.z;
  }

  std::uint32_t groupOf(mesh::Id cell) {
    auto g = static_cast<std::uint32_t>(cell - first_);
    while (group_[g] != g)
      g = group_[g] = group_[group_[g]];
    return g;
  }

  // Outward.
  std::array<mesh::Id, 3> corners(mesh::FaceUse use) const {
    const auto& t = mesh_.triangle[use.face()];
    return use.side() == 0 ? t : std::array<mesh::Id, 3>{t[0], t[2], t[1]};
  }

  void tryToJoin(mesh::Id face) {
    const std::uint32_t a = groupOf(mesh_.triangle_cells[face][0]), b = groupOf(mesh_.triangle_cells[face][1]);
    if (a == b) return;
    around_.clear();
    for (const auto& [own, other] : {std::pair{a, b}, std::pair{b, a}}) {
      for (const mesh::FaceUse use : faces_[own]) {
        const mesh::Id beyond = mesh_.neighbour(use);
        if (beyond == mesh::none || beyond < first_ || groupOf(beyond) != other) around_.push_back(use);
      }
    }
    if (around_.size() > most_faces || !convex()) return;
    group_[b] = a;
    faces_[a] = around_;
    faces_[b] = {};
  }

  void gatherVertices(const std::vector<mesh::FaceUse>& faces) {
    vertices_.clear();
    for (const mesh::FaceUse use : faces) {
      const auto& t = mesh_.triangle[use.face()];
      vertices_.insert(vertices_.end(), t.begin(), t.end());
    }
    std::sort(vertices_.begin(), vertices_.end());
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  }

  bool convex() {
    gatherVertices(around_);
    for (const mesh::FaceUse use : around_) {
      const auto c = corners(use);
      for (const mesh::Id v : vertices_) {
        if (v == c[0] || v == c[1] || v == c[2]) continue;
        if (mesh::orient3d(mesh_.points[c[0]], mesh_.points[c[1]], mesh_.points[c[2]], mesh_.points[v]) > 0)
          return false;
      }
    }
    return true;
  }

  std::unique_ptr<mesh::Mesh> build() {
    auto out = std::make_unique<mesh::Mesh>();
    out->name = mesh_.name;
    out->points = mesh_.points;
    out->point_file_id = mesh_.point_file_id;
    copyOthers(*out);
    for (std::uint32_t g = 0; g < group_.size(); ++g) {
      if (group_[g] == g) addCell(g, *out);
    }
    mesh::matchFaces(*out);
    return out;
  }

  void copyOthers(mesh::Mesh& out) const {
    const auto take = [](const auto& from, std::size_t count) {
      return std::decay_t<decltype(from)>(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
    };
    out.cell_type = take(mesh_.cell_type, first_);
    out.cell_file_id = take(mesh_.cell_file_id, first_);
    out.cell_vertex_offset = take(mesh_.cell_vertex_offset, first_ + 1);
    out.cell_vertex = take(mesh_.cell_vertex, out.cell_vertex_offset.back());
    out.polyhedron_index = mesh_.polyhedron_index;
    out.polyhedron_index.resize(first_, mesh::none);
    out.polyhedron_polygons = mesh_.polyhedron_polygons;
    out.polygon_offset = mesh_.polygon_offset;
    out.polygon_vertex = mesh_.polygon_vertex;
    if (out.polyhedron_polygons.empty()) out.polyhedron_polygons.push_back(0);
    if (out.polygon_offset.empty()) out.polygon_offset.push_back(0);
  }

  void addCell(std::uint32_t g, mesh::Mesh& out) {
    out.cell_type.push_back(mesh::CellType::polyhedron);
    out.cell_file_id.push_back(mesh::none);
    out.polyhedron_index.push_back(static_cast<mesh::Id>(out.polyhedron_polygons.size() - 1));
    for (const mesh::FaceUse use : faces_[g]) {
      const auto c = corners(use);
      out.polygon_vertex.insert(out.polygon_vertex.end(), c.begin(), c.end());
      out.polygon_offset.push_back(static_cast<mesh::Id>(out.polygon_vertex.size()));
    }
    out.polyhedron_polygons.push_back(static_cast<mesh::Id>(out.polygon_offset.size() - 1));
    gatherVertices(faces_[g]);
    out.cell_vertex.insert(out.cell_vertex.end(), vertices_.begin(), vertices_.end());
    out.cell_vertex_offset.push_back(static_cast<mesh::Id>(out.cell_vertex.size()));
  }

  const mesh::Mesh& mesh_;
  std::size_t first_;
  std::vector<std::uint32_t> group_;               // per tetrahedron: one of its group, itself for the group's own
  std::vector<std::vector<mesh::FaceUse>> faces_;  // around each group
  std::vector<mesh::FaceUse> around_;              // scratch
  std::vector<mesh::Id> vertices_;                 // scratch
};

}  // namespace

std::unique_ptr<mesh::Mesh> mergeFilling(const mesh::Mesh& mesh, std::size_t first) {
  return Merger(mesh, first)();
}

}  // namespace spillikin::sort
