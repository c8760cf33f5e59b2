#include "spillikin/sort/parted_cells.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t block = 128;         // groups linked by one task, whose edges are kept together
constexpr std::size_t most_vertices = 64;  // of a cell, a bit each
constexpr std::size_t most_faces = 128;    // so that counts of what comes before a node stay small

double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

}  // namespace

PartedCells::PartedCells(const mesh::Mesh& mesh, FaceSigns& signs, const ProblemFaces& problems)
    : mesh_(mesh), signs_(signs), problems_(problems) {
  if (mesh.quad_count() == 0) return;
  group_.assign(mesh.cell_count(), unset);
  head_.assign(mesh.cell_count(), unset);
}

void PartedCells::part() {
  if (group_.empty()) return;
  group();
  if (slivers_.empty()) return;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, parted_.size(), block), [&](const auto& range) {
    for (std::size_t g = range.begin(); g < range.end(); ++g) {
      const std::span<Sliver> own{slivers_.data() + begin_[g], slivers_.data() + begin_[g + 1]};
      for (Sliver& sliver : own)
        measure(sliver);
      arrange(own);
    }
  });
  const std::size_t blocks = (parted_.size() + block - 1) / block;
  found_.resize(std::max(found_.size(), blocks));
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
    found_[b].clear();
    for (std::size_t g = b * block; g < std::min(parted_.size(), (b + 1) * block); ++g)
      link(static_cast<std::uint32_t>(g), found_[b]);
  });
  head_.resize(nodes(), unset);
  for (std::size_t b = 0; b < blocks; ++b) {
    for (const auto& [from, to] : found_[b]) {
      edges_.push_back({to, head_[from]});
      head_[from] = static_cast<std::uint32_t>(edges_.size() - 1);
    }
  }
}

// Forgets the last view and lists this one's slivers, those of a cell together and by ascending face.
void PartedCells::group() {
  for (const mesh::Id cell : parted_)
    group_[cell] = unset;
  head_.resize(mesh_.cell_count());
  if (!edges_.empty()) std::fill(head_.begin(), head_.end(), unset);
  edges_.clear();
  parted_.clear();
  begin_.assign(1, 0);
  slivers_.clear();
  faces_.clear();
  for (const mesh::Id face : signs_.problems()) {
    const auto [inside, outside] = mesh_.cells(face);
    if (outside == mesh::none) continue;
    const unsigned side = problems_.valleySide(face);
    const mesh::Id problem = side == 0 ? inside : outside;
    if (!partable(problem, side == 0 ? outside : inside)) continue;
    if (group_[problem] == unset) {
      group_[problem] = static_cast<std::uint32_t>(parted_.size());
      parted_.push_back(problem);
      begin_.push_back(0);
    }
    ++begin_[group_[problem] + 1];
    faces_.push_back({problem, face, side});
    signs_.settle(face, side);
  }
  for (std::size_t g = 1; g < begin_.size(); ++g)
    begin_[g] += begin_[g - 1];
  slivers_.resize(begin_.back());
  for (const auto& [problem, face, side] : faces_) {
    // Where T's normal, which points away from side 0, points to the viewpoint, P on side 0 is entered.
    const bool second = (signs_.sign(signs_.firstHalf(face)) > 0) != (side == 0);
    slivers_[begin_[group_[problem]]++] = {problem, face, {}, second, 0, 0, 0};
  }
  begin_.insert(begin_.begin(), 0);
  begin_.pop_back();
}

bool PartedCells::partable(mesh::Id problem, mesh::Id other) const {
  return mesh_.vertices(problem).size() <= most_vertices && mesh_.faces(problem).size() <= most_faces &&
         mesh_.faces(other).size() <= most_faces;
}

// The plane of T and the sides of the cell's vertices.
void PartedCells::measure(Sliver& sliver) const {
  const auto& q = mesh_.quad[sliver.face - mesh_.triangle_count()];
  const mesh::Id first = q[0], u = sliver.second ? q[2] : q[1], w = sliver.second ? q[3] : q[2];
  const int towards = signs_.sign(sliver.second ? signs_.secondHalf(sliver.face) : signs_.firstHalf(sliver.face));
  const Vec3 &a = mesh_.points[first], &b = mesh_.points[u], &c = mesh_.points[w];
  const Vec3 e = b - a, f = c - a;
  Vec3 n(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
  n *= towards / std::sqrt(dot(n, n));
  sliver.near = {n, -dot(n, a)};
  const auto vertices = mesh_.vertices(sliver.cell);
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    if (vertices[k] == first || vertices[k] == u || vertices[k] == w) {
      sliver.t |= std::uint64_t{1} << k;
      continue;
    }
    const int s = towards * mesh::orient3d(a, b, c, mesh_.points[vertices[k]]);
    sliver.out |= std::uint64_t{s > 0 ? 1U : 0U} << k;
    sliver.in |= std::uint64_t{s < 0 ? 1U : 0U} << k;
  }
}

