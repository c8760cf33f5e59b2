#include "spillikin/sort/cycle_cutter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "spillikin/mesh/predicates.h"
#include "spillikin/sort/strong_components.h"
#include "spillikin/sort/triangle_order.h"

namespace spillikin::sort {
namespace {

constexpr std::uint32_t unset = 0xFFFFFFFFU;
constexpr std::uint32_t most_roots = 16384;  // nodes from which a round looks for cycles
// Nodes from which it looks for cycles of any length, where none is short, and how many may be in another's way.
constexpr std::uint32_t most_long = 256, most_in_the_way = 8;
constexpr std::size_t most_failures = 32;  // cycles that a round finds no cut for
// A component of more pieces than this is cut in so many rounds at most, then sorted by depth.
constexpr std::size_t large_component = 2048, most_large_rounds = 256;
constexpr std::size_t short_reach = 48;    // nodes looked at for a short cycle
constexpr std::size_t longest_cycle = 16;  // of which all face planes are tried
// Rounds that may find long cycles alone before a component is split in two, and the share of it that either side is to
// have at least.
constexpr std::size_t most_long_rounds = 1, least_share = 8;
constexpr std::size_t most_planes = 16;  // of which the best is taken for that

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// Calls f(row of FaceSigns, corners) for the one or two triangles of a face.
template <class F>
void forEachHalf(const mesh::Mesh& mesh, const FaceSigns& signs, mesh::Id face, const F& f) {
  if (face < mesh.triangle_count()) {
    f(std::size_t{face}, mesh.triangle[face]);
    return;
  }
  const auto& q = mesh.quad[face - mesh.triangle_count()];
  f(signs.firstHalf(face), std::array<mesh::Id, 3>{q[0], q[1], q[2]});
  f(signs.secondHalf(face), std::array<mesh::Id, 3>{q[0], q[2], q[3]});
}

std::uint32_t indexOf(std::span<const mesh::Id> ascending, mesh::Id cell) {
  const auto at = std::lower_bound(ascending.begin(), ascending.end(), cell);
  return at != ascending.end() && *at == cell ? static_cast<std::uint32_t>(at - ascending.begin()) : unset;
}

}  // namespace

CycleCutter::CycleCutter(const mesh::Mesh& mesh, const FaceSigns& signs, const Viewpoint& viewpoint, const Gaps* gaps,
                         ProblemCells& problems, const PartedCells* parted)
    : mesh_(mesh), signs_(signs), viewpoint_(viewpoint), gaps_(gaps), problems_(problems), parted_(parted) {}

bool CycleCutter::operator()(std::span<const mesh::Id> component, Order& order) {
  pieces_.clear();
  edges_.clear();
  gather(component);
  polygons_.clear(tolerance());
  cuts_left_ = most_cuts * component.size() + 16;
  large_rounds_ = 0;
  makePieces();
  faceEdges();
  partEdges();
  if (gaps_ != nullptr) gapEdges();
  on_no_short_cycle_.assign(pieces_.size(), 0);
  Nodes nodes(pieces_.size());
  std::iota(nodes.begin(), nodes.end(), 0U);
  Edges edges(edges_.size());
  for (std::uint32_t e = 0; e < edges.size(); ++e)
    edges[e] = e;
  return resolve(std::move(nodes), std::move(edges), 0, order);
}

// From the extent of the component.
double CycleCutter::tolerance() const {
  Vec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
  double largest = 0.0;
  for (const auto& [cell, node] : by_cell_) {
    for (const mesh::Id v : mesh_.vertices(cell)) {
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(lower[k], mesh_.points[v][k]);
        upper[k] = std::max(upper[k], mesh_.points[v][k]);
        largest = std::max(largest, std::abs(mesh_.points[v][k]));
      }
    }
  }
  constexpr double rounding = 1e-14;  // of coordinates, through a plane's offset
  return std::max(thin * std::sqrt(dot(upper - lower, upper - lower)), rounding * largest);
}

// The nodes of each cell together.
void CycleCutter::gather(std::span<const mesh::Id> nodes) {
  by_cell_.clear();
  for (const mesh::Id node : nodes)
    by_cell_.emplace_back(parted_ == nullptr ? node : parted_->cell(node), node);
  std::sort(by_cell_.begin(), by_cell_.end());
}

