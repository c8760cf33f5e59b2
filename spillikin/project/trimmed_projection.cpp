#include "spillikin/project/trimmed_projection.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <tuple>

namespace spillikin::project {

namespace {

// Pixels: what is narrower comes from the rounding of coordinates (1e-13 for an image of a thousand pixels) and has no
// depth of its own.
constexpr double narrow = 1e-8;

// Of the cell's size: a vertex that stands out of a face's plane by less is there by rounding.
constexpr double flat = 1e-9;

bool hasWidth(const std::vector<Vec2>& polygon) {
  double twice = 0.0;
  double reach = 0.0;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
    const Vec2 a = polygon[k] - polygon[0];
    const Vec2 b = polygon[k + 1] - polygon[0];
    twice += a.x * b.y - a.y * b.x;
    reach = std::max({reach, glm::length(a), glm::length(b)});
  }
  return twice > narrow * reach;
}

Vec2 middle(const std::vector<Vec2>& polygon) {
  Vec2 sum(0.0);
  for (const Vec2& p : polygon) {
    sum += p;
  }
  return sum / static_cast<double>(polygon.size());
}

}  // namespace

double TrimmedProjection::Limit::depth(const Vec2& p) const {
  return at(numerator, p) / at(denominator, p);
}

// A form that is positive where `first` lies deeper than `second`; somewhere: any position, the denominators do not
// change sign where it is used.
TrimmedProjection::Form TrimmedProjection::order(const Limit& first, const Limit& second, const Vec2& somewhere) {
  const auto product = [](const Form& a, const Form& b) { return constant(a) ? a.z * b : b.z * a; };
  const Form difference = product(first.numerator, second.denominator) - product(second.numerator, first.denominator);
  const bool same_sign = (at(first.denominator, somewhere) > 0.0) == (at(second.denominator, somewhere) > 0.0);
  return same_sign ? difference : -difference;
}

void TrimmedProjection::setTriangles(const CellOnScreen& cell) {
  const auto corners = cell.triangles();
  triangles_.resize(corners.size());
  const auto homogeneous = [&](CellOnScreen::Local v) {
    const Vec3& h = cell.homogeneous(v);
    return cell.parallel() ? Vec3(h.x, h.y, 1.0) : h;
  };
  for (std::size_t t = 0; t < corners.size(); ++t) {
    Triangle& triangle = triangles_[t];
    const auto& [a, b, c] = corners[t];
    const Vec3 ha = homogeneous(a);
    const Vec3 hb = homogeneous(b);
    const Vec3 hc = homogeneous(c);
    triangle.edge = {glm::cross(hb, hc), glm::cross(hc, ha), glm::cross(ha, hb)};
    triangle.sum = triangle.edge[0] + triangle.edge[1] + triangle.edge[2];
    triangle.determinant = glm::dot(ha, triangle.edge[0]);
    const std::array<double, 3> depth{cell.homogeneous(a).z, cell.homogeneous(b).z, cell.homogeneous(c).z};
    std::tie(triangle.near, triangle.far) = std::minmax({depth[0], depth[1], depth[2]});
    const Form constant_determinant(0.0, 0.0, triangle.determinant);
    if (cell.parallel()) {
      triangle.limit.numerator =
          depth[0] * triangle.edge[0] + depth[1] * triangle.edge[1] + depth[2] * triangle.edge[2];
      triangle.limit.denominator = constant_determinant;
      triangle.sum = constant_determinant;
    } else {
      triangle.limit.numerator = constant_determinant;
      triangle.limit.denominator = triangle.sum;
    }
  }
}

// On the ray origin + w direction the plane's function is g0 + w g1: it ends the ray at w = -g0 / g1.
void TrimmedProjection::setPlanes(const Camera& camera, std::span<const sort::HalfSpace> planes) {
  planes_.resize(planes.size());
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const auto& [normal, offset] = planes[k];
    planes_[k].numerator = -Form(glm::dot(normal, camera.originDx()), glm::dot(normal, camera.originDy()),
                                 glm::dot(normal, camera.origin0()) + offset);
    planes_[k].denominator = {glm::dot(normal, camera.directionDx()), glm::dot(normal, camera.directionDy()),
                              glm::dot(normal, camera.direction0())};
    planes_[k].end = static_cast<std::int32_t>(k);
  }
}

bool TrimmedProjection::convex(const CellOnScreen& cell) const {
  double size = 0.0;
  for (CellOnScreen::Local v = 1; v < cell.size(); ++v) {
    size = std::fmax(size, glm::distance(cell.world(v), cell.world(0)));
  }
  for (const auto& [a, b, c] : cell.triangles()) {
    const Vec3 normal = glm::cross(cell.world(b) - cell.world(a), cell.world(c) - cell.world(a));
    const double limit = flat * size * glm::length(normal);
    for (CellOnScreen::Local v = 0; v < cell.size(); ++v) {
      if (glm::dot(cell.world(v) - cell.world(a), normal) > limit) {
        return false;
      }
    }
  }
  return true;
}

