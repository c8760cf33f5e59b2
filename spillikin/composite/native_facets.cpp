#include "spillikin/composite/native_facets.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <span>

#include "spillikin/mesh/cell_faces.h"

namespace spillikin::composite::native {

namespace {

using mesh::CellType;

constexpr std::size_t grain = 1 << 10;

// The sine of the angle to a face's plane under which every other corner must be seen from the face: two faces that run
// on into each other at less than that cannot be told apart by their depths in float.
constexpr double flattest = 1e-4;

FacetTable makeTable(CellType type) {
  FacetTable table;
  table.corners = mesh::vertexCount(type);
  const std::span<const mesh::LocalFace> faces = mesh::localFaces(type);
  for (unsigned f = 0; f < table.forward.size(); ++f) {
    const mesh::LocalFace& face = faces[f < faces.size() ? f : 0];
    for (unsigned i = 0; i < 8; ++i) {
      table.forward[f] |= std::uint32_t{face.vertex[i % face.size]} << 4 * i;
      table.backward[f] |= std::uint32_t{face.vertex[(face.size - i % face.size) % face.size]} << 4 * i;
    }
    if (f >= faces.size()) continue;
    table.faces |= 1U << f;
    if (face.size == 4) table.quads |= 1U << f;
  }
  return table;
}

// The smallest corner first, then the smaller of its neighbours.
FacetCode cornerOrder(const mesh::LocalFace& face, std::span<const mesh::Id> ids) {
  const unsigned n = face.size;
  const auto id = [&](unsigned i) { return ids[face.vertex[i % n]]; };
  unsigned start = 0;
  for (unsigned i = 1; i < n; ++i) {
    if (id(i) < id(start)) start = i;
  }
  const bool backwards = id(start + n - 1) < id(start + 1);
  return backwards ? (n - start) % n << 1U | 1U : start << 1U;
}

// One cell's corners and the tests of its faces' planes.
class CellPlanes {
 public:
  CellPlanes(const mesh::Mesh& mesh, std::span<const mesh::Id> ids) : count_(ids.size()) {
    for (std::size_t i = 0; i < count_; ++i) {
      p_[i] = mesh.points[ids[i]];
      centre_ += p_[i] / static_cast<double>(count_);
    }
  }

  // Corners from the smallest, outward; on return whether the face bends inwards. False where the face's planes do not
  // bound the cell as they should.
  bool face(std::span<const unsigned> corner, bool& inward) const {
    const std::size_t n = corner.size();
    const unsigned a = corner[0], b = corner[1], c = corner[2], d = corner[n - 1];
    const Vec3 first = normal(a, b, c);
    if (!inside(first, a, centre_)) return false;
    if (n == 3) return bounds(first, corner);
    const Vec3 second = normal(a, c, d);
    if (!inside(second, a, centre_)) return false;
    inward = glm::dot(first, p_[d] - p_[a]) > 0.0;
    if (!inward) return bounds(first, corner) && bounds(second, corner);
    return bounds(normal(a, b, d), corner) && bounds(normal(b, c, d), corner, 1);
  }

 private:
  Vec3 normal(unsigned a, unsigned b, unsigned c) const { return glm::cross(p_[b] - p_[a], p_[c] - p_[a]); }
  bool inside(const Vec3& plane, unsigned on, const Vec3& point) const {
    const Vec3 way = point - p_[on];
    const double depth = -glm::dot(plane, way);
    return depth > 0.0 && depth * depth >= flattest * flattest * glm::dot(plane, plane) * glm::dot(way, way);
  }
  // Whether all corners that are not of the face lie well inside the plane through corner[on].
  bool bounds(const Vec3& plane, std::span<const unsigned> corner, std::size_t on = 0) const {
    for (unsigned v = 0; v < count_; ++v) {
      if (std::find(corner.begin(), corner.end(), v) != corner.end()) continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (const unsigned k : corner)
        nearest = std::min(nearest, glm::dot(p_[v] - p_[k], p_[v] - p_[k]));
      const double depth = -glm::dot(plane, p_[v] - p_[corner[on]]);
      if (!(depth > 0.0 && depth * depth >= flattest * flattest * glm::dot(plane, plane) * nearest)) return false;
    }
    return true;
  }

  std::size_t count_;
  std::array<Vec3, 8> p_{};
  Vec3 centre_{0.0};
};

FacetCode codeOf(const mesh::Mesh& mesh, mesh::Id cell) {
  const CellType type = mesh.cell_type[cell];
  if (type > CellType::hexahedron) return not_of_planes;
  const std::span<const mesh::Id> ids = mesh.vertices(cell);
  const std::span<const mesh::LocalFace> faces = mesh::localFaces(type);
  const CellPlanes planes(mesh, ids);
  FacetCode code = 0;
  for (unsigned f = 0; f < faces.size(); ++f) {
    const unsigned n = faces[f].size;
    const FacetCode order = cornerOrder(faces[f], ids);
    code |= order << facet_bits * f;
    const unsigned start = (order & 1U) != 0 ? (n - (order >> 1U)) % n : order >> 1U;
    std::array<unsigned, 4> corner{};
    for (unsigned i = 0; i < n; ++i)
      corner[i] = faces[f].vertex[(start + i) % n];
    bool inward = false;
    if (!planes.face(std::span(corner).first(n), inward)) return not_of_planes;
    if (inward) code |= 1U << (inward_shift + f);
  }
  return code;
}

}  // namespace

const FacetTable* facetTables() {
  static const std::array<FacetTable, 4> tables{makeTable(CellType::tetrahedron), makeTable(CellType::pyramid),
                                                makeTable(CellType::wedge), makeTable(CellType::hexahedron)};
  return tables.data();
}

void Facets::set(const mesh::Mesh& mesh) {
  code_.resize(mesh.tetrahedral() ? 0 : mesh.cell_count());
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, code_.size(), grain), [&](const Range& range) {
    for (std::size_t c = range.begin(); c != range.end(); ++c)
      code_[c] = codeOf(mesh, static_cast<mesh::Id>(c));
  });
}

}  // namespace spillikin::composite::native
