#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <unordered_set>

#include "spillikin/mesh/build.h"
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
    result_.bytes = bytes();
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
    for (const CellType type : mesh_.cell_type)
      ++result_.cells_by_type[static_cast<std::size_t>(type)];
    const auto is_exterior = [](const std::array<Id, 2>& cells) { return cells[1] == none; };
    result_.exterior_faces =
        static_cast<std::size_t>(std::count_if(mesh_.triangle_cells.begin(), mesh_.triangle_cells.end(), is_exterior) +
                                 std::count_if(mesh_.quad_cells.begin(), mesh_.quad_cells.end(), is_exterior));
    result_.nonplanar_faces =
        static_cast<std::size_t>(std::count_if(mesh_.quad.begin(), mesh_.quad.end(), [&](const std::array<Id, 4>& q) {
          return orient3d(mesh_.points[q[0]], mesh_.points[q[1]], mesh_.points[q[2]], mesh_.points[q[3]]) != 0;
        }));
  }

  // Sums over blocks of fixed bounds, added in order: the same volume whatever the threads.
  void lookAtCells() {
    struct Part {
      double volume = 0.0;
      std::size_t nonconvex = 0;
    };
    std::vector<Part> blocks(blockCount(mesh_.cell_count()));
    parallelBlocks(mesh_.cell_count(), [&](std::size_t b, std::size_t begin, std::size_t end) {
      Surface boundary;
      for (std::size_t c = begin; c < end; ++c) {
        surface(mesh_, static_cast<Id>(c), boundary);
        blocks[b].volume += volumeInside(boundary);
        const bool tetrahedron = mesh_.cell_type[c] == CellType::tetrahedron;
        if (!tetrahedron && !convex(static_cast<Id>(c), boundary)) ++blocks[b].nonconvex;
      }
    });
    for (const Part& part : blocks) {
      result_.volume += part.volume;
      result_.nonconvex_cells += part.nonconvex;
    }
  }

  double volumeInside(const Surface& boundary) const {
    const Vec3 origin = mesh_.points[boundary.triangles.front()[0]];
    double sum = 0.0;
    for (const auto& [a, b, c] : boundary.triangles) {
      sum += glm::dot(mesh_.points[a] - origin, glm::cross(mesh_.points[b] - origin, mesh_.points[c] - origin));
    }
    return sum / 6.0;
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

  std::size_t bytes() const {
    const auto of = [](const auto&... lists) { return (std::size_t{0} + ... + (lists.capacity() * sizeof(lists[0]))); };
    return of(mesh_.points, mesh_.point_file_id, mesh_.cell_type, mesh_.cell_vertex_offset, mesh_.cell_vertex,
              mesh_.cell_file_id, mesh_.triangle, mesh_.triangle_cells, mesh_.quad, mesh_.quad_cells,
              mesh_.cell_face_offset, mesh_.cell_face) +
           of(mesh_.polyhedron_index, mesh_.polyhedron_polygons, mesh_.polygon_offset, mesh_.polygon_vertex,
              mesh_.made_offset, mesh_.made_point, mesh_.made_weight);
  }

  const Mesh& mesh_;
  Inspection result_;
};

}  // namespace

Inspection inspect(const Mesh& mesh) {
  return Inspector(mesh).run();
}

}  // namespace spillikin::mesh