TrimmedProjection::Polygon& TrimmedProjection::scratch(std::size_t level) {
  while (scratch_.size() <= level) {
    scratch_.emplace_back();
  }
  return scratch_[level];
}

// The part of a convex polygon where the form is not negative; false when none is left.
bool TrimmedProjection::cut(const Polygon& in, const Form& keep, Polygon& out) const {
  out.clear();
  for (std::size_t k = 0; k < in.size(); ++k) {
    const Vec2& p = in[k];
    const Vec2& q = in[(k + 1) % in.size()];
    const double fp = at(keep, p);
    const double fq = at(keep, q);
    if (fp >= 0.0) {
      out.push_back(p);
    }
    if ((fp > 0.0 && fq < 0.0) || (fp < 0.0 && fq > 0.0)) {
      out.push_back(p + fp / (fp - fq) * (q - p));
    }
  }
  return out.size() >= 3 && hasWidth(out);
}

void TrimmedProjection::operator()(const CellOnScreen& cell, const Camera& camera,
                                   std::span<const sort::HalfSpace> planes, Regions& out) {
  cell_ = &cell;
  camera_ = &camera;
  out_ = &out;
  setTriangles(cell);
  setPlanes(camera, planes);
  convex_ = convex(cell);
  const double right = camera.width() + 1.0;
  const double bottom = camera.height() + 1.0;
  scratch(8);
  for (std::uint32_t b = 0; b < triangles_.size(); ++b) {
    const Triangle& exit = triangles_[b];
    // A ray that leaves through a triangle whose outer side the eye is on does so behind the eye.
    if (!(exit.determinant > 0.0)) {
      continue;
    }
    scratch_[0].assign({{-1.0, -1.0}, {right, -1.0}, {right, bottom}, {-1.0, bottom}});
    if (!cut(scratch_[0], exit.edge[0], scratch_[1]) || !cut(scratch_[1], exit.edge[1], scratch_[2]) ||
        !cut(scratch_[2], exit.edge[2], scratch_[3])) {
      continue;
    }
    for (std::uint32_t f = 0; f < triangles_.size(); ++f) {
      const Triangle& entry = triangles_[f];
      if (f == b || entry.determinant == 0.0 || (cell.parallel() && entry.determinant > 0.0)) {
        continue;
      }
      if (!cut(scratch_[3], -entry.edge[0], scratch_[4]) || !cut(scratch_[4], -entry.edge[1], scratch_[5]) ||
          !cut(scratch_[5], -entry.edge[2], scratch_[6])) {
        continue;
      }
      Pair pair{f, b, entry.limit, exit.limit};
      if (!cell.parallel() && entry.determinant > 0.0) {  // the entry lies behind the eye
        pair.front = Limit{};
        pair.front.end = ends_at_eye;
      }
      splitByEdges(pair, 0, 6);
    }
  }
}

// In a cell that is not convex other triangles may come between entry and exit: the polygon is cut along all edges, so
// that each piece has the same triangles on all of its rays.
void TrimmedProjection::splitByEdges(const Pair& pair, std::size_t edge, std::size_t level) {
  if (convex_) {
    trimByPlanes(pair, 0, level);
    return;
  }
  if (edge == 3 * triangles_.size()) {
    if (consecutive(pair, scratch_[level])) {
      trimByPlanes(pair, 0, level);
    }
    return;
  }
  const Form line = triangles_[edge / 3].edge[edge % 3];
  scratch(level + 1);
  bool crossed = false;
  const Vec2 first = scratch_[level][0];
  for (const Vec2& p : scratch_[level]) {
    crossed = crossed || at(line, p) * at(line, first) < 0.0;
  }
  if (!crossed) {  // the line misses the polygon, or touches it where the first vertex may lie on the line
    const auto [low, high] =
        std::minmax_element(scratch_[level].begin(), scratch_[level].end(),
                            [&](const Vec2& p, const Vec2& q) { return at(line, p) < at(line, q); });
    crossed = at(line, *low) < 0.0 && at(line, *high) > 0.0;
  }
  if (!crossed) {
    splitByEdges(pair, edge + 1, level);
    return;
  }
  for (const Form& half : {line, -line}) {
    if (cut(scratch_[level], half, scratch(level + 1))) {
      splitByEdges(pair, edge + 1, level + 1);
    }
  }
}

bool TrimmedProjection::consecutive(const Pair& pair, const Polygon& polygon) const {
  const Vec2 p = middle(polygon);
  const double enters = triangles_[pair.entry].limit.depth(p);
  const double leaves = triangles_[pair.exit].limit.depth(p);
  if (!(enters < leaves)) {
    return false;
  }
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const auto& [e0, e1, e2] = triangles_[t].edge;
    const auto [low, high] = std::minmax({at(e0, p), at(e1, p), at(e2, p)});
    if (t != pair.entry && t != pair.exit && (low > 0.0 || high < 0.0)) {
      const double depth = triangles_[t].limit.depth(p);
      if (depth > enters && depth < leaves) {
        return false;
      }
    }
  }
  return true;
}

