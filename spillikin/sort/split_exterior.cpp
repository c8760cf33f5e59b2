#include "spillikin/sort/split_exterior.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/place.h"
#include "spillikin/mesh/predicates.h"
#include "spillikin/sort/convexity.h"

namespace spillikin::sort {
namespace {

using Corners = std::array<mesh::Id, 3>;
// By exterior face: the triangles, outward, that take its place.
using Replacement = std::map<mesh::Id, std::vector<Corners>>;

Corners placed(const mesh::Mesh& mesh, Corners c) {
  for (mesh::Id& v : c)
    v = mesh::place(mesh, v);
  std::sort(c.begin(), c.end());
  return c;
}

// The mesh with some exterior faces replaced, and with more points.
class Rebuilder {
 public:
  Rebuilder(const mesh::Mesh& mesh, const Replacement& faces, std::vector<Vec3> points) : mesh_(mesh), faces_(faces) {
    out_.name = mesh.name;
    out_.points = std::move(points);
    out_.point_file_id = mesh.point_file_id;
    out_.point_file_id.resize(out_.points.size(), mesh::none);
    out_.cell_file_id = mesh.cell_file_id;
    out_.cell_vertex_offset.push_back(0);
    out_.polyhedron_polygons.push_back(0);
    out_.polygon_offset.push_back(0);
  }

  mesh::Mesh operator()() {
    for (mesh::Id c = 0; c < mesh_.cell_count(); ++c)
      addCell(c);
    mesh::matchFaces(out_);
    return std::move(out_);
  }

 private:
  void addCell(mesh::Id c) {
    const auto uses = mesh_.faces(c);
    const bool changed =
        std::ranges::any_of(uses, [&](const mesh::FaceUse use) { return faces_.contains(use.face()); });
    if (changed || mesh_.cell_type[c] == mesh::CellType::polyhedron) return addPolyhedron(c, uses);
    const auto vertices = mesh_.vertices(c);
    out_.cell_vertex.insert(out_.cell_vertex.end(), vertices.begin(), vertices.end());
    out_.cell_vertex_offset.push_back(static_cast<mesh::Id>(out_.cell_vertex.size()));
    out_.cell_type.push_back(mesh_.cell_type[c]);
    if (!out_.polyhedron_index.empty()) out_.polyhedron_index.push_back(mesh::none);
  }

  void addPolyhedron(mesh::Id c, std::span<const mesh::FaceUse> uses) {
    out_.cell_type.push_back(mesh::CellType::polyhedron);
    out_.polyhedron_index.resize(c, mesh::none);
    out_.polyhedron_index.push_back(static_cast<mesh::Id>(out_.polyhedron_polygons.size() - 1));
    const auto vertices = mesh_.vertices(c);
    std::vector<mesh::Id> all(vertices.begin(), vertices.end());
    std::size_t slot = 0;
    mesh::forEachPolygon(mesh_, c, [&](std::span<const mesh::Id> polygon) {
      const std::size_t count = polygon.size() <= 4 ? 1 : polygon.size() - 2;
      const auto own = uses.subspan(slot, count);
      slot += count;
      const auto replaced = [&](const mesh::FaceUse use) { return faces_.contains(use.face()); };
      if (std::ranges::none_of(own, replaced)) return addPolygon(polygon);
      std::size_t k = 0;
      const auto add = [&](const Corners& t) {
        addPolygon(t);
        all.insert(all.end(), t.begin(), t.end());
      };
      if (count == 1) {
        for (const Corners& t : faces_.at(own[0].face()))
          add(t);
        return;
      }
      mesh::forEachTriangle(polygon, [&](mesh::Id a, mesh::Id b, mesh::Id d) {
        const auto found = faces_.find(own[k++].face());
        if (found == faces_.end()) return add({a, b, d});
        for (const Corners& t : found->second)
          add(t);
      });
    });
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    out_.cell_vertex.insert(out_.cell_vertex.end(), all.begin(), all.end());
    out_.cell_vertex_offset.push_back(static_cast<mesh::Id>(out_.cell_vertex.size()));
    out_.polyhedron_polygons.push_back(static_cast<mesh::Id>(out_.polygon_offset.size() - 1));
  }

  void addPolygon(std::span<const mesh::Id> polygon) {
    out_.polygon_vertex.insert(out_.polygon_vertex.end(), polygon.begin(), polygon.end());
    out_.polygon_offset.push_back(static_cast<mesh::Id>(out_.polygon_vertex.size()));
  }

