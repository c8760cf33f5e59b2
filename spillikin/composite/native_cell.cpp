#include "spillikin/composite/native_cell.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "spillikin/mesh/predicates.h"

namespace spillikin::composite::native {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// A form this close to 0, as a share of what it and its coefficients are summed up from, is decided exactly.
constexpr double sure = 1e-12;

// A triangle whose forms add up to so little, as a share of their terms, is seen edge-on: of where the ray crosses it
// doubles would leave less than seven digits.
constexpr double seen_edge_on = 1e-9;

// Of the cross product of two vectors of these magnitudes: what its components are differences of.
Vec3 magnitudes(const Vec3& a, const Vec3& b) {
  return {a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x};
}

// The sum of the magnitudes that a form adds up.
double terms(const Vec3& form, const Vec3& ray) {
  return std::abs(form.x * ray.x) + std::abs(form.y * ray.y) + std::abs(form.z);
}

// Screen extent as pixels whose centres lie in it, with a margin for the rounding of the projection.
constexpr double box_margin = 1e-6;  // pixels

struct Extent {
  double x0 = infinity, y0 = infinity, x1 = -infinity, y1 = -infinity;
  void add(double x, double y) {
    x0 = std::min(x0, x);
    x1 = std::max(x1, x);
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
  }
};

int firstCentre(double lo, int begin, int end) {
  return static_cast<int>(std::clamp(std::ceil(lo - 0.5 - box_margin), double(begin), double(end)));
}
int pastCentre(double hi, int begin, int end) {
  return static_cast<int>(std::clamp(std::floor(hi - 0.5 + box_margin) + 1.0, double(begin), double(end)));
}

// Whether a triangle may cover a pixel centre of the window: told by the box of its corners' places, of which float
// keeps far more than the margin.
bool mayCover(const Screen& screen, const std::array<mesh::Id, 3>& corner, const Box& window) {
  constexpr float margin = 0.01F;
  const Place *a = screen.places() + corner[0], *b = screen.places() + corner[1], *c = screen.places() + corner[2];
  if (a->x == not_a_place || b->x == not_a_place || c->x == not_a_place) return true;
  const auto apart = [&](float u, float v, float w, int begin, int end) {
    return std::max({u, v, w}) < static_cast<float>(begin) - margin ||
           std::min({u, v, w}) > static_cast<float>(end) + margin;
  };
  return !apart(a->x, b->x, c->x, window.x0, window.x1) && !apart(a->y, b->y, c->y, window.y0, window.y1);
}

}  // namespace

// A hull that crosses the eye plane reaches to infinity on the sides where its edges meet that plane.
Box pixelBox(const Screen& screen, std::span<const mesh::Id> vertices, const Box& window) {
  Extent extent;
  bool behind = false;
  for (const mesh::Id id : vertices) {
    const Vertex& v = screen.vertex(id);
    if (screen.parallel()) {
      extent.add(v.x, v.y);
    } else if (v.w > 0.0) {
      extent.add(v.x / v.w, v.y / v.w);
    } else {
      behind = true;
    }
  }
  if (extent.x0 > extent.x1) return {};
  if (behind) {
    for (const mesh::Id front : vertices) {
      const Vertex& a = screen.vertex(front);
      if (!(a.w > 0.0)) continue;
      for (const mesh::Id back : vertices) {
        const Vertex& b = screen.vertex(back);
        if (b.w > 0.0) continue;
        const double x = a.x * -b.w + b.x * a.w;
        const double y = a.y * -b.w + b.y * a.w;
        if (x >= 0.0) extent.x1 = infinity;
        if (x <= 0.0) extent.x0 = -infinity;
        if (y >= 0.0) extent.y1 = infinity;
        if (y <= 0.0) extent.y0 = -infinity;
      }
    }
  }
  return {firstCentre(extent.x0, window.x0, window.x1), firstCentre(extent.y0, window.y0, window.y1),
          pastCentre(extent.x1, window.x0, window.x1), pastCentre(extent.y1, window.y0, window.y1)};
}

void CellShape::set(const Screen& screen, mesh::Id cell, std::span<const sort::HalfSpace> keep, const Box& window) {
  screen_ = &screen;
  cell_ = cell;
  keep_ = keep;
  x0_ = window.x0;
  y0_ = window.y0;
  const mesh::Field& field = screen.frame().field;
  constant_ = field.association == mesh::Association::cells;
  cell_value_ = constant_ ? field.values[cell] : 0.0;
  mesh::surface(screen.mesh(), cell, surface_);
  triangles_.clear();
  for (const std::array<mesh::Id, 3>& corner : surface_.triangles) {
    if (mayCover(screen, corner, window)) addTriangle(corner);
  }
  const auto vertices = screen.mesh().vertices(cell);
  corners_.assign(vertices.begin(), vertices.end());
}