void TrimmedProjection::trimByPlanes(const Pair& pair, std::size_t plane, std::size_t level) {
  scratch(level + 3);
  if (plane == planes_.size()) {
    const Form rest = order(pair.back, pair.front, middle(scratch_[level]));
    if (cut(scratch_[level], rest, scratch_[level + 1])) {
      emit(pair, level + 1);
    }
    return;
  }
  const Limit& limit = planes_[plane];
  if (limit.denominator == Form(0.0)) {  // the plane is seen edge-on from everywhere
    if (cut(scratch_[level], -limit.numerator, scratch_[level + 1])) {
      trimByPlanes(pair, plane + 1, level + 1);
    }
    return;
  }
  if (cut(scratch_[level], limit.denominator, scratch_[level + 1])) {
    trimFront(pair, plane, level + 1);
  }
  if (cut(scratch_[level], -limit.denominator, scratch_[level + 1])) {
    trimBack(pair, plane, level + 1);
  }
}

// Where rays run towards the plane's inner side they begin at it, if it lies deeper than what they began at so far.
void TrimmedProjection::trimFront(const Pair& pair, std::size_t plane, std::size_t level) {
  scratch(level + 1);
  const Form deeper = order(planes_[plane], pair.front, middle(scratch_[level]));
  if (cut(scratch_[level], deeper, scratch_[level + 1])) {
    Pair trimmed = pair;
    trimmed.front = planes_[plane];
    trimByPlanes(trimmed, plane + 1, level + 1);
  }
  if (cut(scratch_[level], -deeper, scratch_[level + 1])) {
    trimByPlanes(pair, plane + 1, level + 1);
  }
}

void TrimmedProjection::trimBack(const Pair& pair, std::size_t plane, std::size_t level) {
  scratch(level + 1);
  const Form nearer = order(pair.back, planes_[plane], middle(scratch_[level]));
  if (cut(scratch_[level], nearer, scratch_[level + 1])) {
    Pair trimmed = pair;
    trimmed.back = planes_[plane];
    trimByPlanes(trimmed, plane + 1, level + 1);
  }
  if (cut(scratch_[level], -nearer, scratch_[level + 1])) {
    trimByPlanes(pair, plane + 1, level + 1);
  }
}

// What the line of p meets on the triangle: the edge forms are the barycentric coordinates in space, times their sum.
Sample TrimmedProjection::onTriangle(std::uint32_t triangle, const Vec2& p) const {
  const Triangle& t = triangles_[triangle];
  const auto& corner = cell_->triangles()[triangle];
  const double sum = at(t.sum, p);
  std::array<double, 3> weight{};
  std::size_t base = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    weight[k] = sum == 0.0 ? 1.0 / 3.0 : std::clamp(at(t.edge[k], p) / sum, 0.0, 1.0);
    base = weight[k] > weight[base] ? k : base;
  }
  const double total = weight[0] + weight[1] + weight[2];
  const std::size_t i = (base + 1) % 3, j = (base + 2) % 3;
  const double s = cell_->value(corner[base]);
  const double w = cell_->homogeneous(corner[base]).z;
  const auto blend = [&](double from, double to_i, double to_j) {
    return from + weight[i] / total * (to_i - from) + weight[j] / total * (to_j - from);
  };
  return {blend(w, cell_->homogeneous(corner[i]).z, cell_->homogeneous(corner[j]).z),
          blend(s, cell_->value(corner[i]), cell_->value(corner[j]))};
}

void TrimmedProjection::emit(const Pair& pair, std::size_t level) {
  Polygon& polygon = scratch_[level];
  // Where two lines meet on a third there are two vertices.
  const auto close = [](const Vec2& p, const Vec2& q) { return glm::distance(p, q) < narrow; };
  polygon.erase(std::unique(polygon.begin(), polygon.end(), close), polygon.end());
  while (polygon.size() > 1 && close(polygon.front(), polygon.back())) {
    polygon.pop_back();
  }
  if (polygon.size() < 3) {
    return;
  }
  for (const Vec2& p : polygon) {
    const Sample enters = onTriangle(pair.entry, p);
    const Sample leaves = onTriangle(pair.exit, p);
    const double whole = leaves.depth - enters.depth;
    const auto end = [&](const Limit& limit, const Sample& untrimmed) {
      if (limit.end == ends_at_triangle) {
        return untrimmed;
      }
      const double depth =
          std::clamp(limit.depth(p), std::fmin(enters.depth, leaves.depth), std::fmax(enters.depth, leaves.depth));
      const double share = whole > 0.0 ? (depth - enters.depth) / whole : 0.0;
      return Sample{depth, enters.value + share * (leaves.value - enters.value)};
    };
    const Sample front = end(pair.front, enters);
    const Sample back = end(pair.back, leaves);
    const double length = std::fmax(0.0, back.depth - front.depth) * glm::length(camera_->direction(p.x, p.y));
    out_->addVertex(p.x, p.y, front.depth, back.depth, length, front.value, back.value);
  }
  out_->addPolygon(cell_->cell(), pair.entry, pair.exit, pair.front.end, pair.back.end);
}

}  // namespace spillikin::project
