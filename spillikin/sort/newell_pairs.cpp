#include "spillikin/sort/newell_pairs.h"

#include <algorithm>
#include <cmath>

#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

bool has(const std::array<mesh::Id, 3>& corners, mesh::Id v) {
  return v == corners[0] || v == corners[1] || v == corners[2];
}

bool sameCorners(const std::array<mesh::Id, 3>& s, const std::array<mesh::Id, 3>& t) {
  return has(t, s[0]) && has(t, s[1]) && has(t, s[2]);
}

}  // namespace

Triangle NewellPairs::triangle(std::uint32_t facet) const {
  const auto& t = facets_.corners(facet);
  return {mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]]};
}

void NewellPairs::begin(const Viewpoint& viewpoint) {
  viewpoint_ = viewpoint;
  a_.id = mesh::none;
  sign_.resize(facets_.count());
  mesh::parallelFor(facets_.count(), [&](std::size_t i) {
    const auto f = static_cast<std::uint32_t>(i);
    const auto& t = facets_.corners(f);
    int sign = facets_.side(f, viewpoint.w == 0.0 ? Vec3(viewpoint) : Vec3(viewpoint) - mesh_.points[t[0]]);
    if (sign == 0) sign = mesh::orientViewpoint(mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]], viewpoint);
    sign_[i] = static_cast<std::int8_t>(sign);
  });
}

void NewellPairs::take(mesh::Id id, Cell& cell) const {
  cell.id = id;
  cell.outlined = false;
  cell.points.clear();
  for (const mesh::Id v : mesh_.vertices(id))
    cell.points.push_back(mesh_.points[v]);
  cell.towards.clear();
  cell.away.clear();
  for (std::uint32_t f = facets_.begin(id); f < facets_.end(id); ++f) {
    if (!facets_.is(f, CellFacets::supports)) continue;
    if (sign_[f] >= 0) cell.towards.push_back(f);
    if (sign_[f] <= 0) cell.away.push_back(f);
  }
}

// Is all of the cell certainly on the side of the facet's plane that its normal points to, or in the plane?
NewellPairs::Verdict NewellPairs::before(std::uint32_t facet, const Cell& cell) const {
  const auto& corners = facets_.corners(facet);
  const Vec3& corner = mesh_.points[corners[0]];
  const auto vertices = mesh_.vertices(cell.id);
  bool open = false;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const int side = facets_.side(facet, cell.points[i] - corner);
    if (side > 0 || (side == 0 && has(corners, vertices[i]))) continue;
    if (side < 0) return Verdict::not_apart;
    open = true;
  }
  return open ? Verdict::open : Verdict::apart;
}

bool NewellPairs::beforeExactly(std::uint32_t facet, mesh::Id cell) const {
  const Triangle t = triangle(facet);
  const auto vertices = mesh_.vertices(cell);
  return std::all_of(vertices.begin(), vertices.end(), [&](mesh::Id v) {
    return has(facets_.corners(facet), v) || mesh::orient3d(t[0], t[1], t[2], mesh_.points[v]) >= 0;
  });
}

// A triangle of both, through which rays leave a and enter b. Vertices are compared, not neighbours.
bool NewellPairs::shareSeenFace(const Cell& a, const Cell& b) const {
  const auto va = mesh_.vertices(a.id), vb = mesh_.vertices(b.id);
  int shared = 0;
  for (const mesh::Id v : va)
    shared += std::find(vb.begin(), vb.end(), v) != vb.end() ? 1 : 0;
  if (shared < 3) return false;
  for (std::uint32_t f = facets_.begin(a.id); f < facets_.end(a.id); ++f) {
    if (sign_[f] >= 0 || !facets_.is(f, CellFacets::bounds)) continue;
    for (std::uint32_t g = facets_.begin(b.id); g < facets_.end(b.id); ++g) {
      if (sign_[g] <= 0 || !facets_.is(g, CellFacets::bounds)) continue;
      if (!sameCorners(facets_.corners(f), facets_.corners(g))) continue;
      const Triangle t = triangle(f);
      if (seen(t, viewpoint_, sliver(t))) return true;
    }
  }
  return false;
}

