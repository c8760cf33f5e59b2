#include "spillikin/mesh/planar_subdivision.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spillikin/base/error.h"

namespace spillikin::mesh {

namespace {

int signOf(double difference) {
  return (difference > 0.0) - (difference < 0.0);
}

}  // namespace

void PlanarSubdivision::clear() {
  points_.clear();
  canonical_.clear();
  vertex_of_point_.clear();
  segments_.clear();
  areas_.clear();
  stride_ = 0;
  vertices_.clear();
  edges_.clear();
  region_offset_.assign(1, 0);
  region_vertex_.clear();
  region_dart_.clear();
}

PlanarSubdivision::Index PlanarSubdivision::addPoint(const Vec2& position) {
  const Index point = static_cast<Index>(points_.size());
  const auto same = std::find(points_.begin(), points_.end(), position);
  canonical_.push_back(static_cast<Index>(same - points_.begin()));
  points_.push_back(position);
  vertex_of_point_.push_back(none);
  return point;
}

// ---- Predicates: all of them come down to the signed areas of a segment and an inserted point. ----

void PlanarSubdivision::computeArea(Index segment, Index point, Cached& cached) const {
  const auto& [a, b] = segments_[segment];
  cached.known = true;
  if (point != a && point != b) {
    cached.area = signedArea(points_[a], points_[b], points_[point]);
  }
}

// On which side of the segment's line the place lies: 1 left, 0 on it, -1 right.
int PlanarSubdivision::sideOf(Index segment, const Place& place) const {
  if (place.point != none) {
    return area(segment, place.point).sign;
  }
  const auto [f, g] = place.segments;
  if (segment == f || segment == g) {
    return 0;
  }
  const int g0 = area(segment, segments_[g][0]).sign;
  const int g1 = area(segment, segments_[g][1]).sign;
  if (g0 == g1) {  // the crossing lies between the ends of g
    return g0;
  }
  const auto [f0, f1] = segments_[f];
  return sideOfCrossing(line(segment), line(f), line(g), area(segment, f0), area(segment, f1), area(g, f0),
                        area(g, f1));
}

// Sign of the cross product of the directions of s and t: the side of s that t leads to.
int PlanarSubdivision::cross(Index s, Index t) const {
  const int from = area(s, segments_[t][0]).sign;
  const int to = area(s, segments_[t][1]).sign;
  if (from != to) {
    return to > from ? 1 : -1;
  }
  if (from == 0) {
    return 0;
  }
  return crossSign(points_[segments_[s][0]], points_[segments_[s][1]], points_[segments_[t][0]],
                   points_[segments_[t][1]]);
}

// Of two parallel segments.
bool PlanarSubdivision::sameDirection(Index s, Index t) const {
  const auto sign = [this](Index k, int axis) {
    return signOf(points_[segments_[k][1]][axis] - points_[segments_[k][0]][axis]);
  };
  const int axis = sign(s, 0) != 0 ? 0 : 1;
  return sign(s, axis) == sign(t, axis);
}

// Which of two places on the line of s comes first along it: -1 for a, 0 when they are one, 1 for b.
int PlanarSubdivision::compareAlong(Index s, const Place& a, const Place& b) const {
  if (a.point != none && b.point != none) {
    const Vec2& from = points_[segments_[s][0]];
    const Vec2& to = points_[segments_[s][1]];
    const int axis = from.x != to.x ? 0 : 1;
    return signOf(points_[a.point][axis] - points_[b.point][axis]) * signOf(to[axis] - from[axis]);
  }
  if (a.point != none) {
    return -compareAlong(s, b, a);
  }
  Index other = a.segments[0];
  int rise = other == s ? 0 : cross(other, s);
  if (rise == 0) {
    other = a.segments[1];
    rise = cross(other, s);
  }
  return -rise * sideOf(other, b);
}

// Sign of the turn from the dart's direction to that of s (reversed: against it): 1 left, -1 right, 0 the same
// direction, 2 straight back.
int PlanarSubdivision::turnTo(Dart d, Index s, bool reversed) const {
  const Index e = edges_[d >> 1U].segment;
  const bool against = ((d & 1U) != 0) != reversed;
  const int sign = e == s ? 0 : cross(e, s);
  if (sign == 0) {
    return (e == s || sameDirection(e, s)) != against ? 0 : 2;
  }
  return against ? -sign : sign;
}

int PlanarSubdivision::turnBetween(Dart d, Dart e) const {
  const int turn = turnTo(d, edges_[e >> 1U].segment, (e & 1U) != 0);
  return turn == 2 ? 0 : turn;
}

// ---- The winged edges ----

PlanarSubdivision::Index PlanarSubdivision::newVertex(Index point, Index segment_a, Index segment_b) {
  const Index v = static_cast<Index>(vertices_.size());
  vertices_.push_back({point, {segment_a, segment_b}, none});
  if (point != none) {
    vertex_of_point_[point] = v;
  }
  return v;
}

// Puts dart d around its origin, next counterclockwise after `after` (none: it is the first there).
void PlanarSubdivision::attach(Dart d, Dart after) {
  Edge& edge = edges_[d >> 1U];
  const unsigned end = d & 1U;
  if (after == none) {
    vertices_[edge.vertex[end]].dart = d;
    edge.ccw[end] = edge.cw[end] = d;
    return;
  }
  const Dart before = ccw(after);
  edge.ccw[end] = before;
  edge.cw[end] = after;
  edges_[after >> 1U].ccw[after & 1U] = d;
  edges_[before >> 1U].cw[before & 1U] = d;
}

// Cuts an edge at a new vertex: the edge keeps its first end, a new edge takes its place at the second.
void PlanarSubdivision::splitEdge(Index edge, Index vertex) {
  const Index fresh = static_cast<Index>(edges_.size());
  edges_.push_back(edges_[edge]);
  Edge& head = edges_[edge];
  Edge& tail = edges_[fresh];
  const Dart old_end = 2 * edge + 1;
  const Dart new_end = 2 * fresh + 1;
  tail.vertex[0] = head.vertex[1] = vertex;
  const Dart after = tail.ccw[1];
  const Dart before = tail.cw[1];
  if (after == old_end) {
    tail.ccw[1] = tail.cw[1] = new_end;
  } else {
    edges_[after >> 1U].cw[after & 1U] = new_end;
    edges_[before >> 1U].ccw[before & 1U] = new_end;
  }
  vertices_[tail.vertex[1]].dart = new_end;
  attach(old_end, none);
  attach(2 * fresh, old_end);
}

// An edge along s through one region; dart 2e starts at `from`.
void PlanarSubdivision::addEdge(Index from, Dart from_wedge, Index to, Index s) {
  bool along = false;
  const Dart to_wedge = wedge(to, s, true, along);
  const Index e = static_cast<Index>(edges_.size());
  edges_.push_back({{from, to}, {none, none}, {none, none}, {none, none}, s});
  attach(2 * e, from_wedge);
  attach(2 * e + 1, to_wedge);
}

// The dart after which, counterclockwise around the vertex, the direction of s (reversed: against it) leads; or the
// dart that leads in this direction itself, with `along` set. none when no edge ends at the vertex yet.
PlanarSubdivision::Dart PlanarSubdivision::wedge(Index vertex, Index s, bool reversed, bool& along) const {
  const Dart first = vertices_[vertex].dart;
  along = false;
  if (first == none) {
    return none;
  }
  Dart d = first;
  int turn = turnTo(d, s, reversed);
  do {
    if (turn == 0) {
      along = true;
      return d;
    }
    const Dart following = ccw(d);
    if (following == d) {
      return d;
    }
    const int following_turn = turnTo(following, s, reversed);
    if (following_turn == 0) {
      along = true;
      return following;
    }
    const int opening = turnBetween(d, following);
    const bool inside = opening > 0    ? turn == 1 && following_turn == -1
                        : opening == 0 ? turn == 1
                                       : !(turn == -1 && following_turn == 1);
    if (inside) {
      return d;
    }
    d = following;
    turn = following_turn;
  } while (d != first);
  throw Error("planar subdivision: no direction is left around a vertex; give finite coordinates");
}

// ---- Walking ----

// Where a walk along s that leaves `from` into the region left of `wedge_dart` first meets the region's boundary, not
// beyond the segment's end. Neither vertex nor dart: the segment ends inside the region.
PlanarSubdivision::Hit PlanarSubdivision::firstHit(Index from, Dart wedge_dart, Index s) const {
  Hit best;
  if (wedge_dart == none) {
    return best;
  }
  const Place start = place(from);
  const Place end{segments_[s][1], {none, none}};
  Place best_place;
  bool found = false;
  const auto offer = [&](const Hit& hit, const Place& where) {
    if (!found || compareAlong(s, where, best_place) < 0) {
      best = hit;
      best_place = where;
      found = true;
    }
  };
  Dart d = wedge_dart;
  int side_a = 0;  // of `from`
  do {
    const Index a = origin(d);
    const Index b = target(d);
    const int side_b = b == from ? 0 : sideOf(s, place(b));
    if (b != from && side_b == 0) {
      const Place where = place(b);
      if (compareAlong(s, start, where) < 0 && compareAlong(s, where, end) <= 0) {
        offer({b, none, false}, where);
      }
    } else if (a != from && b != from && side_a * side_b < 0) {
      const Index e = edges_[d >> 1U].segment;
      const int rise = cross(e, s);  // how the side of e changes along s
      const int end_side = sideOf(e, end);
      if (sideOf(e, start) == -rise && end_side != -rise) {
        const bool at_end = end_side == 0;
        offer({none, d, at_end}, at_end ? end : Place{none, {s, e}});
      }
    }
    side_a = side_b;
    d = next(d);
  } while (d != wedge_dart);
  return best;
}

// The walk along s has come to an existing vertex: it may be where the segment's new end point lies.
void PlanarSubdivision::reach(Index vertex, Index s) {
  const Index end = segments_[s][1];
  if (vertex_of_point_[end] == none && vertices_[vertex].point == none &&
      compareAlong(s, place(vertex), {end, {none, none}}) == 0) {
    vertices_[vertex].point = end;
    vertex_of_point_[end] = vertex;
  }
}

// Along an edge that s overlaps, to its far end or to the segment's.
PlanarSubdivision::Index PlanarSubdivision::walkAlong(Dart d, Index s) {
  const Index end = segments_[s][1];
  const Index to = target(d);
  if (vertex_of_point_[end] == none && compareAlong(s, place(to), {end, {none, none}}) > 0) {
    const Index v = newVertex(end, none, none);
    splitEdge(d >> 1U, v);
    return v;
  }
  reach(to, s);
  return to;
}

// Through a region, to where s leaves it or ends.
PlanarSubdivision::Index PlanarSubdivision::walkThrough(Index from, Dart wedge_dart, Index s) {
  const Hit hit = firstHit(from, wedge_dart, s);
  Index to = hit.vertex;
  if (hit.dart != none) {
    const Index edge = hit.dart >> 1U;
    to = hit.at_end ? newVertex(segments_[s][1], none, none) : newVertex(none, s, edges_[edge].segment);
    splitEdge(edge, to);
  } else if (to == none) {
    to = newVertex(segments_[s][1], none, none);
  }
  reach(to, s);
  addEdge(from, wedge_dart, to, s);
  return to;
}

PlanarSubdivision::Index PlanarSubdivision::insert(Index a, Index b) {
  a = canonical_[a];
  b = canonical_[b];
  if (a == b) {
    return none;
  }
  if (segments_.empty()) {
    newVertex(a, none, none);
  } else if (vertex_of_point_[a] == none) {
    std::swap(a, b);
    if (vertex_of_point_[a] == none) {
      throw Error("planar subdivision: a segment touches none before it; insert connected segments first");
    }
  }
  const Index s = static_cast<Index>(segments_.size());
  segments_.push_back({a, b});
  if (stride_ < points_.size()) {  // points were added since: start anew
    stride_ = points_.size();
    areas_.assign(segments_.size() * stride_, {});
  } else {
    areas_.resize(segments_.size() * stride_);
  }
  for (Index v = vertex_of_point_[a]; v != vertex_of_point_[b];) {
    bool along = false;
    const Dart d = wedge(v, s, false, along);
    v = along ? walkAlong(d, s) : walkThrough(v, d, s);
  }
  return s;
}

// ---- Regions ----

// A dart with the unbounded region to its left: at the leftmost (then lowest) vertex, which is no crossing, the last
// dart before the direction of -x.
PlanarSubdivision::Dart PlanarSubdivision::outerDart() const {
  Index leftmost = none;
  const auto before = [](const Vec2& p, const Vec2& q) { return p.x < q.x || (p.x == q.x && p.y < q.y); };
  for (Index v = 0; v < vertices_.size(); ++v) {
    if (vertices_[v].point != none &&
        (leftmost == none || before(points_[vertices_[v].point], points_[vertices_[leftmost].point]))) {
      leftmost = v;
    }
  }
  Dart d = vertices_[leftmost].dart;
  while (ccw(d) != d && turnBetween(d, ccw(d)) > 0) {
    d = ccw(d);
  }
  return d;
}

// Labels the loop of `first`; a bounded region's boundary is kept, without edges that are walked both ways.
void PlanarSubdivision::collectRegion(Dart first, Index region, bool bounded) {
  const std::size_t begin = region_dart_.size();
  Dart d = first;
  do {
    edges_[d >> 1U].region[d & 1U] = region;
    if (region_dart_.size() > begin && region_dart_.back() == twin(d)) {
      region_dart_.pop_back();
    } else {
      region_dart_.push_back(d);
    }
    d = next(d);
  } while (d != first);
  std::size_t end = region_dart_.size();
  std::size_t start = begin;
  while (end - start >= 2 && region_dart_[start] == twin(region_dart_[end - 1])) {
    ++start, --end;
  }
  region_dart_.resize(end);
  region_dart_.erase(region_dart_.begin() + static_cast<std::ptrdiff_t>(begin),
                     region_dart_.begin() + static_cast<std::ptrdiff_t>(start));
  if (!bounded) {
    region_dart_.resize(begin);
    return;
  }
  for (std::size_t k = begin; k < region_dart_.size(); ++k) {
    region_vertex_.push_back(origin(region_dart_[k]));
  }
  region_offset_.push_back(static_cast<Index>(region_vertex_.size()));
}

void PlanarSubdivision::finish() {
  region_offset_.assign(1, 0);
  region_vertex_.clear();
  region_dart_.clear();
  if (edges_.empty()) {
    return;
  }
  for (Edge& edge : edges_) {
    edge.region = {none, none};
  }
  constexpr Index outer = none - 1;
  collectRegion(outerDart(), outer, false);
  for (Dart d = 0; d < 2 * edges_.size(); ++d) {
    if (edges_[d >> 1U].region[d & 1U] == none) {
      collectRegion(d, static_cast<Index>(regionCount()), true);
    }
  }
}

int PlanarSubdivision::turn(std::size_t r, std::size_t k) const {
  const std::size_t begin = region_offset_[r];
  const std::size_t count = region_offset_[r + 1] - begin;
  return turnBetween(region_dart_[begin + (k + count - 1) % count], region_dart_[begin + k]);
}

// ---- Coordinates ----

double PlanarSubdivision::parameter(Index v, int which) const {
  const auto& crossed = vertices_[v].segments;
  const Index f = crossed[static_cast<std::size_t>(which)];
  const Index g = crossed[static_cast<std::size_t>(1 - which)];
  return crossingParameter(line(f), line(g), area(g, segments_[f][0]), area(g, segments_[f][1]));
}

Vec2 PlanarSubdivision::position(Index v) const {
  if (vertices_[v].point != none) {
    return points_[vertices_[v].point];
  }
  const auto [a, b] = segments_[vertices_[v].segments[0]];
  const double t = parameter(v, 0);
  return t <= 0.5 ? points_[a] + t * (points_[b] - points_[a]) : points_[b] + (1.0 - t) * (points_[a] - points_[b]);
}

}  // namespace spillikin::mesh
