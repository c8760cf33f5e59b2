#include "spillikin/reference/isoparametric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "spillikin/reference/trilinear.h"

namespace spillikin::reference {
namespace {

// VTK's corner of each corner a + 2 b + 4 c of the unit cube; wedges and pyramids are collapsed cubes.
constexpr std::array<std::size_t, 8> hexahedron_corners{0, 1, 3, 2, 4, 5, 7, 6};
constexpr std::array<std::size_t, 8> wedge_corners{0, 1, 0, 2, 3, 4, 3, 5};
constexpr std::array<std::size_t, 8> pyramid_corners{0, 1, 3, 2, 4, 4, 4, 4};

const std::array<std::size_t, 8>& corners(mesh::CellType type) {
  if (type == mesh::CellType::wedge) return wedge_corners;
  return type == mesh::CellType::pyramid ? pyramid_corners : hexahedron_corners;
}

// The cube's faces, around.
constexpr std::array<std::array<std::size_t, 4>, 6> cube_faces{
    {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}};

double cross(const Vec3& a, const Vec3& b) {
  return a.x * b.y - a.y * b.x;
}

// The element as the line sees it: (x, y) sheared as in exact.h, z along the line in world units.
struct Element {
  Trilinear<Vec3> place;
  Trilinear<double> value;
  std::array<mesh::Id, 8> id;
  double tolerance;  // of places: the rounding of coordinates relative to the line's origin

