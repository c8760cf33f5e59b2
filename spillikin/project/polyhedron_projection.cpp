#include "spillikin/project/polyhedron_projection.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "spillikin/mesh/predicates.h"

namespace spillikin::project {

using mesh::PlanarSubdivision;

namespace {

// A barycentric coordinate of at least this much is positive for certain: ten times the rounding of those of triangles
// that are not thin.
constexpr double clearly_inside = 1e-8;
constexpr double rounding = 1e-9;

}  // namespace

void PolyhedronProjection::findEdges(const CellOnScreen& cell) {
  edges_.clear();
  const auto triangles = cell.triangles();
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Local a = triangles[t][k];
      const Local b = triangles[t][(k + 1) % 3];
      const auto open = std::find_if(edges_.begin(), edges_.end(),
                                     [&](const Edge& e) { return e.a == b && e.b == a && e.right == none; });
      if (open != edges_.end()) {
        open->right = t;
      } else {
        edges_.push_back({a, b, t, none, none});
      }
    }
  }
}

// Edges between two triangles of exactly one plane are no edges of the face that they make together.
void PolyhedronProjection::joinFlatTriangles(const CellOnScreen& cell) {
  const auto triangles = cell.triangles();
  const auto apex = [&](std::uint32_t t, const Edge& e) {
    const auto& corners = triangles[t];
    return *std::find_if(corners.begin(), corners.end(), [&](Local v) { return v != e.a && v != e.b; });
  };
  const auto flat = [&](const Edge& e) {
    return e.right != none && mesh::orient3d(cell.world(e.a), cell.world(e.b), cell.world(apex(e.left, e)),
                                             cell.world(apex(e.right, e))) == 0;
  };
  const auto removed = std::remove_if(edges_.begin(), edges_.end(), [&](const Edge& e) {
    if (!flat(e)) {
      return false;
    }
    const std::uint32_t keep = std::min(face_[e.left], face_[e.right]);
    const std::uint32_t gone = std::max(face_[e.left], face_[e.right]);
    std::replace(face_.begin(), face_.end(), gone, keep);
    return true;
  });
  edges_.erase(removed, edges_.end());
}

void PolyhedronProjection::insertEdges(const CellOnScreen& cell) {
  subdivision_.clear();
  for (Local v = 0; v < cell.size(); ++v) {
    subdivision_.addPoint(cell.position(v));
  }
  edge_of_segment_.clear();
  inserted_.assign(edges_.size(), 0);
  // In an order in which every edge touches one before it.
  for (bool progress = true; progress;) {
    progress = false;
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      const auto [a, b] = std::pair{edges_[e].a, edges_[e].b};
      const bool touches = edge_of_segment_.empty() || subdivision_.inserted(a) || subdivision_.inserted(b);
      if (inserted_[e] == 0 && touches) {
        inserted_[e] = 1;
        progress = true;
        edges_[e].segment = subdivision_.insert(a, b);
        if (edges_[e].segment != PlanarSubdivision::none) {
          edge_of_segment_.push_back(e);
        }
      }
    }
  }
  subdivision_.finish();
  position_.resize(subdivision_.vertexCount());
  for (PlanarSubdivision::Index v = 0; v < position_.size(); ++v) {
    position_[v] = subdivision_.position(v);
  }
}

// Whether a face's polygon holds a region: all of its vertices lie on the inner side of all of the face's edges.
bool PolyhedronProjection::covers(std::uint32_t face, int facing, std::size_t region) const {
  for (const Edge& edge : edges_) {
    const bool on_left = face_[edge.left] == face;
    const bool on_right = edge.right != none && face_[edge.right] == face;
    if (edge.segment == PlanarSubdivision::none || on_left == on_right) {
      continue;
    }
    const bool forward = subdivision_.canonical(edge.a) == subdivision_.segment(edge.segment)[0];
    const int inner = forward == on_left ? facing : -facing;
    for (const auto v : subdivision_.region(region)) {
      if (subdivision_.side(edge.segment, v) == -inner) {
        return false;
      }
    }
  }
  return true;
}

// The only face of the given facing that covers the region, as one of its triangles; none when there are several.
std::uint32_t PolyhedronProjection::coveringExactly(std::size_t region, int facing) const {
  std::uint32_t found = none;
  for (std::uint32_t t = 0; t < face_.size(); ++t) {
    if (area_[t].sign != facing || (found != none && face_[found] == face_[t])) {
      continue;
    }
    if (covers(face_[t], facing, region)) {
      if (found != none) {
        return none;
      }
      found = t;
    }
  }
  return found;
}

// The same, by the region's middle where this is beyond doubt.
std::uint32_t PolyhedronProjection::covering(const CellOnScreen& cell, std::size_t region, const Vec2& middle,
                                             int facing) const {
  std::uint32_t found = none;
  for (std::uint32_t t = 0; t < face_.size(); ++t) {
    if (area_[t].sign == facing && std::fabs(area_[t].value) > thin_ &&
        cell.isInside(cell.triangles()[t], middle, clearly_inside)) {
      if (found != none) {
        return none;
      }
      found = t;
    }
  }
  return found != none ? found : coveringExactly(region, facing);
}

