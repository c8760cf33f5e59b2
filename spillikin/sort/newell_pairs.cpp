#include "spillikin/sort/newell_pairs.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t marked = 32;  // vertices of a cell that have a bit

bool isShared(std::uint32_t shared, std::size_t vertex) {
  return vertex < marked && ((shared >> vertex) & 1U) != 0;
}

bool sameCorners(const std::array<mesh::Id, 3>& s, const std::array<mesh::Id, 3>& t) {
  const auto has = [&](mesh::Id v) { return v == t[0] || v == t[1] || v == t[2]; };
  return has(s[0]) && has(s[1]) && has(s[2]);
}

}  // namespace

Triangle NewellPairs::triangle(std::uint32_t facet) const {
  const auto& t = facets_.corners(facet);
  return {mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]]};
}

void NewellPairs::begin(const Viewpoint& viewpoint) {
  viewpoint_ = viewpoint;
  a_.id = b_.id = mesh::none;
  turned_.resize(facets_.count());
  mesh::parallelFor(facets_.count(), [&](std::size_t i) {
    const auto f = static_cast<std::uint32_t>(i);
    const auto& t = facets_.corners(f);
    int sign = facets_.side(f, viewpoint.w == 0.0 ? Vec3(viewpoint) : Vec3(viewpoint) - mesh_.points[t[0]]);
    if (sign == 0) sign = mesh::orientViewpoint(mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]], viewpoint);
    const bool supports = facets_.is(f, CellFacets::supports), bounds = facets_.is(f, CellFacets::bounds);
    turned_[i] = static_cast<std::uint8_t>((supports && sign >= 0 ? towards : 0) | (supports && sign <= 0 ? away : 0) |
                                           (bounds && sign > 0 ? entry : 0) | (bounds && sign < 0 ? exit : 0));
  });
}

template <std::size_t N>
std::span<const mesh::Id> NewellPairs::vertices(const Cell& cell) const {
  if constexpr (N > 0) return {mesh_.cell_vertex.data() + N * cell.id, N};
  return mesh_.vertices(cell.id);
}

// Vertices are compared, no neighbours are asked for.
template <std::size_t N>
void NewellPairs::findShared() {
  const auto va = vertices<N>(a_), vb = vertices<N>(b_);
  std::uint32_t shared_a = 0, shared_b = 0;
  for (std::size_t i = 0; i < std::min(va.size(), marked); ++i) {
    for (std::size_t j = 0; j < std::min(vb.size(), marked); ++j) {
      const std::uint32_t same = va[i] == vb[j] ? 1U : 0U;
      shared_a |= same << i;
      shared_b |= same << j;
    }
  }
  a_.shared = shared_a;
  b_.shared = shared_b;
}

// Is all of the other cell certainly on the side of the facet's plane that its normal points to, or in the plane? A
// vertex that both cells have is certainly behind it or in it.
template <std::size_t N>
NewellPairs::Verdict NewellPairs::before(std::uint32_t facet, const Cell& own, const Cell& other) const {
  if ((facets_.behind(facet) & own.shared) != 0) return Verdict::not_apart;
  const Vec3& corner = mesh_.points[facets_.corners(facet)[0]];
  const auto all = vertices<N>(other);
  bool open = false, against = false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool on = isShared(other.shared, i);
    // Of a few vertices all are looked at: that takes less time than branches that cannot be foretold.
    if (N == 0 && on) continue;
    const int side = facets_.side(facet, mesh_.points[all[i]] - corner);
    if (N == 0 && side < 0) return Verdict::not_apart;
    open |= !on & (side == 0);
    against |= !on & (side < 0);
  }
  return against ? Verdict::not_apart : open ? Verdict::open : Verdict::apart;
}

template <std::size_t N>
bool NewellPairs::anyParts(const Cell& own, Turned turned, const Cell& other, std::vector<std::uint32_t>& open) const {
  open.clear();
  for (std::uint32_t f = facets_.begin(own.id); f < facets_.end(own.id); ++f) {
    if (!is(f, turned)) continue;
    const Verdict verdict = before<N>(f, own, other);
    if (verdict == Verdict::apart) return true;
    if (verdict == Verdict::open) open.push_back(f);
  }
  return false;
}

bool NewellPairs::anyPartsExactly(std::span<const std::uint32_t> open, const Cell& other) const {
  const auto vertices = mesh_.vertices(other.id);
  return std::any_of(open.begin(), open.end(), [&](std::uint32_t f) {
    const Triangle t = triangle(f);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const Vec3& p = mesh_.points[vertices[i]];
      if (!isShared(other.shared, i) && mesh::orient3d(t[0], t[1], t[2], p) < 0) return false;
    }
    return true;
  });
}

// A triangle of both, through which rays leave a and enter b.
bool NewellPairs::shareSeenFace() const {
  if (std::popcount(a_.shared) < 3) return false;
  for (std::uint32_t f = facets_.begin(a_.id); f < facets_.end(a_.id); ++f) {
    if (!is(f, exit)) continue;
    for (std::uint32_t g = facets_.begin(b_.id); g < facets_.end(b_.id); ++g) {
      if (!is(g, entry) || !sameCorners(facets_.corners(f), facets_.corners(g))) continue;
      const Triangle t = triangle(f);
      if (seen(t, viewpoint_, sliver(t))) return true;
    }
  }
  return false;
}