// A piece for every node, or one for every tetrahedron of a cell that is subdivided.
void CycleCutter::makePieces() {
  cells_.clear();
  first_piece_.clear();
  for (const auto& [cell, node] : by_cell_) {
    if (cells_.empty() || cells_.back() != cell) {
      cells_.push_back(cell);
      first_piece_.push_back(static_cast<std::uint32_t>(pieces_.size()));
    }
    if (problems_.subdivide(cell)) {
      makeTetrahedra(problems_[cell]);
      continue;
    }
    pieces_.push_back({cell, {}, node});
    if (parted_ != nullptr) parted_->keep(node, pieces_.back().keep);
  }
  first_piece_.push_back(static_cast<std::uint32_t>(pieces_.size()));
}

void CycleCutter::makeTetrahedra(const mesh::SubdividedCell& cell) {
  const auto first = static_cast<std::uint32_t>(pieces_.size());
  pieces_.resize(pieces_.size() + cell.tetrahedra.size(), {cell.parent, {}, mesh::none});
  for (const mesh::InnerFace& face : cell.inner) {
    const Vec3 &a = mesh_.points[face.vertex[0]], &b = mesh_.points[face.vertex[1]], &c = mesh_.points[face.vertex[2]];
    const std::uint32_t behind = first + face.tetrahedron[0], beyond = first + face.tetrahedron[1];
    const int s = mesh::orientViewpoint(a, b, c, viewpoint_);
    const Vec3 n = cross(b - a, c - a);
    const double length = std::sqrt(dot(n, n));
    if (length > 0.0) {
      const HalfSpace half{n / length, -dot(n / length, a)};
      pieces_[beyond].keep.push_back(half);
      pieces_[behind].keep.push_back(opposite(half));
    }
    const Polygon polygon = polygons_.add(std::array{a, b, c});
    if (s != 0 && isSeen(polygon)) {
      edges_.push_back({s > 0 ? behind : beyond, s > 0 ? beyond : behind, polygon, {}});
    }
  }
  for (std::size_t t = 0; t < cell.tetrahedra.size(); ++t)
    keepInside(cell, t, pieces_[first + t]);
}

// The planes between its tetrahedra part a convex cell. Where it is not, another part of it may lie beyond a triangle
// of its own boundary.
void CycleCutter::keepInside(const mesh::SubdividedCell& cell, std::size_t tetrahedron, Piece& piece) const {
  mesh::Surface boundary;
  mesh::surface(mesh_, cell.parent, boundary);
  for (std::size_t k = 0; k < boundary.triangles.size(); ++k) {
    if (cell.outer[k] != tetrahedron) continue;
    const auto& t = boundary.triangles[k];
    const Vec3 &a = mesh_.points[t[0]], &b = mesh_.points[t[1]], &c = mesh_.points[t[2]];
    const auto vertices = mesh_.vertices(cell.parent);
    const bool beyond = std::any_of(vertices.begin(), vertices.end(),
                                    [&](mesh::Id v) { return mesh::orient3d(a, b, c, mesh_.points[v]) > 0; });
    const Vec3 n = cross(b - a, c - a);
    const double length = std::sqrt(dot(n, n));
    if (beyond && length > 0.0) piece.keep.push_back({-n / length, dot(n / length, a)});
  }
}

// Calls f(piece, polygon) for the pieces of cell i that a triangle of its surface bounds, and what of it does.
template <class F>
void CycleCutter::forEachPieceAt(std::uint32_t i, const Half& half, Polygon polygon, const F& f) {
  const std::uint32_t first = first_piece_[i], last = first_piece_[i + 1];
  if (pieces_[first].node == mesh::none) {
    f(first + problems_[cells_[i]].outer[triangleOf(cells_[i], half)], polygon);
    return;
  }
  for (std::uint32_t piece = first; piece < last; ++piece) {
    const Polygon part = bounding(pieces_[piece], half, polygon);
    if (!part.empty()) f(piece, part);
  }
}

// What of a triangle of its cell bounds a part of it: of a problem face S lies on the viewpoint's side, and the cell
// beyond T.
CycleCutter::Polygon CycleCutter::bounding(const Piece& piece, const Half& half, Polygon polygon) {
  if (parted_ == nullptr) return polygon;
  for (const PartedCells::Sliver& sliver : parted_->slivers(piece.cell)) {
    const bool near = parted_->node(sliver) == piece.node;
    if (sliver.face == half.face) {
      if ((sliver.second == half.second) == near) return {};
    } else if (polygons_.side(polygon, sliver.near) != 2) {
      polygon = polygons_.clip(polygon, near ? sliver.near : opposite(sliver.near));
    }
    if (near || polygon.empty()) break;
  }
  return polygon;
}

