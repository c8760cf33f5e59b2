#include "spillikin/sort/parted_cells.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "spillikin/mesh/predicates.h"
#include "spillikin/sort/convex_polygons.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t block = 128;         // groups linked by one task, whose edges are kept together
constexpr std::size_t most_vertices = 64;  // of a cell, a bit each
constexpr std::size_t most_faces = 128;    // so that counts of what comes before a node stay small

}  // namespace

PartedCells::PartedCells(const mesh::Mesh& mesh, FaceSigns& signs, const ProblemFaces& problems)
    : mesh_(mesh), signs_(signs), problems_(problems) {
  if (mesh.quad_count() == 0) return;
  first_.assign(mesh.cell_count(), unset);
}

void PartedCells::part() {
  if (first_.empty()) return;
  const std::vector<std::uint32_t> begin = group();
  if (slivers_.empty()) return;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells_, block), [&](const auto& range) {
    for (std::size_t g = range.begin(); g < range.end(); ++g) {
      for (std::size_t i = begin[g]; i < begin[g + 1]; ++i)
        measure(i);
      arrange(begin[g], begin[g + 1]);
    }
  });
  const std::size_t blocks = (cells_ + block - 1) / block;
  // Not kept: twice as large as what is made of it.
  std::vector<std::vector<Pair>> found(blocks);
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
    for (std::size_t g = b * block; g < std::min(cells_, (b + 1) * block); ++g)
      link(slivers_[begin[g]].cell, found[b]);
  });
  std::vector<Sides>().swap(sides_);
  collect(found);
}

// The edges by the node that comes first.
void PartedCells::collect(const std::vector<std::vector<Pair>>& found) {
  first_edge_.assign(nodes() + 1, 0);
  for (const auto& pairs : found) {
    for (const auto& [from, to] : pairs)
      ++first_edge_[from + 1];
  }
  for (std::size_t k = 1; k < first_edge_.size(); ++k)
    first_edge_[k] += first_edge_[k - 1];
  if (edge_.capacity() < first_edge_.back()) edge_ = {};  // nothing of the last view is copied
  edge_.resize(first_edge_.back());
  for (const auto& pairs : found) {
    for (const auto& [from, to] : pairs)
      edge_[first_edge_[from]++] = to;
  }
  // Each now begins where the next one did.
  std::copy_backward(first_edge_.begin(), first_edge_.end() - 1, first_edge_.end());
  first_edge_.front() = 0;
}

// Forgets the last view and lists this one's slivers, those of a cell together and by ascending face. Returns where
// those of each cell begin, and the end.
std::vector<std::uint32_t> PartedCells::group() {
  for (const Sliver& sliver : slivers_)
    first_[sliver.cell] = unset;
  slivers_.clear();
  cells_ = 0;
  std::vector<ProblemFace> faces;
  faces.reserve(problems_.faces());
  std::vector<std::uint32_t> begin{0};
  begin.reserve(problems_.cells() + 1);
  for (const mesh::Id face : signs_.problems()) {
    const auto [inside, outside] = mesh_.cells(face);
    if (outside == mesh::none) continue;
    const unsigned side = problems_.valleySide(face);
    const mesh::Id problem = side == 0 ? inside : outside;
    if (!partable(problem, side == 0 ? outside : inside)) continue;
    // For now, which cell it is.
    if (first_[problem] == unset) {
      first_[problem] = static_cast<std::uint32_t>(cells_++);
      begin.push_back(0);
    }
    ++begin[first_[problem] + 1];
    faces.push_back({problem, face, side});
    signs_.settle(face, side);
  }
  for (std::size_t g = 1; g < begin.size(); ++g)
    begin[g] += begin[g - 1];
  slivers_.resize(begin.back());
  sides_.resize(begin.back());
  std::vector<std::uint32_t> next = begin;
  for (const auto& [problem, face, side] : faces) {
    // Where T's normal, which points away from side 0, points to the viewpoint, P on side 0 is entered.
    const bool second = (signs_.sign(signs_.firstHalf(face)) > 0) != (side == 0);
    Sliver& sliver = slivers_[next[first_[problem]]++];
    sliver.cell = problem;
    sliver.face = face & mesh::Id{0x7FFFFFFF};
    sliver.second = second ? 1U : 0U;
  }
  for (std::size_t g = 0; g < cells_; ++g)
    first_[slivers_[begin[g]].cell] = begin[g];
  return begin;
}

bool PartedCells::partable(mesh::Id problem, mesh::Id other) const {
  return mesh_.vertices(problem).size() <= most_vertices && mesh_.faces(problem).size() <= most_faces &&
         mesh_.faces(other).size() <= most_faces;
}