// The edges of a convex cell between triangles turned towards the viewer and others, around the former.
void NewellPairs::findOutline(Cell& cell) const {
  cell.outlined = true;
  cell.outline.clear();
  const bool parallel = viewpoint_.w == 0.0;
  const auto towards = [&](std::uint32_t f) { return sign_[f] > 0 && facets_.is(f, CellFacets::bounds); };
  const std::uint32_t begin = facets_.begin(cell.id), end = facets_.end(cell.id);
  for (std::uint32_t f = begin; f < end; ++f) {
    if (!towards(f)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const mesh::Id p = facets_.corners(f)[k], q = facets_.corners(f)[(k + 1) % 3];
      bool inner = false;
      for (std::uint32_t g = begin; g < end && !inner; ++g) {
        const auto& t = facets_.corners(g);
        inner =
            g != f && towards(g) && ((t[0] == q && t[1] == p) || (t[1] == q && t[2] == p) || (t[2] == q && t[0] == p));
      }
      if (inner) continue;
      const Vec3 s = parallel ? Vec3(viewpoint_) : Vec3(viewpoint_) - mesh_.points[p],
                 u = mesh_.points[q] - mesh_.points[p];
      // The determinant of u, w and s; Shewchuk's bound of it is 7.1 half units of the last place of these magnitudes.
      const Vec3 left(s.y * u.z, s.z * u.x, s.x * u.y), right(s.z * u.y, s.x * u.z, s.y * u.x);
      const double magnitude = std::max({std::abs(left.x) + std::abs(right.x), std::abs(left.y) + std::abs(right.y),
                                         std::abs(left.z) + std::abs(right.z)});
      cell.outline.push_back({{p, q}, left - right, 0x1p-50 * magnitude});
    }
  }
}

// Is all of b, as seen, certainly beyond one edge of the outline of a, or on it?
bool NewellPairs::outlineParts(Cell& a, const Cell& b) const {
  if (!facets_.convex(a.id)) return false;
  if (!a.outlined) findOutline(a);
  const auto vertices = mesh_.vertices(b.id);
  return std::any_of(a.outline.begin(), a.outline.end(), [&](const Edge& e) {
    const Vec3& corner = mesh_.points[e.ends[0]];
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (vertices[i] == e.ends[0] || vertices[i] == e.ends[1]) continue;
      const Vec3 w = b.points[i] - corner;
      const double height = e.normal.x * w.x + e.normal.y * w.y + e.normal.z * w.z;
      if (!(height < -(e.bound * (std::abs(w.x) + std::abs(w.y) + std::abs(w.z)) + 0x1p-900))) return false;
    }
    return true;
  });
}

// The definitive test: a triangle of a that rays leave it through and one of b that they enter it through overlap as
// seen, wider than a sliver, the first nearer or at the same place.
bool NewellPairs::trianglesHide(mesh::Id a, mesh::Id b) const {
  for (std::uint32_t f = facets_.begin(a); f < facets_.end(a); ++f) {
    if (sign_[f] >= 0 || !facets_.is(f, CellFacets::bounds)) continue;
    const Triangle exit = triangle(f);
    const double width = sliver(exit);
    for (std::uint32_t g = facets_.begin(b); g < facets_.end(b); ++g) {
      if (sign_[g] <= 0 || !facets_.is(g, CellFacets::bounds)) continue;
      const Triangle entry = triangle(g);
      if (!seenTogether(exit, entry, viewpoint_, std::min(width, sliver(entry)))) continue;
      if (nearer(exit, -1, entry, 1, viewpoint_) < 0) continue;
      if (projectionsOverlap(exit, -1, entry, 1, viewpoint_)) return true;
    }
  }
  return false;
}

bool NewellPairs::hides(mesh::Id a, mesh::Id b) {
  if (a_.id != a) take(a, a_);
  take(b, b_);
  open_a_.clear();
  open_b_.clear();
  // Test 4: all of b lies before a plane that a lies behind and the viewpoint does not.
  for (const std::uint32_t f : a_.towards) {
    const Verdict verdict = before(f, b_);
    if (verdict == Verdict::apart) return false;
    if (verdict == Verdict::open) open_a_.push_back(f);
  }
  // Test 5: all of a lies beyond a plane that b lies before, and the viewpoint too.
  for (const std::uint32_t f : b_.away) {
    const Verdict verdict = before(f, a_);
    if (verdict == Verdict::apart) return false;
    if (verdict == Verdict::open) open_b_.push_back(f);
  }
  if (shareSeenFace(a_, b_)) return true;
  if (outlineParts(a_, b_) || outlineParts(b_, a_)) return false;
  for (const std::uint32_t f : open_a_) {
    if (beforeExactly(f, b)) return false;
  }
  for (const std::uint32_t f : open_b_) {
    if (beforeExactly(f, a)) return false;
  }
  return trianglesHide(a, b);
}

}  // namespace spillikin::sort