// Where a triangular face, or a half of a quadrilateral, stands in the surface of a cell: from side 1 the halves come
// in the opposite order.
std::uint32_t CycleCutter::triangleOf(mesh::Id cell, const Half& half) const {
  std::uint32_t triangle = 0;
  for (const mesh::FaceUse use : mesh_.faces(cell)) {
    const bool quad = use.face() >= mesh_.triangle_count();
    if (use.face() == half.face) return triangle + (quad && half.second == (use.side() == 0) ? 1U : 0U);
    triangle += quad ? 2U : 1U;
  }
  return 0;
}

// The relations through one triangle between the pieces of cell i, on side 0 of it, and those of cell j.
void CycleCutter::addHalf(std::uint32_t i, std::uint32_t j, const Half& half, std::size_t row,
                          const std::array<mesh::Id, 3>& corner) {
  const int s = signs_.sign(row);
  if (s == 0) return;
  const Polygon triangle =
      polygons_.add(std::array{mesh_.points[corner[0]], mesh_.points[corner[1]], mesh_.points[corner[2]]});
  forEachPieceAt(i, half, triangle, [&](std::uint32_t inside, Polygon part) {
    forEachPieceAt(j, half, part, [&](std::uint32_t outside, Polygon polygon) {
      if (!isSeen(polygon)) return;
      edges_.push_back({s > 0 ? inside : outside, s > 0 ? outside : inside, polygon, {}});
    });
  });
}

void CycleCutter::faceEdges() {
  for (std::uint32_t i = 0; i < cells_.size(); ++i) {
    for (const mesh::FaceUse use : mesh_.faces(cells_[i])) {
      if (use.side() != 0) continue;
      const mesh::Id other = mesh_.neighbour(use);
      const std::uint32_t j = other == mesh::none ? unset : indexOf(cells_, other);
      if (j == unset) continue;
      bool second = false;
      forEachHalf(mesh_, signs_, use.face(), [&](std::size_t row, const auto& corner) {
        addHalf(i, j, {use.face(), second}, row, corner);
        second = true;
      });
    }
  }
}

// Across the planes between the parts of a cell.
void CycleCutter::partEdges() {
  if (parted_ == nullptr) return;
  for (std::uint32_t i = 0; i < cells_.size(); ++i) {
    for (std::uint32_t near = first_piece_[i]; near < first_piece_[i + 1]; ++near) {
      if (pieces_[near].node < mesh_.cell_count()) continue;
      const std::size_t plane = pieces_[near].keep.size() - 1;  // that the sliver was cut off by
      for (std::uint32_t far = first_piece_[i]; far < first_piece_[i + 1]; ++far) {
        if (far == near || pieces_[far].keep.size() <= plane) continue;
        const bool beyond = pieces_[far].node < mesh_.cell_count() || pieces_[far].node > pieces_[near].node;
        if (!beyond) continue;
        Piece both = pieces_[near];
        both.keep.pop_back();
        for (std::size_t k = plane + 1; k < pieces_[far].keep.size(); ++k)
          both.keep.push_back(pieces_[far].keep[k]);
        for (const Polygon polygon : section(both, pieces_[near].keep.back())) {
          if (isSeen(polygon)) edges_.push_back({far, near, polygon, {}});
        }
      }
    }
  }
}

void CycleCutter::gapEdges() {
  for (std::uint32_t i = 0; i < cells_.size(); ++i) {
    for (const mesh::Id front : gaps_->edges.after(cells_[i])) {
      const std::uint32_t j = indexOf(cells_, front);
      if (j != unset) gapsBetween(i, j);
    }
    // Out of one part of a cell and into another one of it.
    if (first_piece_[i] + 1 < first_piece_[i + 1]) gapsBetween(i, i);
  }
}

