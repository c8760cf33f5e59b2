#include "spillikin/project/tetrahedron_projection.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace spillikin::project {

namespace {

using Local = CellOnScreen::Local;

// The triangles of mesh::surface by the corner opposite to them.
constexpr std::array<std::array<Local, 3>, 4> face_corners{{{1, 2, 3}, {2, 0, 3}, {0, 1, 3}, {0, 2, 1}}};
constexpr std::array<std::uint32_t, 4> surface_index{1, 2, 0, 3};

class Tetrahedron {
 public:
  Tetrahedron(const CellOnScreen& cell, const Camera& camera, Regions& out) : cell_(cell), camera_(camera), out_(out) {
    for (Local k = 0; k < 4; ++k) {
      const auto& [a, b, c] = face_corners[k];
      area_[k] = mesh::signedArea(cell.position(a), cell.position(b), cell.position(c));
      auto& [list, count] = area_[k].sign > 0 ? back_ : area_[k].sign < 0 ? front_ : edge_on_;
      list[count++] = k;
    }
  }

  void project() {
    const auto [fronts, backs] = std::pair{front_.count, back_.count};
    if (fronts == 2 && backs == 2) {
      crossingEdges();
    } else if (fronts == 1 && backs == 1) {
      cornerBehindCorner();
    } else if (fronts == 1 && backs > 1) {
      cornerInside(front_.list[0], back_);
    } else if (backs == 1 && fronts > 1) {
      cornerInside(back_.list[0], front_);
    }  // else all faces are edge-on: nothing to see
  }

 private:
  struct Faces {  // by the corner opposite to them
    std::array<Local, 4> list{};
    unsigned count = 0;
  };

  bool isFront(Local face) const { return area_[face].sign < 0; }

  void addVertex(const Vec2& p, const Sample& front, const Sample& back) {
    const double length = std::fmax(0.0, back.depth - front.depth) * glm::length(camera_.direction(p.x, p.y));
    out_.addVertex(p.x, p.y, front.depth, back.depth, length, front.value, back.value);
  }
  void addCorner(Local v) {
    const Sample sample = cell_.atCorner(v);
    addVertex(cell_.position(v), sample, sample);
  }
  void addPolygon(Local front, Local back) { out_.addPolygon(cell_.cell(), surface_index[front], surface_index[back]); }

  // Adds the vertices of a triangle of corners i, j and a third vertex, counterclockwise.
  template <typename AddThird>
  void addTriangle(Local i, Local j, bool counterclockwise, const AddThird& third) {
    if (!counterclockwise) {
      std::swap(i, j);
    }
    addCorner(i);
    addCorner(j);
    third();
  }

  // Face k is seen alone; its opposite corner k is seen inside it or on one of its edges. Every face of `others` shares
  // one edge with it and has a triangle to itself.
  void cornerInside(Local k, const Faces& others) {
    const Sample corner = cell_.atCorner(k);
    const Sample face = cell_.at(face_corners[k], cell_.position(k));
    const bool face_first = isFront(k);
    for (unsigned n = 0; n < others.count; ++n) {
      const Local other = others.list[n];
      // The two corners that the faces have in common, in the order that makes them counterclockwise in the back face.
      const auto& corners = face_corners[face_first ? other : k];
      const Local apart = face_first ? k : other;
      const std::size_t at = corners[0] == apart ? 0 : corners[1] == apart ? 1 : 2;
      addTriangle(corners[(at + 1) % 3], corners[(at + 2) % 3], true,
                  [&] { addVertex(cell_.position(k), face_first ? face : corner, face_first ? corner : face); });
      addPolygon(face_first ? k : other, face_first ? other : k);
    }
  }

  // The front faces are opposite to c and d and meet in the edge a b; the back faces, opposite to a and b, in c d.
  void crossingEdges() {
    const auto [c, d] = std::pair{front_.list[0], front_.list[1]};
    const auto [a, b] = std::pair{back_.list[0], back_.list[1]};
    // Of the edge a b the corners' distances from c d are the areas of the faces opposite to b and a, and so on.
    const mesh::Line front_edge{cell_.position(a), cell_.position(b)};
    const mesh::Line back_edge{cell_.position(c), cell_.position(d)};
    const double on_front = mesh::crossingParameter(front_edge, back_edge, area_[b], area_[a]);
    const double on_back = mesh::crossingParameter(back_edge, front_edge, area_[d], area_[c]);
    const Vec2 crossing = between(a, b, on_front);
    const Sample front = cell_.onEdge(a, b, on_front);
    const Sample back = cell_.onEdge(c, d, on_back);
    // Around the crossing the corners come as a, c, b, d or the other way.
    const bool counterclockwise =
        mesh::crossSign(cell_.position(a), cell_.position(b), cell_.position(c), cell_.position(d)) > 0;
    const std::array<Local, 4> around{a, c, b, d};
    for (std::size_t k = 0; k < 4; ++k) {
      const Local i = around[k];
      const Local j = around[(k + 1) % 4];
      const Local of_front = k % 2 == 0 ? i : j;
      const Local of_back = k % 2 == 0 ? j : i;
      addTriangle(i, j, counterclockwise, [&] { addVertex(crossing, front, back); });
      addPolygon(of_back == c ? d : c, of_front == a ? b : a);
    }
  }

  Vec2 between(Local a, Local b, double t) const {
    const Vec2& p = cell_.position(a);
    const Vec2& q = cell_.position(b);
    return t <= 0.5 ? p + t * (q - p) : q + (1.0 - t) * (p - q);
  }

  // Front and back face cover each other; of the corners opposite to them one is seen behind the other.
  void cornerBehindCorner() {
    const Local front = front_.list[0];
    const Local back = back_.list[0];
    for (const Local v : face_corners[back]) {
      if (v == front) {
        addVertex(cell_.position(v), cell_.atCorner(back), cell_.atCorner(front));
      } else {
        addCorner(v);
      }
    }
    addPolygon(front, back);
  }

  const CellOnScreen& cell_;
  const Camera& camera_;
  Regions& out_;
  std::array<mesh::SignedArea, 4> area_;
  Faces front_, back_, edge_on_;
};

}  // namespace

void projectTetrahedron(const CellOnScreen& cell, const Camera& camera, Regions& out) {
  Tetrahedron(cell, camera, out).project();
}

}  // namespace spillikin::project