Box CellShape::pixels(const Box& window) const {
  return pixelBox(*screen_, corners_, window);
}

void CellShape::addTriangle(const std::array<mesh::Id, 3>& corner) {
  Triangle& t = triangles_.emplace_back();
  t.id = corner;
  std::array<mesh::Id, 3>& id = t.id;
  const auto order = [&](std::size_t i, std::size_t j) {
    if (id[i] > id[j]) {
      std::swap(id[i], id[j]);
      t.turned = !t.turned;
    }
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  std::array<Vec3, 3> p, size;
  t.lo = infinity;
  t.hi = -infinity;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vertex& v = screen_->vertex(id[i]);
    const double weight = screen_->parallel() ? 1.0 : v.w;
    p[i] = {v.x - x0_ * weight, v.y - y0_ * weight, weight};
    size[i] = glm::abs(Vec3(v.x, v.y, weight)) + Vec3(x0_ * std::abs(weight), y0_ * std::abs(weight), 0.0);
    t.value[i] = constant_ ? cell_value_ : screen_->frame().field.values[id[i]];
    t.lo = std::min(t.lo, v.w);
    t.hi = std::max(t.hi, v.w);
  }
  // Two triangles that share an edge agree on its form up to the sign.
  t.edge = {glm::cross(p[0], p[1]), glm::cross(p[1], p[2]), -glm::cross(p[0], p[2])};
  t.size = {magnitudes(size[0], size[1]), magnitudes(size[1], size[2]), magnitudes(size[0], size[2])};
  if (screen_->parallel()) {
    const double w0 = screen_->vertex(id[0]).w;
    t.depth_form = Vec3(w0, screen_->vertex(id[1]).w - w0, screen_->vertex(id[2]).w - w0);
    for (std::size_t i = 0; i < 3; ++i)
      p[i].z = screen_->vertex(id[i]).w;
  }
  t.normal = glm::cross(p[1] - p[0], p[2] - p[0]);
  t.level = glm::dot(p[0], t.normal);
}

// On which side of the line through two projected corners (`at` is the value of its form) a ray passes.
// Every line has a side for every ray, the same for all who ask: near 0 by the exact predicate, and where the ray meets
// the line, as if it had been moved by nothing at all to the right, and less downwards.
bool CellShape::positive(double at, const Vec3& size, mesh::Id a, mesh::Id b, const Vec3& ray) const {
  if (std::abs(at) > sure * terms(size, ray)) return at > 0.0;
  const project::Camera& camera = screen_->frame().camera;
  const std::vector<Vec3>& points = screen_->mesh().points;
  const Vec3 direction = camera.direction(x0_ + ray.x, y0_ + ray.y);
  const int exact = mesh::orientDirection(camera.origin(x0_ + ray.x, y0_ + ray.y), points[a], points[b], direction);
  if (exact != 0) return exact > 0;
  const int moved = mesh::orientEdge(points[a], points[b], camera.right(), direction);
  return (moved != 0 ? moved : mesh::orientEdge(points[a], points[b], -camera.top(), direction)) > 0;
}

// Where in a triangle that a ray crosses nearly within its plane, as weights of the corners. Rounding leaves nothing of
// the forms there; their exact values have one sign.
std::array<double, 3> CellShape::exactWeights(const Triangle& t, const Vec3& ray) const {
  const project::Camera& camera = screen_->frame().camera;
  const std::vector<Vec3>& points = screen_->mesh().points;
  const Vec3 origin = camera.origin(x0_ + ray.x, y0_ + ray.y), direction = camera.direction(x0_ + ray.x, y0_ + ray.y);
  const auto of = [&](int i, int j) {
    return std::abs(mesh::directionVolume(origin, points[t.id[i]], points[t.id[j]], direction));
  };
  const double a = of(1, 2), b = of(0, 2), c = of(0, 1), sum = a + b + c;
  if (!(sum > 0.0)) return {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0};
  return {a / sum, b / sum, c / sum};
}