// Rays that leave cell j of the component, which is in front, and then enter cell i.
void CycleCutter::gapsBetween(std::uint32_t i, std::uint32_t j) {
  const GapEdges& finder = gaps_->finder;
  const auto half = [&](std::uint32_t exterior) {
    const ExteriorTriangle& t = finder.tree().triangles()[exterior];
    const bool quad = t.face >= mesh_.triangle_count();
    return Half{t.face, quad && t.corner[1] != mesh_.quad[t.face - mesh_.triangle_count()][1]};
  };
  for (const std::uint32_t exit : finder.trianglesOf(cells_[j])) {
    if (finder.sign(exit) >= 0) continue;
    for (const std::uint32_t entry : finder.trianglesOf(cells_[i])) {
      if (finder.sign(entry) <= 0 || !finder.related(exit, entry, viewpoint_)) continue;
      const Triangle a = finder.tree().corners(exit), b = finder.tree().corners(entry);
      if (!seenTogether(a, b, viewpoint_, polygons_.tolerance())) continue;
      const Polygon exits = polygons_.add(a), entries = polygons_.add(b);
      forEachPieceAt(j, half(exit), exits, [&](std::uint32_t front, Polygon left) {
        forEachPieceAt(i, half(entry), entries, [&](std::uint32_t behind, Polygon entered) {
          Edge edge{behind, front, left, entered};
          if (edge.from == edge.to) return;
          narrow(edge);
          if (!edge.exit.empty()) edges_.push_back(edge);
        });
      });
    }
  }
}

// Leaves of both windows what one is seen of through the other; empties the exit where that is nothing.
void CycleCutter::narrow(Edge& edge) {
  const Polygon exit = edge.exit, entry = edge.entry;
  const auto within = [&](Polygon polygon, Polygon window) {
    std::vector<Plane> planes;
    eyePlanes(window, planes);
    for (const Plane& plane : planes) {
      const int s = polygons_.side(window, plane.half);
      if (polygon.empty() || (s != 1 && s != -1)) continue;
      polygon = polygons_.clip(polygon, s > 0 ? plane.half : opposite(plane.half));
    }
    return polygon;
  };
  edge.exit = within(exit, entry);
  edge.entry = within(entry, exit);
  if (edge.exit.empty() || edge.entry.empty()) edge.exit = {};
}

// `long_rounds` are those that found long cycles alone since the component lost a good part of itself.
bool CycleCutter::resolve(Nodes nodes, Edges edges, std::size_t long_rounds, Order& order) {
  bool right = true;
  for (;;) {
    indexNodes(nodes, edges);
    const auto components = strongComponents(static_cast<std::uint32_t>(nodes.size()), [&](std::uint32_t i, auto&& f) {
      for (const std::uint32_t e : incident_[i]) {
        if (edges_[e].from == nodes[i]) f(local_[edges_[e].to]);
      }
    });
    if (components.size() == 1 && nodes.size() > large_component && ++large_rounds_ > most_large_rounds) {
      emitByDepth(nodes, order);
      return false;
    }
    if (components.size() == 1 && nodes.size() > 1) {
      right = cutSome(nodes, edges, long_rounds) && right;
      continue;
    }
    std::vector<std::uint32_t> component_of(nodes.size());
    for (std::uint32_t c = 0; c < components.size(); ++c) {
      for (const std::uint32_t i : components[c])
        component_of[i] = c;
    }
    std::vector<Edges> inside(components.size());
    for (const std::uint32_t e : edges) {
      const std::uint32_t c = component_of[local_[edges_[e].from]];
      if (c == component_of[local_[edges_[e].to]]) inside[c].push_back(e);
    }
    for (std::size_t c = 0; c < components.size(); ++c) {
      if (components[c].size() == 1) {
        emit(nodes[components[c][0]], order);
        continue;
      }
      Nodes part;
      for (const std::uint32_t i : components[c])
        part.push_back(nodes[i]);
      const bool most = least_share * (nodes.size() - part.size()) < nodes.size();
      right = resolve(std::move(part), std::move(inside[c]), most ? long_rounds : 0, order) && right;
    }
    return right;
  }
}

// Numbers the nodes 0, 1, ... in local_ and lists the edges at each.
void CycleCutter::indexNodes(const Nodes& nodes, const Edges& edges) {
  local_.resize(pieces_.size(), unset);
  for (std::uint32_t i = 0; i < nodes.size(); ++i)
    local_[nodes[i]] = i;
  incident_.resize(std::max(incident_.size(), nodes.size()));
  for (std::size_t i = 0; i < nodes.size(); ++i)
    incident_[i].clear();
  for (const std::uint32_t e : edges) {
    incident_[local_[edges_[e].from]].push_back(e);
    incident_[local_[edges_[e].to]].push_back(e);
  }
}