// False when some region is not convex or lies behind more than one front face.
bool PolyhedronProjection::chooseFaces(const CellOnScreen& cell) {
  double size = 0.0;
  double far = 0.0;
  for (Local v = 0; v < cell.size(); ++v) {
    const Vec2 apart = glm::abs(cell.position(v) - cell.position(0));
    const Vec2 place = glm::abs(cell.position(v));
    size = std::max({size, apart.x, apart.y});
    far = std::max({far, place.x, place.y});
  }
  thin_ = 0x1p-52 / rounding * far * size;

  regions_.clear();
  for (std::size_t r = 0; r < subdivision_.regionCount(); ++r) {
    const auto boundary = subdivision_.region(r);
    Vec2 sum(0.0);
    for (std::size_t k = 0; k < boundary.size(); ++k) {
      if (subdivision_.turn(r, k) < 0) {
        return false;
      }
      sum += position_[boundary[k]];
    }
    const Vec2 middle = sum / static_cast<double>(boundary.size());
    const Region region{covering(cell, r, middle, -1), covering(cell, r, middle, 1)};
    if (region.front == none || region.back == none) {
      return false;
    }
    regions_.push_back(region);
  }
  return true;
}

// On a corner or on an edge of the triangle, where nothing depends on the rounded position.
bool PolyhedronProjection::sampleExactly(const CellOnScreen& cell, PlanarSubdivision::Index vertex,
                                         std::uint32_t triangle, Sample& found) const {
  const auto& v = subdivision_.vertex(vertex);
  if (v.point != PlanarSubdivision::none) {
    for (const Local corner : cell.triangles()[triangle]) {
      if (subdivision_.canonical(corner) == v.point) {
        found = cell.atCorner(corner);
        return true;
      }
    }
    return false;
  }
  for (int which = 0; which < 2; ++which) {
    const auto segment = v.segments[static_cast<std::size_t>(which)];
    const Edge& edge = edges_[edge_of_segment_[segment]];
    if (edge.left == triangle || edge.right == triangle) {
      const double t = subdivision_.parameter(vertex, which);
      const bool forward = subdivision_.canonical(edge.a) == subdivision_.segment(segment)[0];
      found = forward ? cell.onEdge(edge.a, edge.b, t) : cell.onEdge(edge.b, edge.a, t);
      return true;
    }
  }
  return false;
}

// What the ray of a vertex meets on a face, given by its lowest triangle.
Sample PolyhedronProjection::sampleFace(const CellOnScreen& cell, PlanarSubdivision::Index vertex,
                                        std::uint32_t face) const {
  Sample found;
  double least = -1.0;  // pixels by which the position lies outside the best triangle of the face so far
  for (std::uint32_t t = face; t < face_.size(); ++t) {
    if (face_[t] != face) {
      continue;
    }
    Sample candidate;
    if (sampleExactly(cell, vertex, t, candidate)) {
      return candidate;
    }
    double off = 0.0;
    candidate = cell.at(cell.triangles()[t], position_[vertex], &off);
    if (least < 0.0 || off < least) {
      least = off;
      found = candidate;
    }
  }
  return found;
}

const Sample& PolyhedronProjection::sample(const CellOnScreen& cell, PlanarSubdivision::Index vertex,
                                           std::uint32_t triangle, unsigned end) {
  Known& known = known_[vertex][end];
  if (known.face != face_[triangle]) {
    known = {face_[triangle], sampleFace(cell, vertex, face_[triangle])};
  }
  return known.sample;
}

bool PolyhedronProjection::operator()(const CellOnScreen& cell, const Camera& camera, Faces faces, Regions& out) {
  const auto triangles = cell.triangles();
  face_.resize(triangles.size());
  area_.resize(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    face_[t] = t;
    area_[t] = mesh::signedArea(cell.position(a), cell.position(b), cell.position(c));
  }
  findEdges(cell);
  if (faces == Faces::planar) {
    joinFlatTriangles(cell);
  }
  insertEdges(cell);
  if (!chooseFaces(cell)) {
    return false;
  }
  known_.assign(position_.size(), {});
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const auto [front, back] = regions_[r];
    for (const auto v : subdivision_.region(r)) {
      const Vec2& p = position_[v];
      const Sample& near = sample(cell, v, front, 0);
      const Sample& far = sample(cell, v, back, 1);
      const double length = std::fmax(0.0, far.depth - near.depth) * glm::length(camera.direction(p.x, p.y));
      out.addVertex(p.x, p.y, near.depth, far.depth, length, near.value, far.value);
    }
    out.addPolygon(cell.cell(), faces == Faces::planar ? face_[front] : front,
                   faces == Faces::planar ? face_[back] : back);
  }
  return true;
}

}  // namespace spillikin::project
