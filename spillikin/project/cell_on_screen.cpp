#include "spillikin/project/cell_on_screen.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace spillikin::project {

namespace {

double crossProduct(const Vec2& a, const Vec2& b) {
  return a.x * b.y - a.y * b.x;
}

}  // namespace

void CellOnScreen::setCorners(const mesh::Mesh& mesh, const Camera& camera, std::span<const Vec3> screen,
                              const mesh::Field& field, mesh::Id cell) {
  cell_ = cell;
  parallel_ = camera.parallel();
  in_front_ = true;
  const bool of_cells = field.association == mesh::Association::cells;
  const std::span<const mesh::Id> vertices = mesh.vertices(cell);
  world_.resize(vertices.size());
  homogeneous_.resize(vertices.size());
  position_.resize(vertices.size());
  value_.resize(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3& h = screen[vertices[i]];
    world_[i] = mesh.points[vertices[i]];
    homogeneous_[i] = h;
    in_front_ = in_front_ && (parallel_ || h.z > 0.0);
    position_[i] = parallel_ ? Vec2(h.x, h.y) : Vec2(h.x / h.z, h.y / h.z);
    value_[i] = field.values[of_cells ? cell : vertices[i]];
  }
}

void CellOnScreen::setTriangles(const mesh::Mesh& mesh) {
  mesh::surface(mesh, cell_, surface_);
  const std::span<const mesh::Id> vertices = mesh.vertices(cell_);
  triangles_.resize(surface_.triangles.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto found = std::find(vertices.begin(), vertices.end(), surface_.triangles[t][k]);
      triangles_[t][k] = static_cast<Local>(found - vertices.begin());
    }
  }
}

// Linear interpolation in space: on the screen it is the values divided by depth, and 1/depth, that are linear. Every
// value is taken relative to the nearest corner's, so that a constant stays that constant and a corner is met exactly.
Sample CellOnScreen::onEdge(Local a, Local b, double t) const {
  if (t > 0.5) {
    std::swap(a, b);
    t = 1.0 - t;
  }
  const double wa = homogeneous_[a].z;
  const double wb = homogeneous_[b].z;
  const double share = parallel_ ? t : t * wa / ((1.0 - t) * wb + t * wa);
  return {wa + share * (wb - wa), value_[a] + share * (value_[b] - value_[a])};
}

Sample CellOnScreen::inTriangle(const std::array<Local, 3>& corner, double weight_b, double weight_c) const {
  std::array<double, 3> weight{1.0 - weight_b - weight_c, weight_b, weight_c};
  std::size_t base = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    base = weight[k] > weight[base] ? k : base;
  }
  const Local a = corner[base];
  const Local b = corner[(base + 1) % 3];
  const Local c = corner[(base + 2) % 3];
  double share_b = weight[(base + 1) % 3];
  double share_c = weight[(base + 2) % 3];
  const double wa = homogeneous_[a].z;
  if (!parallel_) {
    const double inverse_b = share_b * (wa / homogeneous_[b].z);
    const double inverse_c = share_c * (wa / homogeneous_[c].z);
    const double sum = weight[base] + inverse_b + inverse_c;
    share_b = inverse_b / sum;
    share_c = inverse_c / sum;
  }
  return {wa + share_b * (homogeneous_[b].z - wa) + share_c * (homogeneous_[c].z - wa),
          value_[a] + share_b * (value_[b] - value_[a]) + share_c * (value_[c] - value_[a])};
}

Sample CellOnScreen::at(const std::array<Local, 3>& corner, const Vec2& position, double* off) const {
  std::size_t longest = 0;
  double length2 = -1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2 side = position_[corner[(k + 1) % 3]] - position_[corner[k]];
    if (glm::dot(side, side) > length2) {
      length2 = glm::dot(side, side);
      longest = k;
    }
  }
  const std::array<Local, 3> ordered{corner[longest], corner[(longest + 1) % 3], corner[(longest + 2) % 3]};
  const Vec2& start = position_[ordered[0]];
  if (length2 == 0.0) {
    if (off != nullptr) {
      *off = glm::distance(start, position);
    }
    return atCorner(ordered[0]);
  }
  const Vec2 base = position_[ordered[1]] - start;
  const Vec2 to_apex = position_[ordered[2]] - start;
  const Vec2 to_point = position - start;
  const double along_point = std::clamp(glm::dot(to_point, base) / length2, 0.0, 1.0);
  const double along_apex = std::clamp(glm::dot(to_apex, base) / length2, 0.0, 1.0);
  const double apex_height = crossProduct(base, to_apex);
  // The share of the apex, as far as the place along the base allows.
  const double room = along_point < along_apex   ? along_point / along_apex
                      : along_point > along_apex ? (1.0 - along_point) / (1.0 - along_apex)
                                                 : 1.0;
  const double height = apex_height == 0.0 ? 0.0 : crossProduct(base, to_point) / apex_height;
  const double apex = std::clamp(height, 0.0, room);
  const double end = std::clamp(along_point - apex * along_apex, 0.0, 1.0 - apex);
  if (off != nullptr) {
    *off = glm::length(end * base + apex * to_apex - to_point);
  }
  return inTriangle(ordered, end, apex);
}

bool CellOnScreen::isInside(const std::array<Local, 3>& corner, const Vec2& position, double least) const {
  const Vec2& a = position_[corner[0]];
  const Vec2 ab = position_[corner[1]] - a;
  const Vec2 ac = position_[corner[2]] - a;
  const Vec2 ap = position - a;
  const double area = crossProduct(ab, ac);
  const double sign = area < 0.0 ? -1.0 : 1.0;
  const double limit = least * std::fabs(area);
  const double b = sign * crossProduct(ap, ac);
  const double c = sign * crossProduct(ab, ap);
  return b > limit && c > limit && std::fabs(area) - b - c > limit;
}

}  // namespace spillikin::project