// Where T of one problem face touches the sliver of another, that sliver comes before what lies beyond the face, and so
// before its sliver: it is cut off later, if not all of them wait for each other.
void PartedCells::arrange(std::span<Sliver> own) const {
  for (std::size_t first = 0; first + 1 < own.size(); ++first) {
    const auto free = [&](const Sliver& s) {
      return std::none_of(own.begin() + static_cast<std::ptrdiff_t>(first), own.end(),
                          [&](const Sliver& other) { return (s.out & other.t) != 0; });
    };
    const auto next = std::find_if(own.begin() + static_cast<std::ptrdiff_t>(first), own.end(), free);
    if (next != own.end()) std::rotate(own.begin() + static_cast<std::ptrdiff_t>(first), next, next + 1);
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
bool PartedCells::touches(std::span<const Sliver> own, std::size_t i, std::uint64_t triangle) {
  if ((own[i].out & triangle) == 0 && ((own[i].in & triangle) != 0 || triangle == own[i].t)) return false;
  for (std::size_t j = 0; j < i; ++j) {
    if ((own[j].in & triangle) == 0 && (own[j].out & triangle) != 0) return false;
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
    if ((((s.out | s.in) >> k) & 1U) == 0) return 0.0;
    const Vec3& p = mesh_.points[vertices[k]];
    const double size = std::abs(p.x) + std::abs(p.y) + std::abs(p.z) + std::abs(s.near.offset);
    const double h = dot(s.near.normal, p) + s.near.offset + rounding * size;
    return ((s.out >> k) & 1U) != 0 ? std::max(h, rounding * size) : std::min(h, 0.0);
  };
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (((a.out >> i) & 1U) == 0) continue;
    const double ai = height(a, i), bi = height(b, i);
    for (std::size_t j = 0; j < vertices.size(); ++j) {
      if (((b.out >> j) & 1U) == 0) continue;
      const double aj = height(a, j), bj = height(b, j);
      // From i to j the first height ends, if it does, after the second begins.
      if (bi >= 0.0 || aj >= 0.0 || ai * bj >= aj * bi * (1.0 - rounding)) return true;
    }
  }
  return false;
}

// The edges of the slivers of a cell.
void PartedCells::link(std::uint32_t group, std::vector<Pair>& out) const {
  const mesh::Id cell = parted_[group];
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
    if (touches(own, i, problem.t)) out.push_back({node(own[i]), other});
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

void PartedCells::keep(mesh::Id node, std::vector<HalfSpace>& out) const {
  out.clear();
  const std::span<const Sliver> own = slivers(cell(node));
  for (const Sliver& s : own) {
    if (node >= mesh_.cell_count() && &s == &sliver(node)) {
      out.push_back(s.near);
      return;
    }
    out.push_back({-s.near.normal, -s.near.offset});
  }
}

void PartedCells::list(Order& order, std::span<const CellPiece> pieces) const {
  std::size_t cuts = 0;
  if (any() || !pieces.empty()) {
    for (std::size_t i = 0; i < order.cells.size(); ++i) {
      const mesh::Id node = order.cells[i];
      if (node < mesh_.cell_count() && slivers(node).empty()) continue;
      const CellPiece* piece = node < nodes() ? nullptr : &pieces[node - nodes()];
      order.cells[i] = piece == nullptr ? cell(node) : piece->cell;
      if (piece != nullptr && piece->keep.empty()) continue;
      if (cuts == order.cuts.size()) order.cuts.emplace_back();
      order.cuts[cuts].entry = static_cast<std::uint32_t>(i);
      if (piece == nullptr) {
        keep(node, order.cuts[cuts++].keep);
      } else {
        order.cuts[cuts++].keep = piece->keep;
      }
    }
  }
  order.cuts.resize(cuts);
}

void PartedCells::addCut(mesh::Id node, Order& order) const {
  if (slivers(cell(node)).empty()) return;
  order.cuts.push_back({static_cast<std::uint32_t>(order.cells.size()), {}});
  keep(node, order.cuts.back().keep);
}

std::size_t PartedCells::bytes() const {
  std::size_t bytes = slivers_.capacity() * sizeof(Sliver) + edges_.capacity() * sizeof(Edge) +
                      4 * (group_.capacity() + begin_.capacity() + parted_.capacity() + head_.capacity());
  for (const auto& found : found_)
    bytes += found.capacity() * sizeof(Pair);
  return bytes;
}

}  // namespace spillikin::sort