bool CellShape::cross(const Triangle& t, const Vec3& ray, Crossing& out) const {
  const double ab = glm::dot(t.edge[0], ray);
  const double bc = glm::dot(t.edge[1], ray);
  const double ca = glm::dot(t.edge[2], ray);
  const bool side = positive(ab, t.size[0], t.id[0], t.id[1], ray);
  // The third form is stored turned round; its tie must fall as its neighbours see it.
  if (side != positive(bc, t.size[1], t.id[1], t.id[2], ray)) return false;
  if (side == positive(-ca, t.size[2], t.id[0], t.id[2], ray)) return false;
  const double plane = (ab + bc) + ca;
  double b, c, depth;
  if (std::abs(plane) <= seen_edge_on * (terms(t.size[0], ray) + terms(t.size[1], ray) + terms(t.size[2], ray))) {
    const auto [wa, wb, wc] = exactWeights(t, ray);
    b = wb;
    c = wc;
    const auto at = [&](int k) { return screen_->vertex(t.id[k]).w; };
    depth = wa * at(0) + wb * at(1) + wc * at(2);
  } else {
    b = std::clamp(ca / plane, 0.0, 1.0);
    c = std::clamp(ab / plane, 0.0, 1.0);
    depth = screen_->parallel() ? t.depth_form.x + b * t.depth_form.y + c * t.depth_form.z : t.level / plane;
  }
  out.depth = std::clamp(depth, t.lo, t.hi);
  out.value = t.value[0] + b * (t.value[1] - t.value[0]) + c * (t.value[2] - t.value[0]);
  return true;
}

void CellShape::spans(double x, double y, std::vector<Span>& out) {
  out.clear();
  crossings_.clear();
  const Vec3 ray(x - x0_, y - y0_, 1.0);
  Crossing crossing;
  for (const Triangle& t : triangles_) {
    if (cross(t, ray, crossing)) crossings_.push_back(crossing);
  }
  std::sort(crossings_.begin(), crossings_.end(),
            [](const Crossing& a, const Crossing& b) { return a.depth < b.depth; });
  // By twos, whichever of them leave: a ray along an edge may leave the cell where it has come in, and come back
  // farther on to leave at once, and where crossings meet rounding turns their order round.
  for (std::size_t i = 0; i + 1 < crossings_.size(); i += 2) {
    const Crossing& a = crossings_[i];
    const Crossing& b = crossings_[i + 1];
    out.push_back({a.depth, b.depth, a.value, b.value});
  }
  keepShare(x, y, out);
  trim(x, y, out);
}

namespace {

// Whether a ray at this depth is in a half-space, or in its plane and goes on to that side. Of a half-space and its
// counterpart one or the other holds, to the bit.
bool contains(const sort::HalfSpace& keep, const Limit& limit, double depth) {
  const double height = limit.at + limit.slope * depth;
  if (height != 0.0) return height > 0.0;
  for (const double sign : {limit.slope, keep.normal.x, keep.normal.y, keep.normal.z}) {
    if (sign != 0.0) return sign > 0.0;
  }
  return true;
}

}  // namespace

// Of a piece of the cell, what is its own to draw (see native_piece_share-inl.h): the middle is that of nearness.
void CellShape::keepShare(double x, double y, std::vector<Span>& out) const {
  for (const sort::HalfSpace& h : keep_) {
    const Limit limit = screen_->limit(h, x, y);
    const auto of_others = [&](const Span& s) {
      if (screen_->parallel()) return !contains(h, limit, 0.5 * (s.near + s.far));
      const double near = std::max(s.near, 0.0);  // no sooner than the ray itself
      const double sum = near + s.far;
      return !contains(h, limit, sum > 0.0 ? 2.0 * near * s.far / sum : 0.0);
    };
    out.erase(std::remove_if(out.begin(), out.end(), of_others), out.end());
  }
}

// The field runs on as if nothing had been cut: the scalar at a trimmed end is the line's value there.
void CellShape::trim(double x, double y, std::vector<Span>& out) const {
  double lo = screen_->parallel() ? -infinity : 0.0;
  double hi = infinity;
  for (const sort::HalfSpace& h : screen_->clips()) {
    const Limit l = screen_->limit(h, x, y);
    if (l.slope > 0.0) {
      lo = std::max(lo, -l.at / l.slope);
    } else if (l.slope < 0.0) {
      hi = std::min(hi, -l.at / l.slope);
    } else if (l.at < 0.0) {
      hi = -infinity;
    }
  }
  std::size_t kept = 0;
  for (const Span& s : out) {
    Span cut = s;
    const double slope = s.front == s.back ? 0.0 : (s.back - s.front) / (s.far - s.near);
    if (cut.near < lo) {
      cut.near = lo;
      cut.front = std::clamp(s.front + slope * (lo - s.near), std::min(s.front, s.back), std::max(s.front, s.back));
    }
    if (cut.far > hi) {
      cut.far = hi;
      cut.back = std::clamp(s.front + slope * (hi - s.near), std::min(s.front, s.back), std::max(s.front, s.back));
    }
    if (cut.far > cut.near) out[kept++] = cut;
  }
  out.resize(kept);
}

}  // namespace spillikin::composite::native
