#include "spillikin/composite/native_whole.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "spillikin/composite/native_kernel.h"

namespace spillikin::composite::native {

namespace {

WholeCell::Form rounded(const Vec3& form) {
  return {static_cast<float>(form.x), static_cast<float>(form.y), static_cast<float>(form.z)};
}

double reach(const Vec3& form) {
  return (std::abs(form.x) + std::abs(form.y)) * tile_size + std::abs(form.z);
}

// v, kept so far from 0 that a form of this reach divided by it stays within the limit of nearness.
double awayFromZero(const TileView& view, double v, double reached) {
  const double least = reached / (nearness_limit * view.nearness_scale) + 1e-300;
  return v >= 0.0 ? std::max(v, least) : std::min(v, -least);
}

// Edges by the ids of their ends, in a table with open addresses that a cell never fills.
class Edges {
 public:
  explicit Edges(WholeCell& cell) : cell_(cell) { cell_.edge_count = 0; }
  bool full() const { return full_; }
  // `size` is what the form's coefficients are summed up from.
  std::uint8_t find(mesh::Id a, mesh::Id b, const Vec3& form, const Vec3& size) {
    std::size_t slot = (a * 0x9e3779b1U ^ b * 0x85ebca6bU) >> (32U - slot_bits);
    for (; slots_[slot] != 0; slot = (slot + 1) % slots_.size()) {
      const std::uint8_t e = slots_[slot] - 1U;
      if (ends_[e][0] == a && ends_[e][1] == b) return e;
    }
    full_ = full_ || cell_.edge_count == WholeCell::max_edges;
    if (full_) return 0;
    const std::size_t e = cell_.edge_count++;
    slots_[slot] = static_cast<std::uint8_t>(e + 1);
    ends_[e] = {a, b};
    // Only the side matters: scaled to stay within float, the same from every cell. What is left of an edge along the
    // rays is rounding, and must stay too small to tell a side by.
    constexpr double cancelled = 1e-6;
    cell_.edge[e] = rounded(form * (1.0 / std::max({reach(form), cancelled * reach(size), 1e-300})));
    return static_cast<std::uint8_t>(e);
  }