// One round: cuts pieces of many short cycles that have no neighbour in common. Where none can be cut it gives up a
// relation of each of these cycles and returns false.
bool CycleCutter::cutSome(Nodes& nodes, Edges& edges, std::size_t& long_rounds) {
  const auto count = static_cast<std::uint32_t>(nodes.size());
  std::uint32_t step = std::max(1U, count / most_roots);
  std::vector<std::uint8_t> blocked(count, 0);
  std::vector<Edges> uncut;
  bool any = false;
  // Most cycles are short; the search from a node that is on no short one ends early, unless it is all there is.
  std::size_t reach = count <= short_reach ? count : short_reach;
  std::uint32_t in_the_way = 0;
  for (std::uint32_t root = 0; uncut.size() < most_failures; root += step) {
    if (root >= count) {
      if (any || !uncut.empty() || reach >= count) break;
      if (++long_rounds > most_long_rounds && splitInTwo(nodes, edges)) return true;
      reach = count;
      step = std::max(1U, count / most_long);
      root = 0;
    }
    if (blocked[root] != 0 || (reach < count && on_no_short_cycle_[nodes[root]] != 0)) continue;
    Edges cycle = shortestCycle(nodes, root, reach);
    if (cycle.empty()) {
      on_no_short_cycle_[nodes[root]] = 1;
      continue;
    }
    if (std::any_of(cycle.begin(), cycle.end(),
                    [&](std::uint32_t e) { return blocked[local_[edges_[e].from]] != 0; })) {
      if (reach > short_reach && ++in_the_way >= most_in_the_way) break;
      continue;
    }
    const Choice choice = cuts_left_ > 0 ? chooseCut(cycle) : Choice{};
    if (!choice.found) {
      for (const std::uint32_t e : cycle)
        blocked[local_[edges_[e].from]] = 1;
      uncut.push_back(std::move(cycle));
      continue;
    }
    const std::uint32_t piece = local_[choice.piece];
    blocked[piece] = 1;
    for (const std::uint32_t e : incident_[piece]) {
      blocked[local_[edges_[e].from]] = 1;
      blocked[local_[edges_[e].to]] = 1;
    }
    cut(choice, incident_[piece], nodes, edges);
    --cuts_left_;
    any = true;
  }
  if (!any) {
    for (const Edges& cycle : uncut)
      dropLeast(cycle);
  }
  dropEmpty(edges);
  return any;
}

void CycleCutter::dropEmpty(Edges& edges) const {
  edges.erase(std::remove_if(edges.begin(), edges.end(), [&](std::uint32_t e) { return edges_[e].exit.empty(); }),
              edges.end());
}

// On which sides of the plane the relations of each node in hand are seen: bit 0 on the positive, bit 1 on the negative
// one.
void CycleCutter::findSides(const HalfSpace& half, const Edges& edges, std::vector<std::uint8_t>& sides) const {
  constexpr std::array<std::uint8_t, 4> bits{2, 3, 1, 0};  // of side() -1, 0, 1 and 2
  std::fill(sides.begin(), sides.end(), std::uint8_t{0});
  for (const std::uint32_t e : edges) {
    const Edge& edge = edges_[e];
    const std::uint8_t exit = bits[static_cast<std::size_t>(polygons_.side(edge.exit, half) + 1)];
    sides[local_[edge.to]] |= exit;
    sides[local_[edge.from]] |=
        edge.entry.empty() ? exit : bits[static_cast<std::size_t>(polygons_.side(edge.entry, half) + 1)];
  }
}

// Cuts all pieces in the way of a plane through the viewpoint and an edge of a long cycle: the one that cuts the fewest
// for what it leaves on the smaller side. False, and nothing cut, where no plane leaves enough on both.
bool CycleCutter::splitInTwo(Nodes& nodes, Edges& edges) {
  const Edges cycle = shortestCycle(nodes, 0, nodes.size());
  std::vector<Plane> planes;
  for (const std::uint32_t e : cycle)
    eyePlanes(edges_[e].exit, planes);
  const std::size_t step = std::max<std::size_t>(1, planes.size() / most_planes);
  Nodes best;
  HalfSpace best_half{};
  double best_cost = std::numeric_limits<double>::infinity();
  std::vector<std::uint8_t> sides(nodes.size());
  for (std::size_t p = 0; p < planes.size(); p += step) {
    const HalfSpace& half = planes[p].half;
    findSides(half, edges, sides);
    std::array<std::size_t, 4> count{};
    Nodes crossed;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      ++count[sides[i]];
      if (sides[i] == 3) crossed.push_back(nodes[i]);
    }
    const std::size_t smaller = std::min(count[1], count[2]) + crossed.size();
    if (least_share * smaller < nodes.size() || crossed.size() > cuts_left_) continue;
    const double cost = static_cast<double>(crossed.size()) / static_cast<double>(smaller);
    if (cost >= best_cost) continue;
    best_cost = cost;
    best = std::move(crossed);
    best_half = half;
  }
  if (best.empty()) return false;
  cuts_left_ -= best.size();
  splitBy(best_half, best, nodes, edges);
  return true;
}

