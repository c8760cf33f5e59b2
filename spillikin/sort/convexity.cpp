#include "spillikin/sort/convexity.h"

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>
#include <unordered_set>

#include "spillikin/mesh/place.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

struct Edge {
  mesh::Id low, high;   // places
  mesh::Id triangle;    // index into the exterior
  std::uint8_t corner;  // the edge runs from this corner to the next
  bool forward;         // from low to high
  bool operator<(const Edge& other) const {
    return low != other.low ? low < other.low : high != other.high ? high < other.high : triangle < other.triangle;
  }
};

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Vec3 normal(const mesh::Mesh& mesh, const ExteriorTriangle& t) {
  const Vec3& a = mesh.points[t.corner[0]];
  return cross(mesh.points[t.corner[1]] - a, mesh.points[t.corner[2]] - a);
}

// Neighbours that lie in one plane must not be folded onto each other.
bool folded(const mesh::Mesh& mesh, const ExteriorTriangle& a, const ExteriorTriangle& b) {
  const Vec3 n = normal(mesh, a), m = normal(mesh, b);
  return n.x * m.x + n.y * m.y + n.z * m.z < 0.0;
}

mesh::Id root(std::vector<mesh::Id>& parent, mesh::Id i) {
  while (parent[i] != i)
    i = parent[i] = parent[parent[i]];
  return i;
}

std::vector<Edge> sortedEdges(const mesh::Mesh& mesh, const std::vector<ExteriorTriangle>& exterior) {
  std::vector<Edge> edges;
  edges.reserve(3 * exterior.size());
  for (std::size_t t = 0; t < exterior.size(); ++t) {
    for (std::uint8_t k = 0; k < 3; ++k) {
      const mesh::Id a = mesh::place(mesh, exterior[t].corner[k]);
      const mesh::Id b = mesh::place(mesh, exterior[t].corner[(k + 1) % 3]);
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<mesh::Id>(t), k, a < b});
    }
  }
  tbb::parallel_sort(edges.begin(), edges.end());
  return edges;
}

}  // namespace

std::vector<ExteriorTriangle> exteriorTriangles(const mesh::Mesh& mesh) {
  std::vector<ExteriorTriangle> exterior;
  for (std::size_t f = 0; f < mesh.triangle.size(); ++f) {
    if (mesh.triangle_cells[f][1] != mesh::none) continue;
    exterior.push_back({mesh.triangle[f], static_cast<mesh::Id>(f), mesh.triangle_cells[f][0]});
  }
  for (std::size_t q = 0; q < mesh.quad.size(); ++q) {
    if (mesh.quad_cells[q][1] != mesh::none) continue;
    const auto& v = mesh.quad[q];
    const auto face = static_cast<mesh::Id>(mesh.triangle.size() + q);
    exterior.push_back({{v[0], v[1], v[2]}, face, mesh.quad_cells[q][0]});
    exterior.push_back({{v[0], v[2], v[3]}, face, mesh.quad_cells[q][0]});
  }
  return exterior;
}

Convexity convexity(const mesh::Mesh& mesh, const std::vector<ExteriorTriangle>& exterior) {
  const std::vector<Edge> edges = sortedEdges(mesh, exterior);
  std::vector<mesh::Id> parent(exterior.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    const Edge& e = edges[i];
    const bool pair = i + 1 < edges.size() && edges[i + 1].low == e.low && edges[i + 1].high == e.high;
    const bool more = i + 2 < edges.size() && edges[i + 2].low == e.low && edges[i + 2].high == e.high;
    if (!pair || more || edges[i + 1].forward == e.forward) return {false, "its exterior touches itself along an edge"};
    const Edge& f = edges[i + 1];
    const ExteriorTriangle &s = exterior[e.triangle], &t = exterior[f.triangle];
    const Vec3& opposite = mesh.points[t.corner[(f.corner + 2U) % 3U]];
    const int rise =
        mesh::orient3d(mesh.points[s.corner[0]], mesh.points[s.corner[1]], mesh.points[s.corner[2]], opposite);
    if (rise > 0 || (rise == 0 && folded(mesh, s, t))) return {false, "its exterior is concave"};
    parent[root(parent, e.triangle)] = root(parent, f.triangle);
  }
  std::unordered_set<mesh::Id> vertices;
  for (std::size_t t = 0; t < exterior.size(); ++t) {
    if (root(parent, static_cast<mesh::Id>(t)) != root(parent, 0)) return {false, "its exterior has several parts"};
    for (const mesh::Id v : exterior[t].corner)
      vertices.insert(mesh::place(mesh, v));
  }
  // V - E + F of a closed triangulated surface is 2 for a sphere alone.
  if (vertices.size() + exterior.size() != edges.size() / 2 + 2) return {false, "its exterior is not a sphere"};
  return {true, ""};
}

}  // namespace spillikin::sort