  const mesh::Mesh& mesh_;
  const Replacement& faces_;
  mesh::Mesh out_;
};

// Exterior quadrilaterals as triangles: all, or only those that lie against two triangles. Counts those that do with
// the other diagonal.
Replacement triangulated(const mesh::Mesh& mesh, bool all, std::size_t& crossed) {
  std::vector<Corners> triangles;
  for (std::size_t f = 0; f < mesh.triangle_count(); ++f) {
    if (mesh.triangle_cells[f][1] == mesh::none) triangles.push_back(placed(mesh, mesh.triangle[f]));
  }
  std::sort(triangles.begin(), triangles.end());
  const auto known = [&](const Corners& t) {
    return std::binary_search(triangles.begin(), triangles.end(), placed(mesh, t));
  };
  Replacement faces;
  for (std::size_t q = 0; q < mesh.quad_count(); ++q) {
    if (mesh.quad_cells[q][1] != mesh::none) continue;
    const auto& [a, b, c, d] = mesh.quad[q];
    const bool other = known({a, b, d}) && known({b, c, d});
    crossed += other ? 1 : 0;
    if (!other && !all && !(known({a, b, c}) && known({a, c, d}))) continue;
    faces[static_cast<mesh::Id>(mesh.triangle_count() + q)] =
        other ? std::vector<Corners>{{a, b, d}, {b, c, d}} : std::vector<Corners>{{a, b, c}, {a, c, d}};
  }
  return faces;
}

// Exterior triangular faces on four points: two with a diagonal against two with the other.
class CrossedDiagonals {
 public:
  explicit CrossedDiagonals(const mesh::Mesh& mesh)
      : mesh_(mesh), exterior_(exteriorTriangles(mesh)), points_(mesh.points) {
    std::erase_if(exterior_, [&](const ExteriorTriangle& t) { return t.face >= mesh.triangle_count(); });
  }

  mesh::Mesh resolve(std::size_t& crossed) {
    fileEdges();
    for (const auto& [edge, triangles] : edges_) {
      for (const std::size_t i : triangles) {
        for (const std::size_t j : triangles) {
          if (i < j) halve(i, j);
        }
      }
    }
    crossed += faces_.size() / 4;
    return faces_.empty() ? mesh_ : Rebuilder(mesh_, faces_, std::move(points_))();
  }

 private:
  using Edge = std::pair<mesh::Id, mesh::Id>;

  void fileEdges() {
    for (std::size_t i = 0; i < exterior_.size(); ++i) {
      const Corners& c = exterior_[i].corner;
      for (std::size_t k = 0; k < 3; ++k) {
        const mesh::Id a = mesh::place(mesh_, c[k]), b = mesh::place(mesh_, c[(k + 1) % 3]);
        edges_[{std::min(a, b), std::max(a, b)}].push_back(i);
      }
      by_place_[placed(mesh_, c)].push_back(i);
    }
  }

  // The triangle on these places that is turned against i, of a cell of neither i nor j, or none.
  std::size_t against(Corners c, std::size_t i, std::size_t j) const {
    std::sort(c.begin(), c.end());
    const auto found = by_place_.find(c);
    if (found == by_place_.end()) return exterior_.size();
    for (const std::size_t t : found->second) {
      if (exterior_[t].cell != exterior_[i].cell && exterior_[t].cell != exterior_[j].cell && turned(t, i) < 0.0)
        return t;
    }
    return exterior_.size();
  }

  double turned(std::size_t i, std::size_t j) const {
    const Vec3 n = normal(i), m = normal(j);
    return n.x * m.x + n.y * m.y + n.z * m.z;
  }
  Vec3 normal(std::size_t i) const {
    const Corners& c = exterior_[i].corner;
    const Vec3 u = points_[c[1]] - points_[c[0]], v = points_[c[2]] - points_[c[0]];
    return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
  }
  // The corner that is not on the edge.
  mesh::Id apex(std::size_t i, const Edge& edge) const {
    for (const mesh::Id v : exterior_[i].corner) {
      const mesh::Id p = mesh::place(mesh_, v);
      if (p != edge.first && p != edge.second) return p;
    }
    return edge.first;
  }

