// A planar subdivision in Baumgart's winged-edge structure, built by walking (Max, Williams, Silva 2000, section II;
// Baumgart, "Winged-edge polyhedron representation", 1972).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/planar_predicates.h"

namespace spillikin::mesh {

// Segments are inserted one by one. Each is walked from one end to the other: through a region, to where it leaves it
// (a vertex, or an edge that gets a new vertex there), into the next region or along an edge that it overlaps, until
// its end. Every step that crosses a region divides it in two. Points at equal coordinates are one vertex.
//
// Guarantee: the topology (which vertices coincide, what crosses what and in which order, which regions there are) is
// that of the exact arrangement of the segments between the given doubles. A crossing is kept as the pair of segments
// that made it, and every predicate is evaluated on their end points; only the coordinates that position() gives for a
// crossing are rounded, and nothing is decided by them.
//
// Cost: a segment costs the boundaries of the regions it crosses. Meant for tens of segments: one cell's edges. All
// storage is kept by clear(), so that after the largest cell nothing is allocated.
class PlanarSubdivision {
 public:
  using Index = std::uint32_t;
  static constexpr Index none = 0xFFFFFFFFU;

  // How a vertex came to be: an inserted point, or the proper crossing of two segments.
  struct Vertex {
    Index point = none;                         // the first point that lies here, or none
    std::array<Index, 2> segments{none, none};  // the segments that cross, where point == none
    Index dart = none;                          // one of the edge ends here
  };

  void clear();

  // Returns the point's index. Coordinates must be finite.
  Index addPoint(const Vec2& position);

  // Inserts the segment between two points and returns its index, or none when the points coincide. All segments must
  // be connected: at least one of the points has to be a vertex already, but for the very first segment (throws Error).
  Index insert(Index a, Index b);

  // The first point at the same coordinates; vertices and segments name only such points.
  Index canonical(Index point) const { return canonical_[point]; }

  // True when the point is a vertex of an inserted segment.
  bool inserted(Index point) const { return vertex_of_point_[canonical_[point]] != none; }

  // Numbers the regions. Call once after the last insert; what follows is valid from then on.
  void finish();

  std::size_t vertexCount() const { return vertices_.size(); }
  std::size_t edgeCount() const { return edges_.size(); }
  std::size_t regionCount() const { return region_offset_.size() - 1; }  // bounded ones

  const Vertex& vertex(Index v) const { return vertices_[v]; }
  Vec2 position(Index v) const;  // exact for points, rounded for crossings

  // Where along segment (which == 0: the first of the two that cross) the crossing lies: 0 at its first point, 1 at its
  // second.
  double parameter(Index v, int which) const;
  std::array<Index, 2> segment(Index s) const { return segments_[s]; }

  // On which side of the segment's line a vertex lies, exact: 1 left, 0 on it, -1 right.
  int side(Index segment, Index vertex) const { return sideOf(segment, place(vertex)); }

  // The vertices of a bounded region, counterclockwise in a frame whose y runs upwards. Edges that end inside the
  // region are left out.
  std::span<const Index> region(std::size_t r) const {
    return {region_vertex_.data() + region_offset_[r], region_vertex_.data() + region_offset_[r + 1]};
  }
  // Sign of the turn of a region's boundary at its k-th vertex, exact: 1 left, 0 straight on, -1 right.
  int turn(std::size_t r, std::size_t k) const;

 private:
  // A dart is an edge seen from one of its ends: dart 2e + i starts at vertex[i] of edge e. Dart 2e runs along the
  // edge's segment, dart 2e + 1 against it.
  using Dart = Index;
  struct Edge {
    std::array<Index, 2> vertex;
    std::array<Index, 2> region;  // to the left of each dart
    std::array<Dart, 2> ccw, cw;  // the wings: next dart around vertex[i], either way
    Index segment;                // the first that runs here; others overlap it exactly
  };
  // A place on a segment's line: a point, or a crossing of two segments.
  struct Place {
    Index point = none;
    std::array<Index, 2> segments{none, none};
  };
  struct Hit {
    Index vertex = none;  // an existing vertex, or
    Dart dart = none;     // an edge that is crossed, or
    bool at_end = false;  // (with dart) the new end point lies on it
  };

  // Signed areas by segment and point, computed when first asked for: row s holds stride_ points.
  struct Cached {
    SignedArea area;
    bool known = false;
  };

  static Dart twin(Dart d) { return d ^ 1U; }
  Index origin(Dart d) const { return edges_[d >> 1U].vertex[d & 1U]; }
  Index target(Dart d) const { return edges_[d >> 1U].vertex[(d & 1U) ^ 1U]; }
  Dart ccw(Dart d) const { return edges_[d >> 1U].ccw[d & 1U]; }
  Dart cw(Dart d) const { return edges_[d >> 1U].cw[d & 1U]; }
  Dart next(Dart d) const { return cw(twin(d)); }  // along the boundary of the region to the left
  Place place(Index v) const { return {vertices_[v].point, vertices_[v].segments}; }

  Line line(Index s) const { return {points_[segments_[s][0]], points_[segments_[s][1]]}; }
  const SignedArea& area(Index segment, Index point) const {
    Cached& cached = areas_[segment * stride_ + point];
    if (!cached.known) {
      computeArea(segment, point, cached);
    }
    return cached.area;
  }
  void computeArea(Index segment, Index point, Cached& cached) const;
  int sideOf(Index segment, const Place& place) const;
  int cross(Index s, Index t) const;
  bool sameDirection(Index s, Index t) const;
  int compareAlong(Index s, const Place& a, const Place& b) const;
  int turnTo(Dart d, Index s, bool reversed) const;
  int turnBetween(Dart d, Dart e) const;

  Index newVertex(Index point, Index segment_a, Index segment_b);
  void splitEdge(Index edge, Index vertex);
  void addEdge(Index from, Dart from_wedge, Index to, Index s);
  void attach(Dart d, Dart after);
  Dart wedge(Index vertex, Index s, bool reversed, bool& along) const;
  Hit firstHit(Index from, Dart wedge_dart, Index s) const;
  void reach(Index vertex, Index s);
  Index walkAlong(Dart d, Index s);
  Index walkThrough(Index from, Dart wedge_dart, Index s);
  Dart outerDart() const;
  void collectRegion(Dart first, Index region, bool bounded);

  std::vector<Vec2> points_;
  std::vector<Index> canonical_;        // per point: the first at the same coordinates
  std::vector<Index> vertex_of_point_;  // per canonical point
  std::vector<std::array<Index, 2>> segments_;
  std::vector<Vertex> vertices_;
  std::vector<Edge> edges_;
  std::vector<Index> region_offset_, region_vertex_;
  std::vector<Dart> region_dart_;  // the dart that leaves each of region_vertex_

  mutable std::vector<Cached> areas_;
  std::size_t stride_ = 0;
};

}  // namespace spillikin::mesh