// Of a plane that no ray crosses: no relation leads from one side to the other.
void CycleCutter::splitBy(const HalfSpace& half, const Nodes& crossed, Nodes& nodes, Edges& edges) {
  std::vector<std::uint32_t> beyond(pieces_.size());
  std::iota(beyond.begin(), beyond.end(), 0U);
  for (const std::uint32_t piece : crossed) {
    beyond[piece] = static_cast<std::uint32_t>(pieces_.size());
    nodes.push_back(beyond[piece]);
    addPart(piece, half);
  }
  const auto part = [&](const Edge& edge, const HalfSpace& side) {
    Edge of_it{edge.from, edge.to, polygons_.clip(edge.exit, side), polygons_.clip(edge.entry, side)};
    const Polygon other = edge.entry.empty() ? of_it.exit : of_it.entry;
    if (of_it.exit.empty() || other.empty() || !areSeenTogether(of_it.exit, other)) of_it.exit = {};
    return of_it;
  };
  for (std::size_t k = 0, count = edges.size(); k < count; ++k) {
    Edge far = part(edges_[edges[k]], opposite(half));
    edges_[edges[k]] = part(edges_[edges[k]], half);
    if (far.exit.empty()) continue;
    far.from = beyond[far.from];
    far.to = beyond[far.to];
    edges.push_back(static_cast<std::uint32_t>(edges_.size()));
    edges_.push_back(far);
  }
  dropEmpty(edges);
}

// Leaves of a piece what lies on the positive side of the plane, and adds the rest as a new one.
void CycleCutter::addPart(std::uint32_t piece, const HalfSpace& half) {
  pieces_.push_back(pieces_[piece]);
  on_no_short_cycle_.push_back(on_no_short_cycle_[piece]);
  pieces_[piece].keep.push_back(half);
  pieces_.back().keep.push_back(opposite(half));
}

// The plane of a face of the cycle, or else one through the viewpoint.
CycleCutter::Choice CycleCutter::chooseCut(const Edges& cycle) const {
  std::vector<Plane> planes;
  if (cycle.size() <= longest_cycle) {
    for (const std::uint32_t e : cycle)
      facePlanes(pieces_[edges_[e].from].cell, planes);
  }
  const Choice choice = chooseCut(cycle, planes);
  if (choice.found) return choice;
  planes.clear();
  for (const std::uint32_t e : cycle) {
    eyePlanes(edges_[e].exit, planes);
    eyePlanes(edges_[e].entry, planes);
  }
  return chooseCut(cycle, planes);
}

// Gives up the relation that is seen through the smallest window.
void CycleCutter::dropLeast(const Edges& cycle) {
  std::uint32_t least = cycle.front();
  double least_size = std::numeric_limits<double>::infinity();
  for (const std::uint32_t e : cycle) {
    const std::span<const Vec3> p = polygons_[edges_[e].exit];
    Vec3 area(0.0);
    for (std::size_t k = 2; k < p.size(); ++k)
      area += cross(p[k - 1] - p[0], p[k] - p[0]);
    const Vec3 sight = viewpoint_.w == 0.0 ? Vec3(viewpoint_) : Vec3(viewpoint_) - p[0];
    const double size = std::abs(dot(area, sight)) / std::sqrt(dot(sight, sight));
    if (size < least_size) {
      least_size = size;
      least = e;
    }
  }
  edges_[least].exit = {};
}

// Breadth first from a node over at most `reach` nodes: the edges of a shortest way back to it, in their direction, or
// none.
CycleCutter::Edges CycleCutter::shortestCycle(const Nodes& nodes, std::uint32_t root, std::size_t reach) {
  came_by_.resize(std::max(came_by_.size(), nodes.size()), unset);
  std::vector<std::uint32_t> queue{root};
  std::uint32_t closing = unset;
  for (std::size_t head = 0; head < std::min(queue.size(), reach) && closing == unset; ++head) {
    for (const std::uint32_t e : incident_[queue[head]]) {
      if (edges_[e].from != nodes[queue[head]]) continue;
      const std::uint32_t to = local_[edges_[e].to];
      if (to == root) {
        closing = e;
        break;
      }
      if (came_by_[to] != unset) continue;
      came_by_[to] = e;
      queue.push_back(to);
    }
  }
  Edges cycle;
  for (std::uint32_t e = closing; e != unset;) {
    cycle.push_back(e);
    const std::uint32_t from = local_[edges_[e].from];
    e = from == root ? unset : came_by_[from];
  }
  for (const std::uint32_t i : queue)
    came_by_[i] = unset;
  std::reverse(cycle.begin(), cycle.end());
  return cycle;
}