 private:
  static constexpr unsigned slot_bits = 7;
  static_assert(WholeCell::max_edges < (1U << slot_bits));
  WholeCell& cell_;
  std::array<std::uint8_t, 1U << slot_bits> slots_{};  // an edge + 1, or 0
  std::array<std::array<mesh::Id, 2>, WholeCell::max_edges> ends_;
  bool full_ = false;
};

// As the tetrahedra's planes (see native_setup-inl.h).
void setPlanes(const TileView& view, const CellShape::Triangle& t, WholeCell::Triangle& out) {
  const Depths& depths = view.screen->depths();
  const double level = t.level - (depths.parallel ? t.normal.z * depths.z0 : 0.0);
  const double constant = depths.parallel ? -level : t.normal.z;
  const double pivot = depths.parallel ? t.normal.z : level;
  const double inverse = 1.0 / awayFromZero(view, pivot, reach({t.normal.x, t.normal.y, constant}));
  Vec3 z = Vec3(t.normal.x, t.normal.y, constant) * inverse;
  if (!depths.parallel) z.z -= depths.z0;
  out.nearness = rounded(z);
  out.nearest = static_cast<float>(depths.nearness(t.lo));
  out.farthest = static_cast<float>(depths.nearness(t.hi));
  const double a = view.screen->scaled(t.value[0]);
  const double b = view.screen->scaled(t.value[1]);
  const double c = view.screen->scaled(t.value[2]);
  out.base = static_cast<float>(a);
  out.scalar = rounded(((b - a) * t.edge[2] + (c - a) * t.edge[0]) * inverse);
  out.lo = static_cast<float>(std::min(std::min(a, b), c));
  out.hi = static_cast<float>(std::max(std::max(a, b), c));
}

}  // namespace

TileRays::TileRays(const TileView& view) {
  const project::Camera& camera = view.screen->frame().camera;
  const bool parallel = view.screen->parallel();
  origin = parallel ? camera.origin(view.x0, view.y0) : camera.origin0();
  along = parallel ? camera.direction0() : camera.direction(view.x0, view.y0);
  dx = parallel ? camera.originDx() : camera.directionDx();
  dy = parallel ? camera.originDy() : camera.directionDy();
}

// A half-space on the ray of a pixel is at + slope * depth >= 0. In perspective the first is constant and the second
// linear in the pixel, in a parallel view the other way round; either way the plane's nearness is linear. Both pieces
// at a cut have the same plane, to the bit.
WholeCell::Bound boundOf(const TileView& view, const TileRays& rays, const sort::HalfSpace& keep) {
  const Depths& depths = view.screen->depths();
  const double at = glm::dot(keep.normal, rays.origin) + keep.offset;
  const double slope = glm::dot(keep.normal, rays.along);
  const Vec3 form(glm::dot(keep.normal, rays.dx), glm::dot(keep.normal, rays.dy), depths.parallel ? at : slope);
  const double pivot = depths.parallel ? slope : -at;
  Vec3 z = form / awayFromZero(view, pivot, reach(form));
  z.z += depths.parallel ? depths.z0 : -depths.z0;
  return {rounded(z), static_cast<float>(double{float_rounding} * reach(z)), pivot >= 0.0};
}

bool flatten(const TileView& view, const CellShape& shape, const Box& pixels, WholeCell& out) {
  const Screen& screen = *view.screen;
  const std::vector<CellShape::Triangle>& triangles = shape.triangles();
  if (triangles.size() > WholeCell::max_triangles) return false;
  out.bound_count = 0;
  if (!shape.keep().empty()) {
    const TileRays rays(view);
    if (shape.keep().size() > WholeCell::max_limits) return false;
    for (const sort::HalfSpace& keep : shape.keep())
      out.bound[out.bound_count++] = boundOf(view, rays, keep);
  }
  out.triangle_count = triangles.size();
  out.look = {screen.pieces().data(), std::numeric_limits<std::int32_t>::max(), 0, std::numeric_limits<float>::max(),
              std::numeric_limits<float>::lowest()};
  Edges edges(out);
  double lo = std::numeric_limits<double>::infinity();
  double hi = -lo;
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const CellShape::Triangle& t = triangles[k];
    lo = std::min(lo, t.lo);
    hi = std::max(hi, t.hi);
    if (!screen.parallel() && !(t.lo > 0.0)) return false;
    WholeCell::Triangle& flat = out.triangle[k];
    flat.ab = edges.find(t.id[0], t.id[1], t.edge[0], t.size[0]);
    flat.bc = edges.find(t.id[1], t.id[2], t.edge[1], t.size[1]);
    flat.ac = edges.find(t.id[0], t.id[2], -t.edge[2], t.size[2]);
    flat.turned = t.turned;
    setPlanes(view, t, flat);
    out.look.lo = std::min(out.look.lo, flat.lo);
    out.look.hi = std::max(out.look.hi, flat.hi);
    for (const mesh::Id id : t.id) {
      const auto piece = static_cast<std::int32_t>(screen.cell_pieces().empty() ? screen.vertex(id).piece
                                                                                : screen.cell_pieces()[shape.cell()]);
      out.look.first = std::min(out.look.first, piece);
      out.look.last = std::max(out.look.last, piece);
    }
  }
  if (edges.full()) return false;
  out.care = view.peaks ? Care::peak : out.look.care(static_cast<float>(hi - lo) * view.longest, true);
  out.blocks = {(pixels.x0 - view.x0) / 4, (pixels.y0 - view.y0) / 4, (pixels.x1 - view.x0 + 3) / 4,
                (pixels.y1 - view.y0 + 3) / 4};
  return true;
}

}  // namespace spillikin::composite::native