// The plane of T and the sides of the cell's vertices.
void PartedCells::measure(std::size_t i) {
  Sliver& sliver = slivers_[i];
  Sides& sides = sides_[i];
  sides = {};
  const auto& q = mesh_.quad[sliver.face - mesh_.triangle_count()];
  const mesh::Id first = q[0], u = sliver.second ? q[2] : q[1], w = sliver.second ? q[3] : q[2];
  const int towards = signs_.sign(sliver.second ? signs_.secondHalf(sliver.face) : signs_.firstHalf(sliver.face));
  const Vec3 &a = mesh_.points[first], &b = mesh_.points[u], &c = mesh_.points[w];
  const Vec3 e = b - a, f = c - a;
  Vec3 n(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
  n *= towards / std::sqrt(glm::dot(n, n));
  sliver.near = {n, -glm::dot(n, a)};
  const auto vertices = mesh_.vertices(sliver.cell);
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    if (vertices[k] == first || vertices[k] == u || vertices[k] == w) {
      sides.t |= std::uint64_t{1} << k;
      continue;
    }
    const int s = towards * mesh::orient3d(a, b, c, mesh_.points[vertices[k]]);
    sides.out |= std::uint64_t{s > 0 ? 1U : 0U} << k;
    sides.in |= std::uint64_t{s < 0 ? 1U : 0U} << k;
  }
}

// Where T of one problem face touches the sliver of another, that sliver comes before what lies beyond the face, and so
// before its sliver: it is cut off later, if not all of them wait for each other.
void PartedCells::arrange(std::size_t begin, std::size_t end) {
  for (std::size_t first = begin; first + 1 < end; ++first) {
    std::uint64_t triangles = 0;
    for (std::size_t i = first; i < end; ++i)
      triangles |= sides_[i].t;
    std::size_t next = first;
    while (next < end && (sides_[next].out & triangles) != 0)
      ++next;
    if (next == end) continue;
    const auto rotate = [&](auto& of) {
      const auto at = of.begin() + static_cast<std::ptrdiff_t>(next);
      std::rotate(of.begin() + static_cast<std::ptrdiff_t>(first), at, at + 1);
    };
    rotate(slivers_);
    rotate(sides_);
  }
}

// The corners of a triangular face or of half a quadrilateral among the cell's vertices.
std::uint64_t PartedCells::corners(mesh::Id cell, mesh::Id face, bool second) const {
  std::array<mesh::Id, 3> t;
  if (face < mesh_.triangle_count()) {
    t = mesh_.triangle[face];
  } else {
    const auto& q = mesh_.quad[face - mesh_.triangle_count()];
    t = {q[0], second ? q[2] : q[1], second ? q[3] : q[2]};
  }
  const auto vertices = mesh_.vertices(cell);
  std::uint64_t mask = 0;
  for (std::size_t k = 0; k < vertices.size(); ++k)
    mask |= std::uint64_t{vertices[k] == t[0] || vertices[k] == t[1] || vertices[k] == t[2] ? 1U : 0U} << k;
  return mask;
}

// Whether a triangle of the cell, given by its corners, may touch its sliver i: not if it lies on the wrong side of one
// of its planes. One that lies in such a plane may, but for T, before which the cell lies beyond.
bool PartedCells::touches(std::span<const Sliver> own, std::size_t i, std::uint64_t triangle) const {
  const Sides* const of = &sides(own.front());
  if ((of[i].out & triangle) == 0 && ((of[i].in & triangle) != 0 || triangle == of[i].t)) return false;
  for (std::size_t j = 0; j < i; ++j) {
    if ((of[j].in & triangle) == 0 && (of[j].out & triangle) != 0) return false;
  }
  return true;
}

// Whether the outer sides of two planes share a point of the cell's convex hull: one in which their heights, which are
// linear, are both positive. Then some way from one vertex to another has such a point.
bool PartedCells::meet(const Sliver& a, const Sliver& b) const {
  constexpr double rounding = 1e-14;  // relative to what a height is the sum of; several times that of the sum
  const auto vertices = mesh_.vertices(a.cell);
  // Never too low, and of the exact sign.
  const auto height = [&](const Sliver& s, std::size_t k) {
    const Sides& of = sides(s);
    if ((((of.out | of.in) >> k) & 1U) == 0) return 0.0;
    const Vec3& p = mesh_.points[vertices[k]];
    const double size = std::abs(p.x) + std::abs(p.y) + std::abs(p.z) + std::abs(s.near.offset);
    const double h = sort::height(s.near, p) + rounding * size;
    return ((of.out >> k) & 1U) != 0 ? std::max(h, rounding * size) : std::min(h, 0.0);
  };
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (((sides(a).out >> i) & 1U) == 0) continue;
    const double ai = height(a, i), bi = height(b, i);
    for (std::size_t j = 0; j < vertices.size(); ++j) {
      if (((sides(b).out >> j) & 1U) == 0) continue;
      const double aj = height(a, j), bj = height(b, j);
      // From i to j the first height ends, if it does, after the second begins.
      if (bi >= 0.0 || aj >= 0.0 || ai * bj >= aj * bi * (1.0 - rounding)) return true;
    }
  }
  return false;
}