void CycleCutter::facePlanes(mesh::Id cell, std::vector<Plane>& out) const {
  for (const mesh::FaceUse use : mesh_.faces(cell)) {
    forEachHalf(mesh_, signs_, use.face(), [&](std::size_t row, const auto& c) {
      const Vec3& a = mesh_.points[c[0]];
      const Vec3 n = cross(mesh_.points[c[1]] - a, mesh_.points[c[2]] - a);
      const double length = std::sqrt(dot(n, n));
      if (!(length > 0.0)) return;
      out.push_back({{n / length, -dot(n / length, a)}, signs_.sign(row)});
    });
  }
}

void CycleCutter::eyePlanes(Polygon polygon, std::vector<Plane>& out) const {
  const std::span<const Vec3> corners = polygons_[polygon];
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 &p = corners[k], &q = corners[(k + 1) % corners.size()];
    const Vec3 n = cross(q - p, viewpoint_.w == 0.0 ? Vec3(viewpoint_) : Vec3(viewpoint_) - p);
    const double length = std::sqrt(dot(n, n));
    if (length > 0.0) out.push_back({{n / length, -dot(n / length, p)}, 0});
  }
}

CycleCutter::Choice CycleCutter::chooseCut(const Edges& cycle, const std::vector<Plane>& planes) const {
  Choice best;
  std::vector<Polygon> behind, before;
  for (std::size_t i = 0; i < cycle.size(); ++i) {
    const Edge& in = edges_[cycle[i]];
    const Edge& out = edges_[cycle[(i + 1) % cycle.size()]];
    const std::uint32_t piece = in.to;
    const Polygon in_part = in.exit, out_part = out.entry.empty() ? out.exit : out.entry;
    behind.clear();
    before.clear();
    for (const std::uint32_t e : incident_[local_[piece]]) {
      const Edge& edge = edges_[e];
      if (edge.to == piece) behind.push_back(edge.exit);
      if (edge.from == piece) before.push_back(edge.entry.empty() ? edge.exit : edge.entry);
    }
    for (const Plane& plane : planes) {
      // What lies behind the piece must be on the viewpoint's side.
      const int in_side = polygons_.side(in_part, plane.half), out_side = polygons_.side(out_part, plane.half);
      const int near = plane.viewer != 0 ? plane.viewer : in_side;
      const bool in_ok = in_side == near, out_ok = out_side == -near;
      const bool straddles = (in_ok && out_ok) || (in_ok && out_side == 2) || (out_ok && in_side == 2);
      if (!straddles || near == 0 || near == 2) continue;
      std::size_t crossed = 0;
      bool has_near = false, has_far = false;
      for (const Polygon p : behind) {
        const int s = polygons_.side(p, plane.half);
        crossed += s == -near || s == 0 ? 1U : 0U;
      }
      for (const Polygon p : before) {
        const int s = polygons_.side(p, plane.half);
        crossed += s == near || s == 0 ? 1U : 0U;
      }
      for (const mesh::Id v : mesh_.vertices(pieces_[piece].cell)) {
        const double h = height(plane.half, mesh_.points[v]) * near;
        has_near = has_near || h > polygons_.tolerance();
        has_far = has_far || h < -polygons_.tolerance();
      }
      if (!has_near || !has_far) continue;
      if (!best.found || crossed < best.crossed) best = {piece, plane, crossed, true};
      if (crossed == 0) return best;
    }
  }
  return best;
}

bool CycleCutter::isSeen(Polygon polygon) const {
  return seen(polygons_[polygon], viewpoint_, polygons_.tolerance());
}
// A shared face is both at once.
bool CycleCutter::areSeenTogether(Polygon a, Polygon b) const {
  if (a.begin == b.begin) return isSeen(a);
  return seenTogether(polygons_[a], polygons_[b], viewpoint_, polygons_.tolerance());
}

