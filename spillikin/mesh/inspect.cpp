#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <unordered_set>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/folded.h"
#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::mesh {
namespace {

// How far a vertex may lie outside the plane of a boundary triangle, in parts of the cell's diameter, before the cell
// counts as nonconvex: coordinates that were once single precision are no further off.
constexpr double convexity_tolerance = 1e-6;

class Inspector {
 public:
  explicit Inspector(const Mesh& mesh) : mesh_(mesh) {}

  Inspection run() {
    countFaces();
    lookAtCells();
    result_.components = components();
    result_.nonmatching_faces = nonmatching();
    result_.lower = mesh_.points.empty() ? Vec3(0.0) : mesh_.points.front();
    result_.upper = result_.lower;
    for (const Vec3& p : mesh_.points) {
      result_.lower = glm::min(result_.lower, p);
      result_.upper = glm::max(result_.upper, p);
    }
    return result_;
  }

 private:
  void countFaces() {
    static_cast<Counts&>(result_) = count(mesh_);
    result_.nonplanar_faces =
        static_cast<std::size_t>(std::count_if(mesh_.quad.begin(), mesh_.quad.end(), [&](const std::array<Id, 4>& q) {
          return orient3d(mesh_.points[q[0]], mesh_.points[q[1]], mesh_.points[q[2]], mesh_.points[q[3]]) != 0;
        }));
    result_.folded_cells = foldedCells(mesh_).size();
  }

  // Sums over blocks of fixed bounds, added in order: the same volume whatever the threads.
  void lookAtCells() {
    struct Part {
      double volume = 0.0;
      std::size_t nonconvex = 0, nonconvex_polyhedra = 0, fans = 0, nonplanar_fans = 0;
    };
    std::vector<Part> blocks(blockCount(mesh_.cell_count()));
    parallelBlocks(mesh_.cell_count(), [&](std::size_t b, std::size_t begin, std::size_t end) {
      Surface boundary;
      for (std::size_t c = begin; c < end; ++c) {
        surface(mesh_, static_cast<Id>(c), boundary);
        blocks[b].volume += enclosedVolume(mesh_.points, boundary);
        const bool tetrahedron = mesh_.cell_type[c] == CellType::tetrahedron;
        if (!tetrahedron && !convex(static_cast<Id>(c), boundary)) {
          ++blocks[b].nonconvex;
          blocks[b].nonconvex_polyhedra += mesh_.cell_type[c] == CellType::polyhedron ? 1U : 0U;
        }
        countFans(static_cast<Id>(c), blocks[b].fans, blocks[b].nonplanar_fans);
      }
    });
    for (const Part& part : blocks) {
      result_.volume += part.volume;
      result_.nonconvex_cells += part.nonconvex;
      result_.nonconvex_polyhedra += part.nonconvex_polyhedra;
      result_.fanned_faces += part.fans;
      result_.nonplanar_fans += part.nonplanar_fans;
    }
  }

  // Polygons of five and more corners, each on the side that it is stored from.
  void countFans(Id cell, std::size_t& fans, std::size_t& nonplanar) const {
    if (vertexCount(mesh_.cell_type[cell]) != 0 && vertexCount(mesh_.cell_type[cell]) < 10) return;
    const FaceUse* use = mesh_.cell_face.data() + mesh_.cell_face_offset[cell];
    forEachPolygon(mesh_, cell, [&](std::span<const Id> polygon) {
      const bool counts = polygon.size() > 4 && use->side() == 0;
      use += polygon.size() > 4 ? polygon.size() - 2 : 1;
      if (!counts) return;
      ++fans;
      if (!planar(polygon)) ++nonplanar;
    });
  }

  // Beyond rounding, since five points are hardly ever exactly in one plane.
  bool planar(std::span<const Id> polygon) const {
    const Vec3& origin = mesh_.points[polygon[0]];
    Vec3 normal(0.0);
    double extent = 0.0;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
      normal += glm::cross(mesh_.points[polygon[i]] - origin, mesh_.points[polygon[i + 1]] - origin);
      extent = std::max(extent, glm::length(mesh_.points[polygon[i + 1]] - origin));
    }
    const double limit = convexity_tolerance * extent * glm::length(normal);
    return std::all_of(polygon.begin(), polygon.end(),
                       [&](Id v) { return std::abs(glm::dot(normal, mesh_.points[v] - origin)) <= limit; });
  }