// The edges of a convex cell between triangles that rays enter through and others, around the former.
void NewellPairs::findOutline(Cell& cell) const {
  cell.outlined = true;
  cell.outline.clear();
  const std::uint32_t begin = facets_.begin(cell.id), end = facets_.end(cell.id);
  for (std::uint32_t f = begin; f < end; ++f) {
    if (!is(f, entry)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const mesh::Id p = facets_.corners(f)[k], q = facets_.corners(f)[(k + 1) % 3];
      bool inner = false;
      for (std::uint32_t g = begin; g < end && !inner; ++g) {
        const auto& t = facets_.corners(g);
        inner = is(g, entry) && ((t[0] == q && t[1] == p) || (t[1] == q && t[2] == p) || (t[2] == q && t[0] == p));
      }
      if (inner) continue;
      const Vec3& corner = mesh_.points[p];
      const Vec3 s = viewpoint_.w == 0.0 ? Vec3(viewpoint_) : Vec3(viewpoint_) - corner, u = mesh_.points[q] - corner;
      // Shewchuk's bound of the determinant of u, p - corner and s is 7.1 half units of the last place of these.
      const Vec3 left(s.y * u.z, s.z * u.x, s.x * u.y), right(s.z * u.y, s.x * u.z, s.y * u.x);
      const double magnitude = std::max({std::abs(left.x) + std::abs(right.x), std::abs(left.y) + std::abs(right.y),
                                         std::abs(left.z) + std::abs(right.z)});
      cell.outline.push_back({{p, q}, left - right, 0x1p-50 * magnitude});
    }
  }
}

// Is all of the other cell, as seen, certainly beyond one edge of the outline, or on it?
bool NewellPairs::outlineParts(Cell& own, const Cell& other) const {
  if (!facets_.convex(own.id)) return false;
  if (!own.outlined) findOutline(own);
  const auto vertices = mesh_.vertices(other.id);
  return std::any_of(own.outline.begin(), own.outline.end(), [&](const Edge& e) {
    const Vec3& corner = mesh_.points[e.ends[0]];
    return std::all_of(vertices.begin(), vertices.end(), [&](mesh::Id v) {
      if (v == e.ends[0] || v == e.ends[1]) return true;
      const Vec3 w = mesh_.points[v] - corner;
      const double height = e.normal.x * w.x + e.normal.y * w.y + e.normal.z * w.z;
      return height < -(e.bound * (std::abs(w.x) + std::abs(w.y) + std::abs(w.z)) + 0x1p-900);
    });
  });
}

// Do the triangles of two facets lie so that no corner of `other` is, or may be, on the side of the plane of `facet`
// that its normal points to, and one is on the other?
bool NewellPairs::behind(std::uint32_t other, std::uint32_t facet) const {
  const auto& corners = facets_.corners(facet);
  const Vec3& corner = mesh_.points[corners[0]];
  bool strictly = false;
  for (const mesh::Id v : facets_.corners(other)) {
    if (v == corners[0] || v == corners[1] || v == corners[2]) continue;
    if (facets_.side(facet, mesh_.points[v] - corner) >= 0) return false;
    strictly = true;
  }
  return strictly;
}

// The definitive test: a triangle of a that rays leave it through and one of b that they enter it through overlap as
// seen, wider than a sliver, the first nearer or at the same place.
bool NewellPairs::trianglesHide() const {
  for (std::uint32_t f = facets_.begin(a_.id); f < facets_.end(a_.id); ++f) {
    if (!is(f, exit)) continue;
    const Triangle out = triangle(f);
    for (std::uint32_t g = facets_.begin(b_.id); g < facets_.end(b_.id); ++g) {
      if (!is(g, entry) || behind(g, f) || behind(f, g)) continue;  // tests 4 and 5, of two triangles
      const Triangle in = triangle(g);
      if (!seenTogether(out, in, viewpoint_, std::min(sliver(out), sliver(in)))) continue;
      if (nearer(out, -1, in, 1, viewpoint_) < 0) continue;
      if (projectionsOverlap(out, -1, in, 1, viewpoint_)) return true;
    }
  }
  return false;
}

template <std::size_t N>
bool NewellPairs::hides() {
  findShared<N>();
  // Test 4: all of b lies before a plane that a lies behind and the viewpoint does not.
  if (anyParts<N>(a_, towards, b_, open_a_)) return false;
  // Test 5: all of a lies beyond a plane that b lies behind, and the viewpoint too.
  if (anyParts<N>(b_, away, a_, open_b_)) return false;
  if (shareSeenFace()) return true;
  if (outlineParts(a_, b_) || outlineParts(b_, a_)) return false;
  // Tests 4 and 5 again, where rounding left them open.
  if (anyPartsExactly(open_a_, b_) || anyPartsExactly(open_b_, a_)) return false;
  return trianglesHide();
}

bool NewellPairs::hides(mesh::Id a, mesh::Id b) {
  if (a_.id != a) a_.outlined = false;
  b_.outlined = false;
  a_.id = a;
  b_.id = b;
  return tetrahedral_ ? hides<4>() : hides<0>();
}

}  // namespace spillikin::sort