// The cell in its tetrahedra, each cut by the plane: the corners in which its edges meet it, in convex order.
std::vector<CycleCutter::Polygon> CycleCutter::section(const Piece& piece, const HalfSpace& half) {
  std::vector<mesh::Tetrahedron> tetrahedra;
  mesh::tetrahedra(mesh_, piece.cell, tetrahedra);
  std::vector<Polygon> sections;
  for (const auto& t : tetrahedra) {
    std::array<Vec3, 4> corner{};
    std::size_t count = 0;
    const auto above = [&](mesh::Id v) { return height(half, mesh_.points[v]) > 0.0; };
    for (const mesh::Id u : t) {
      for (const mesh::Id v : t) {
        if (!above(u) || above(v)) continue;
        const Vec3 &p = mesh_.points[u], &q = mesh_.points[v];
        const double hp = height(half, p), hq = height(half, q);
        corner[count++] = p + (q - p) * (hp / (hp - hq));
      }
    }
    if (count < 3) continue;
    if (count == 4) std::swap(corner[2], corner[3]);
    Polygon polygon = polygons_.add(std::span(corner).first(count));
    for (const HalfSpace& keep : piece.keep)
      polygon = polygons_.clip(polygon, keep);
    if (!polygon.empty()) sections.push_back(polygon);
  }
  return sections;
}

void CycleCutter::cut(const Choice& choice, const Edges& at_piece, Nodes& nodes, Edges& edges) {
  const std::uint32_t near = choice.piece;
  const auto far = static_cast<std::uint32_t>(pieces_.size());
  const bool above = choice.plane.viewer >= 0;
  const HalfSpace near_half = above ? choice.plane.half : opposite(choice.plane.half);
  const HalfSpace far_half = opposite(near_half);
  const std::vector<Polygon> sections = section(pieces_[near], near_half);
  addPart(near, near_half);
  nodes.push_back(far);
  for (const std::uint32_t e : at_piece) {
    const Edge edge = edges_[e];
    if (edge.exit.empty()) continue;
    const bool uses_entry = edge.from == near && !edge.entry.empty();
    Edge halves[2] = {edge, edge};
    for (int h = 0; h < 2; ++h) {
      Polygon& polygon = uses_entry ? halves[h].entry : halves[h].exit;
      // A face in the plane of the cut bounds the half that lies on its own side: it is the far boundary of the cell
      // that comes after and the near one of the cell that comes before.
      if (polygons_.side(polygon, near_half) == 2) {
        if ((edge.to == near) != (h == 0)) polygon = {};
      } else {
        polygon = polygons_.clip(polygon, h == 0 ? near_half : far_half);
      }
      if (h == 1) (edge.from == near ? halves[h].from : halves[h].to) = far;
      const Polygon other = halves[h].entry.empty() ? halves[h].exit : halves[h].entry;
      const bool gone = polygon.empty() || !areSeenTogether(halves[h].exit, other);
      if (gone) {
        halves[h].exit = {};
      } else if (!edge.entry.empty()) {
        narrow(halves[h]);
      }
    }
    edges_[e] = halves[0];
    if (!halves[1].exit.empty()) {
      edges.push_back(static_cast<std::uint32_t>(edges_.size()));
      edges_.push_back(halves[1]);
    }
  }
  if (choice.plane.viewer == 0) return;
  for (const Polygon polygon : sections) {
    if (!isSeen(polygon)) continue;
    edges.push_back(static_cast<std::uint32_t>(edges_.size()));
    edges_.push_back({far, near, polygon, {}});
  }
}

void CycleCutter::emitByDepth(const Nodes& nodes, Order& order) const {
  std::vector<std::pair<double, std::uint32_t>> keyed;  // nearness along the line of sight, node
  for (const std::uint32_t node : nodes) {
    Vec3 mean(0.0);
    const auto vertices = mesh_.vertices(pieces_[node].cell);
    for (const mesh::Id v : vertices)
      mean += mesh_.points[v];
    mean /= static_cast<double>(vertices.size());
    const Vec3 away = mean - Vec3(viewpoint_);
    keyed.emplace_back(viewpoint_.w == 0.0 ? dot(mean, Vec3(viewpoint_)) : -dot(away, away), node);
  }
  std::sort(keyed.begin(), keyed.end());
  for (const auto& [nearness, node] : keyed)
    emit(node, order);
}

void CycleCutter::emit(std::uint32_t node, Order& order) const {
  const Piece& piece = pieces_[node];
  if (!piece.keep.empty()) order.cuts.add(static_cast<std::uint32_t>(order.cells.size()), piece.keep);
  order.cells.push_back(piece.cell);
  order.layer_offset.push_back(static_cast<std::uint32_t>(order.cells.size()));
}

}  // namespace spillikin::sort