  bool convex(Id cell, const Surface& boundary) const {
    const auto vertices = mesh_.vertices(cell);
    Vec3 lower = mesh_.points[vertices[0]], upper = lower;
    for (const Id v : vertices) {
      lower = glm::min(lower, mesh_.points[v]);
      upper = glm::max(upper, mesh_.points[v]);
    }
    const double tolerance = convexity_tolerance * glm::length(upper - lower);
    for (const auto& [a, b, c] : boundary.triangles) {
      const Vec3& origin = mesh_.points[a];
      const Vec3 normal = glm::cross(mesh_.points[b] - origin, mesh_.points[c] - origin);
      const double limit = tolerance * glm::length(normal);
      for (const Id v : vertices) {
        if (glm::dot(normal, mesh_.points[v] - origin) > limit) return false;
      }
    }
    return true;
  }

  std::size_t components() const {
    std::vector<Id> group(mesh_.cell_count());
    std::iota(group.begin(), group.end(), Id{0});
    const auto root = [&](Id c) {
      while (group[c] != c)
        c = group[c] = group[group[c]];
      return c;
    };
    std::size_t count = group.size();
    const auto unite = [&](const std::array<Id, 2>& cells) {
      if (cells[1] == none) return;
      const Id a = root(cells[0]), b = root(cells[1]);
      if (a == b) return;
      group[std::max(a, b)] = std::min(a, b);
      --count;
    };
    std::for_each(mesh_.triangle_cells.begin(), mesh_.triangle_cells.end(), unite);
    std::for_each(mesh_.quad_cells.begin(), mesh_.quad_cells.end(), unite);
    return count;
  }

  struct Hash {
    std::size_t operator()(const std::array<Id, 3>& key) const {
      std::uint64_t h = 0;
      for (const Id id : key)
        h = (h ^ id) * 0x9e3779b97f4a7c15ULL, h ^= h >> 29;
      return static_cast<std::size_t>(h);
    }
  };

  // The corners' places, rotated to the smallest: equal for triangles that are the same way round. The first vertex at
  // a point stands for it; such vertices follow each other.
  std::array<Id, 3> places(Id a, Id b, Id c) const {
    std::array<Id, 3> key{a, b, c};
    for (Id& v : key) {
      while (v > 0 && mesh_.points[v - 1] == mesh_.points[v])
        --v;
    }
    std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
    return key;
  }

  std::size_t nonmatching() const {
    std::unordered_set<std::array<Id, 3>, Hash> exterior;
    if (mesh_.quad_count() > 0) {
      for (std::size_t t = 0; t < mesh_.triangle_count(); ++t) {
        const auto& [a, b, c] = mesh_.triangle[t];
        if (mesh_.triangle_cells[t][1] == none) exterior.insert(places(a, b, c));
      }
    }
    // Seen from the other side.
    const auto there = [&](Id a, Id b, Id c) { return exterior.count(places(a, c, b)) > 0; };
    std::size_t count = 0;
    for (std::size_t i = 0; i < mesh_.quad_count() && !exterior.empty(); ++i) {
      if (mesh_.quad_cells[i][1] != none) continue;
      const auto& [a, b, c, d] = mesh_.quad[i];
      if ((there(a, b, c) && there(a, c, d)) || (there(a, b, d) && there(b, c, d))) ++count;
    }
    return count;
  }

  const Mesh& mesh_;
  Inspection result_;
};

}  // namespace

Counts count(const Mesh& mesh) {
  Counts counts;
  for (const CellType type : mesh.cell_type)
    ++counts.cells_by_type[static_cast<std::size_t>(type)];
  const auto is_exterior = [](const std::array<Id, 2>& cells) { return cells[1] == none; };
  counts.exterior_faces =
      static_cast<std::size_t>(std::count_if(mesh.triangle_cells.begin(), mesh.triangle_cells.end(), is_exterior) +
                               std::count_if(mesh.quad_cells.begin(), mesh.quad_cells.end(), is_exterior));
  const auto of = [](const auto&... lists) { return (std::size_t{0} + ... + (lists.capacity() * sizeof(lists[0]))); };
  counts.bytes =
      of(mesh.points, mesh.point_file_id, mesh.cell_type, mesh.cell_vertex_offset, mesh.cell_vertex, mesh.cell_file_id,
         mesh.triangle, mesh.triangle_cells, mesh.quad, mesh.quad_cells, mesh.cell_face_offset, mesh.cell_face) +
      of(mesh.polyhedron_index, mesh.polyhedron_polygons, mesh.polygon_offset, mesh.polygon_vertex, mesh.made_offset,
         mesh.made_point, mesh.made_weight);
  return counts;
}

Inspection inspect(const Mesh& mesh) {
  return Inspector(mesh).run();
}

}  // namespace spillikin::mesh