  Trilinear<Vec3> at(double z) const {
    Trilinear<Vec3> out = place;
    for (Vec3& corner : out.corner)
      corner.z -= z;
    return out;
  }
};

Element makeElement(const Line& line, const mesh::Mesh& mesh, mesh::Id cell, const double* values) {
  Element e;
  double reach = 0.0;
  const auto vertices = mesh.vertices(cell);
  const auto& corner = corners(mesh.cell_type[cell]);
  for (std::size_t n = 0; n < 8; ++n) {
    e.id[n] = vertices[corner[n]];
    const Vec3 p = mesh.points[e.id[n]] - line.o;
    e.place.corner[n] = Vec3(p[line.i] - p[line.k] * line.sx, p[line.j] - p[line.k] * line.sy,
                             (p.x * line.d.x + p.y * line.d.y + p.z * line.d.z) * line.inverse_dd * line.length);
    e.value.corner[n] = values != nullptr ? values[e.id[n]] : 0.0;
    reach = std::max({reach, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  e.tolerance = 16.0 * std::numeric_limits<double>::epsilon() * reach;
  return e;
}

bool missed(const Element& e) {
  Vec3 lo = e.place.corner[0], hi = lo;
  for (const Vec3& p : e.place.corner) {
    for (int axis = 0; axis < 2; ++axis) {
      lo[axis] = std::min(lo[axis], p[axis]);
      hi[axis] = std::max(hi[axis], p[axis]);
    }
  }
  return lo.x > e.tolerance || lo.y > e.tolerance || hi.x < -e.tolerance || hi.y < -e.tolerance;
}

// Both roots of a x^2 + b x + c = 0, without cancellation; at infinity where there are none.
std::array<double, 2> quadratic(double a, double b, double c) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  // A discriminant below the rounding of its terms is a double root: the line touches the face.
  double d = b * b - 4.0 * a * c;
  const double rounding = 8.0 * std::numeric_limits<double>::epsilon() * (b * b + std::abs(4.0 * a * c));
  if (d < -rounding) return {infinity, infinity};
  d = std::max(d, 0.0);
  const double q = -0.5 * (b + std::copysign(std::sqrt(d), b));
  return {a != 0.0 ? q / a : infinity, q != 0.0 ? c / q : (a != 0.0 ? 0.0 : infinity)};
}

// Where the line meets the bilinear face `face` of the cube, in z.
struct Place {
  double z;
  std::size_t face;
};
using Places = std::array<Place, 16>;  // 6 faces, at most two crossings each

// Where the line meets this bilinear face of the cube. Places that are no true crossings do no harm, so nearly parallel
// faces are let through generously; the corners come in an order of the face's own.
void crossFace(const Element& e, std::size_t face, Places& places, std::size_t& count) {
  std::array<std::size_t, 4> around = cube_faces[face];
  const auto smallest =
      std::min_element(around.begin(), around.end(), [&](std::size_t a, std::size_t b) { return e.id[a] < e.id[b]; });
  std::rotate(around.begin(), smallest, around.end());
  if (e.id[around[3]] < e.id[around[1]]) std::swap(around[1], around[3]);
  const Vec3 &f00 = e.place.corner[around[0]], &f10 = e.place.corner[around[1]], &f11 = e.place.corner[around[2]],
             &f01 = e.place.corner[around[3]];
  // f = p + q a + r b + s a b; eliminating b: (p + q a) x (r + s a) = 0.
  const Vec3 p = f00, q = f10 - f00, r = f01 - f00, s = (f11 - f10) - r;
  constexpr double outside = 1e-7;
  for (const double a : quadratic(cross(q, s), cross(p, s) + cross(q, r), cross(p, r))) {
    if (!(a >= -outside && a <= 1.0 + outside)) continue;
    const Vec3 along = r + a * s, from = p + a * q;
    const double squared = along.x * along.x + along.y * along.y;
    const double b = squared > 0.0 ? -(from.x * along.x + from.y * along.y) / squared : 0.0;
    if (!(b >= -outside && b <= 1.0 + outside)) continue;
    places[count++] = {from.z + b * along.z, face};
  }
}

bool surface(const Element& e, const std::array<std::size_t, 4>& around) {
  std::array<mesh::Id, 4> id{};
  for (std::size_t n = 0; n < 4; ++n)
    id[n] = e.id[around[n]];
  std::sort(id.begin(), id.end());
  return std::unique(id.begin(), id.end()) - id.begin() >= 3;
}

// The mesh's face at these corners, found by place: coincident vertices may bear other ids in it. None where there is
// none, as between a quadrilateral and two triangles.
mesh::Id meshFace(const Element& e, const mesh::Mesh& mesh, mesh::Id cell, const std::array<std::size_t, 4>& around) {
  const auto at = [&](mesh::Id vertex) {
    return std::any_of(around.begin(), around.end(),
                       [&](std::size_t c) { return mesh.points[e.id[c]] == mesh.points[vertex]; });
  };
  for (const mesh::FaceUse use : mesh.faces(cell)) {
    const mesh::Id f = use.face();
    const bool here = f < mesh.triangle_count() ? std::all_of(mesh.triangle[f].begin(), mesh.triangle[f].end(), at)
                                                : std::all_of(mesh.quad[f - mesh.triangle_count()].begin(),
                                                              mesh.quad[f - mesh.triangle_count()].end(), at);
    if (here) return f;
  }
  return mesh::none;
}

double jacobian(const Element& e, const Vec3& at) {
  const auto d = [&](const Vec3& step) { return e.place(at + step) - e.place(at - step); };
  constexpr double h = 0.25;  // differences of a linear function are exact for any step
  return glm::dot(d({h, 0, 0}), glm::cross(d({0, h, 0}), d({0, 0, h})));
}

// The parameters of the point at z, if the element reaches it.
bool invert(const Element& e, double sign, double z, std::vector<Vec3>& roots, Vec3& at) {
  findRoots(e.at(z), e.tolerance, roots);
  if (roots.empty()) return false;
  const auto better = [&](const Vec3& a, const Vec3& b) {
    const bool fa = sign * jacobian(e, a) > 0.0, fb = sign * jacobian(e, b) > 0.0;
    if (fa != fb) return fa;
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  };
  at = *std::min_element(roots.begin(), roots.end(), better);
  return true;
}

struct Sample {
  double z;
  Vec3 at;
  double value;
};

// Follows the field along the line through one element.
class Follower {
 public:
  Follower(const Element& element, const Line& line, mesh::Id cell, double tolerance, std::vector<Vec3>& roots,
           std::vector<Span>& out)
      : e_(element),
        sign_(jacobian(element, Vec3(0.5))),
        per_z_(1.0 / line.length),
        cell_(cell),
        tolerance_(tolerance),
        roots_(roots),
        out_(out) {}

  // The element's field at z, near a known sample: by Newton from there, by certified inversion where that strays.
  Sample sample(double z, const Vec3& guess) {
    Vec3 at = guess;
    if (!newton(e_.at(z), e_.tolerance, at) || !near(at)) {
      at = guess;
      Vec3 found;
      if (invert(e_, sign_, z, roots_, found)) at = found;
    }
    at = glm::clamp(at, Vec3(0.0), Vec3(1.0));
    return {z, at, e_.value(at)};
  }

  void split(const Sample& a, const Sample& b, int depth) {
    constexpr int deepest = 16;
    const Sample middle = sample(0.5 * (a.z + b.z), 0.5 * (a.at + b.at));
    const bool straight = std::abs(middle.value - (a.value + 0.5 * (b.value - a.value))) <= tolerance_;
    // A cubic may pass through the middle of its chord, so the quarters have a say.
    if (depth >= deepest || (straight && quarterStraight(a, middle) && quarterStraight(middle, b))) {
      out_.push_back({cell_, mesh::none, a.z * per_z_, b.z * per_z_, a.value, b.value});
      return;
    }
    split(a, middle, depth + 1);
    split(middle, b, depth + 1);
  }

  bool find(double z, Sample& s) {
    if (!invert(e_, sign_, z, roots_, s.at)) return false;
    s.z = z;
    s.value = e_.value(s.at);
    return true;
  }

 private:
  bool quarterStraight(const Sample& a, const Sample& b) {
    const Sample s = sample(0.5 * (a.z + b.z), 0.5 * (a.at + b.at));
    return std::abs(s.value - (a.value + 0.5 * (b.value - a.value))) <= tolerance_;
  }
  static bool near(const Vec3& at) {
    constexpr double by = 1e-6;
    return at.x >= -by && at.y >= -by && at.z >= -by && at.x <= 1 + by && at.y <= 1 + by && at.z <= 1 + by;
  }

  const Element& e_;
  double sign_;  // of the Jacobian in the element's middle
  double per_z_;
  mesh::Id cell_;
  double tolerance_;
  std::vector<Vec3>& roots_;
  std::vector<Span>& out_;
};

}  // namespace

bool curved(mesh::CellType type) {
  return type == mesh::CellType::hexahedron || type == mesh::CellType::wedge || type == mesh::CellType::pyramid;
}

void crossCurved(const Line& line, const mesh::Mesh& mesh, mesh::Id cell, const double* values, double tolerance,
                 std::vector<Vec3>& roots, std::vector<Span>& out) {
  const Element e = makeElement(line, mesh, cell, values);
  if (missed(e)) return;
  Places places{};
  std::size_t count = 0;
  for (std::size_t face = 0; face < cube_faces.size(); ++face) {
    if (surface(e, cube_faces[face])) crossFace(e, face, places, count);
  }
  std::sort(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Place& a, const Place& b) { return a.z != b.z ? a.z < b.z : a.face < b.face; });
  Follower follower(e, line, cell, tolerance, roots, out);
  std::size_t last = count;  // the place at which the span last added ends
  const auto leave = [&] {
    if (last < count) out.back().leave_face = meshFace(e, mesh, cell, cube_faces[places[last].face]);
  };
  for (std::size_t n = 0; n + 1 < count; ++n) {
    const double lo = places[n].z, hi = places[n + 1].z;
    if (!(hi - lo > e.tolerance)) continue;
    Sample middle;
    if (!follower.find(0.5 * (lo + hi), middle)) {
      leave();
      last = count;
      continue;
    }
    follower.split(follower.sample(lo, middle.at), middle, 0);
    follower.split(middle, follower.sample(hi, middle.at), 0);
    last = n + 1;
  }
  leave();
}

}  // namespace spillikin::reference
