#include "spillikin/mesh/interior_point.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "spillikin/mesh/predicates.h"

namespace spillikin::mesh {
namespace {

constexpr std::size_t most_rounds = 1024;
constexpr std::size_t rounds_between_looks = 16;
constexpr double rate = 0.25;  // of learning

bool seesAll(const Mesh& mesh, const Surface& boundary, const Vec3& p) {
  return std::all_of(boundary.triangles.begin(), boundary.triangles.end(), [&](const auto& t) {
    return orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], p) < 0;
  });
}

// Heights of all vertices over the planes of all triangles, in parts of the cell's size, a row for each triangle.
std::vector<double> heights(const Mesh& mesh, std::span<const Id> vertices, const Surface& boundary) {
  double size = 0.0;
  for (const Id v : vertices)
    size = std::max(size, glm::distance(mesh.points[v], mesh.points[vertices[0]]));
  std::vector<double> all;
  all.reserve(boundary.triangles.size() * vertices.size());
  for (const auto& [a, b, c] : boundary.triangles) {
    const Vec3 n = glm::cross(mesh.points[b] - mesh.points[a], mesh.points[c] - mesh.points[a]);
    const double length = glm::length(n) * size;
    for (const Id v : vertices)
      all.push_back(length > 0.0 ? glm::dot(n, mesh.points[v] - mesh.points[a]) / length : 0.0);
  }
  return all;
}

// The mean place, weighted by how often each vertex was chosen.
void place(const Mesh& mesh, const std::vector<double>& chosen, InteriorPoint& out) {
  double sum = 0.0;
  for (const double c : chosen)
    sum += c;
  out.place = Vec3(0.0);
  for (std::size_t v = 0; v < chosen.size(); ++v) {
    out.weight[v] = chosen[v] / sum;
    out.place += out.weight[v] * mesh.points[out.vertex[v]];
  }
}

}  // namespace

bool interiorPoint(const Mesh& mesh, Id cell, const Surface& boundary, InteriorPoint& out) {
  const std::span<const Id> vertices = mesh.vertices(cell);
  out.vertex.assign(vertices.begin(), vertices.end());
  out.weight.resize(vertices.size());
  std::vector<double> chosen(vertices.size(), 1.0);
  place(mesh, chosen, out);
  if (seesAll(mesh, boundary, out.place)) return true;

  const std::vector<double> height = heights(mesh, vertices, boundary);
  const std::size_t triangles = boundary.triangles.size(), corners = vertices.size();
  std::vector<double> pressure(triangles, 1.0), blend(corners);
  std::fill(chosen.begin(), chosen.end(), 0.0);
  for (std::size_t round = 1; round <= most_rounds; ++round) {
    std::fill(blend.begin(), blend.end(), 0.0);
    for (std::size_t t = 0; t < triangles; ++t) {
      for (std::size_t v = 0; v < corners; ++v)
        blend[v] += pressure[t] * height[t * corners + v];
    }
    const auto lowest = static_cast<std::size_t>(std::min_element(blend.begin(), blend.end()) - blend.begin());
    chosen[lowest] += 1.0;
    double total = 0.0;
    for (std::size_t t = 0; t < triangles; ++t)
      total += pressure[t] *= std::exp(rate * height[t * corners + lowest]);
    for (double& p : pressure)
      p /= total;
    if (round % rounds_between_looks != 0) continue;
    place(mesh, chosen, out);
    if (seesAll(mesh, boundary, out.place)) return true;
  }
  return false;
}

}  // namespace spillikin::mesh