  void halve(std::size_t i, std::size_t j) {
    const Corners si = placed(mesh_, exterior_[i].corner), sj = placed(mesh_, exterior_[j].corner);
    std::vector<mesh::Id> both;
    std::set_intersection(si.begin(), si.end(), sj.begin(), sj.end(), std::back_inserter(both));
    if (both.size() != 2 || turned(i, j) <= 0.0) return;
    const Edge diagonal{both[0], both[1]};
    const Edge other{apex(i, diagonal), apex(j, diagonal)};
    const std::size_t k = against({other.first, other.second, diagonal.first}, i, j);
    const std::size_t l = against({other.first, other.second, diagonal.second}, i, j);
    if (k == exterior_.size() || l == exterior_.size() || turned(k, l) <= 0.0) return;
    const Corners& c = exterior_[i].corner;
    // A gap is the filling's.
    if (mesh::orient3d(points_[c[0]], points_[c[1]], points_[c[2]], points_[other.second]) > 0) return;
    for (const std::size_t t : {i, j, k, l}) {
      if (faces_.contains(exterior_[t].face)) return;
    }
    const auto middle = static_cast<mesh::Id>(points_.size());
    points_.push_back(crossing(diagonal, other));
    cut(i, diagonal, middle);
    cut(j, diagonal, middle);
    cut(k, other, middle);
    cut(l, other, middle);
  }

  // The mean of the points where the diagonals are nearest to each other.
  Vec3 crossing(const Edge& one, const Edge& two) const {
    const Vec3 p = points_[one.first], u = points_[one.second] - p, q = points_[two.first], v = points_[two.second] - q,
               w = q - p;
    const auto dot = [](const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), det = uu * vv - uv * uv;
    double s = 0.5, t = 0.5;
    if (det > 0.0) {
      s = std::clamp((dot(u, w) * vv - dot(v, w) * uv) / det, 0.0, 1.0);
      t = std::clamp((dot(u, w) * uv - dot(v, w) * uu) / det, 0.0, 1.0);
    }
    return 0.5 * (p + s * u) + 0.5 * (q + t * v);
  }

  // Triangle t in two, from its apex to a point on the edge.
  void cut(std::size_t t, const Edge& edge, mesh::Id middle) {
    Corners c = exterior_[t].corner;
    const mesh::Id top = apex(t, edge);
    while (mesh::place(mesh_, c[0]) != top)
      std::rotate(c.begin(), c.begin() + 1, c.end());
    faces_[exterior_[t].face] = {{c[0], c[1], middle}, {c[0], middle, c[2]}};
  }

  const mesh::Mesh& mesh_;
  std::vector<ExteriorTriangle> exterior_;
  std::map<Edge, std::vector<std::size_t>> edges_;
  std::map<Corners, std::vector<std::size_t>> by_place_;
  std::vector<Vec3> points_;
  Replacement faces_;
};

}  // namespace

mesh::Mesh withFillableOutside(const mesh::Mesh& mesh, std::size_t& crossed) {
  crossed = 0;
  const Replacement faces = triangulated(mesh, true, crossed);
  const mesh::Mesh triangles = faces.empty() ? mesh : Rebuilder(mesh, faces, mesh.points)();
  return CrossedDiagonals(triangles).resolve(crossed);
}

std::unique_ptr<mesh::Mesh> withMatchedDiagonals(const mesh::Mesh& mesh) {
  const auto open = [](const auto& cells) { return cells[1] == mesh::none; };
  if (mesh.tetrahedral() || std::ranges::none_of(mesh.triangle_cells, open)) return nullptr;
  std::size_t crossed = 0;
  const Replacement faces = triangulated(mesh, false, crossed);
  std::unique_ptr<mesh::Mesh> split;
  if (!faces.empty()) split = std::make_unique<mesh::Mesh>(Rebuilder(mesh, faces, mesh.points)());
  CrossedDiagonals diagonals(split ? *split : mesh);
  std::size_t halved = 0;
  mesh::Mesh matched = diagonals.resolve(halved);
  return halved == 0 ? std::move(split) : std::make_unique<mesh::Mesh>(std::move(matched));
}

std::size_t bytes(const mesh::Mesh& m) {
  return m.points.capacity() * sizeof(Vec3) + m.triangle.capacity() * 12 + m.triangle_cells.capacity() * 8 +
         m.quad.capacity() * 16 + m.quad_cells.capacity() * 8 +
         4 * (m.polyhedron_index.capacity() + m.polyhedron_polygons.capacity() + m.polygon_offset.capacity() +
              m.polygon_vertex.capacity()) +
         4 * (m.point_file_id.capacity() + m.cell_vertex.capacity() + m.cell_vertex_offset.capacity() +
              m.cell_file_id.capacity() + m.cell_face.capacity() + m.cell_face_offset.capacity()) +
         m.cell_type.capacity();
}

}  // namespace spillikin::sort