// The edges of the slivers of a cell.
void PartedCells::link(mesh::Id cell, std::vector<Pair>& out) const {
  const std::span<const Sliver> own = slivers(cell);
  bool closed = true;
  for (const mesh::FaceUse use : mesh_.faces(cell)) {
    const mesh::Id face = use.face(), other = mesh_.neighbour(use);
    closed = closed && other != mesh::none;
    if (other == mesh::none) continue;
    if (const Sliver* problem = find(own, face)) {
      linkOwn(own, *problem, other, out);
      continue;
    }
    // The edges through a problem face are found from the cell whose problem it is.
    if (!signs_.before(use) || find(slivers(other), face) != nullptr) continue;
    const std::uint64_t first = corners(cell, face, false);
    const std::uint64_t second = face < mesh_.triangle_count() ? first : corners(cell, face, true);
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (touches(own, i, first) || touches(own, i, second)) out.push_back({node(own[i]), other});
    }
  }
  for (std::size_t i = 0; i < own.size(); ++i)
    linkSlivers(own, i, closed, out);
}

const PartedCells::Sliver* PartedCells::find(std::span<const Sliver> slivers, mesh::Id face) {
  const auto at = std::find_if(slivers.begin(), slivers.end(), [face](const Sliver& s) { return s.face == face; });
  return at == slivers.end() ? nullptr : &*at;
}

// Through a problem face of the cell: rays leave it by S and enter it by T.
void PartedCells::linkOwn(std::span<const Sliver> own, const Sliver& problem, mesh::Id other,
                          std::vector<Pair>& out) const {
  const std::uint64_t s = corners(problem.cell, problem.face, !problem.second);
  const auto theirs = slivers(other);
  const std::uint64_t their_s = theirs.empty() ? 0 : corners(other, problem.face, !problem.second);
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (touches(own, i, sides(problem).t)) out.push_back({node(own[i]), other});
    if (!touches(own, i, s)) continue;
    out.push_back({other, node(own[i])});
    for (std::size_t k = 0; k < theirs.size(); ++k) {
      if (touches(theirs, k, their_s)) out.push_back({node(theirs[k]), node(own[i])});
    }
  }
}

// The rest of the cell comes before every sliver, and what is cut off later before what is cut off earlier. Where the
// cell has exterior faces, rays may come from one to the other through the outside.
void PartedCells::linkSlivers(std::span<const Sliver> own, std::size_t i, bool closed, std::vector<Pair>& out) const {
  out.push_back({own[i].cell, node(own[i])});
  for (std::size_t j = i + 1; j < own.size(); ++j) {
    if (!closed || meet(own[i], own[j])) out.push_back({node(own[j]), node(own[i])});
  }
}

// Calls f(half-space) for those of a node.
template <class F>
void PartedCells::forEachHalf(mesh::Id node, const F& f) const {
  for (const Sliver& s : slivers(cell(node))) {
    if (node >= mesh_.cell_count() && &s == &sliver(node)) {
      f(s.near);
      return;
    }
    f(opposite(s.near));
  }
}

void PartedCells::keep(mesh::Id node, std::vector<HalfSpace>& out) const {
  out.clear();
  forEachHalf(node, [&](const HalfSpace& half) { out.push_back(half); });
}

void PartedCells::list(Order& order, std::span<const CellPiece> pieces) const {
  order.cuts.clear();
  if (!any() && pieces.empty()) return;
  reserveCuts(order);
  for (std::size_t i = 0; i < order.cells.size(); ++i) {
    const mesh::Id node = order.cells[i];
    if (node < mesh_.cell_count() && slivers(node).empty()) continue;
    const auto entry = static_cast<std::uint32_t>(i);
    if (node < nodes()) {
      order.cells[i] = cell(node);
      putCut(node, entry, order);
      continue;
    }
    const CellPiece& piece = pieces[node - nodes()];
    order.cells[i] = piece.cell;
    if (!piece.keep.empty()) order.cuts.add(entry, piece.keep);
  }
}

// For the parts of all cells.
void PartedCells::reserveCuts(Order& order) const {
  std::size_t half_spaces = 0;
  for (std::size_t i = 0; i < slivers_.size();) {
    const std::size_t n = slivers(slivers_[i].cell).size();
    half_spaces += n + n * (n + 1) / 2;
    i += n;
  }
  order.cuts.reserve(cells_ + slivers_.size(), half_spaces);
}

void PartedCells::putCut(mesh::Id node, std::uint32_t entry, Order& order) const {
  order.cuts.open(entry);
  forEachHalf(node, [&](const HalfSpace& half) { order.cuts.put(half); });
}

void PartedCells::addCut(mesh::Id node, Order& order) const {
  if (!slivers(cell(node)).empty()) putCut(node, static_cast<std::uint32_t>(order.cells.size()), order);
}

std::size_t PartedCells::bytes() const {
  return slivers_.capacity() * sizeof(Sliver) + sides_.capacity() * sizeof(Sides) +
         4 * (first_.capacity() + first_edge_.capacity() + edge_.capacity());
}

}  // namespace spillikin::sort
