// The winged-edge subdivision against CGAL's exact arrangement, on drawings with as many coincidences as can be had.
// CGAL's arrangement takes long to compile; it is used in this file alone.
#include "spillikin/mesh/planar_subdivision.h"

#include <CGAL/Arr_segment_traits_2.h>
#include <CGAL/Arrangement_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "spillikin/base/error.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Arrangement = CGAL::Arrangement_2<CGAL::Arr_segment_traits_2<Kernel>>;

struct Drawing {
  std::vector<Vec2> points;
  std::vector<std::array<unsigned, 2>> segments;  // each touches one before it
};

struct Counts {
  std::size_t vertices = 0, edges = 0, regions = 0;
  std::vector<double> areas;  // of the bounded regions, ascending
};

double polygonArea(const std::vector<Vec2>& polygon) {
  double twice = 0.0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec2 a = polygon[k] - polygon[0];
    const Vec2 b = polygon[(k + 1) % polygon.size()] - polygon[0];
    twice += a.x * b.y - a.y * b.x;
  }
  return 0.5 * twice;
}

Counts subdivided(const Drawing& drawing, PlanarSubdivision& subdivision) {
  subdivision.clear();
  for (const Vec2& p : drawing.points) {
    subdivision.addPoint(p);
  }
  for (const auto& [a, b] : drawing.segments) {
    subdivision.insert(a, b);
  }
  subdivision.finish();
  Counts counts{subdivision.vertexCount(), subdivision.edgeCount(), subdivision.regionCount(), {}};
  std::vector<Vec2> polygon;
  for (std::size_t r = 0; r < subdivision.regionCount(); ++r) {
    polygon.clear();
    for (const auto v : subdivision.region(r)) {
      polygon.push_back(subdivision.position(v));
    }
    counts.areas.push_back(polygonArea(polygon));
  }
  std::sort(counts.areas.begin(), counts.areas.end());
  return counts;
}

Counts arranged(const Drawing& drawing) {
  Arrangement arrangement;
  std::vector<Arrangement::X_monotone_curve_2> curves;
  for (const auto& [a, b] : drawing.segments) {
    const Kernel::Point_2 p(drawing.points[a].x, drawing.points[a].y);
    const Kernel::Point_2 q(drawing.points[b].x, drawing.points[b].y);
    if (p != q) {
      curves.emplace_back(p, q);
    }
  }
  CGAL::insert(arrangement, curves.begin(), curves.end());
  Counts counts{arrangement.number_of_vertices(), arrangement.number_of_edges(), arrangement.number_of_faces() - 1, {}};
  for (auto face = arrangement.faces_begin(); face != arrangement.faces_end(); ++face) {
    if (face->is_unbounded()) {
      continue;
    }
    std::vector<Vec2> polygon;
    auto edge = face->outer_ccb();
    const auto first = edge;
    do {
      polygon.emplace_back(CGAL::to_double(edge->target()->point().x()), CGAL::to_double(edge->target()->point().y()));
    } while (++edge != first);
    counts.areas.push_back(polygonArea(polygon));
  }
  std::sort(counts.areas.begin(), counts.areas.end());
  return counts;
}

std::string difference(const Counts& ours, const Counts& oracle, double tolerance = 1e-8) {
  if (ours.vertices != oracle.vertices || ours.edges != oracle.edges || ours.regions != oracle.regions) {
    return fmt::format("{} vertices, {} edges, {} regions instead of {}, {}, {}", ours.vertices, ours.edges,
                       ours.regions, oracle.vertices, oracle.edges, oracle.regions);
  }
  // Areas come from rounded coordinates: what matters is which region is which.
  for (std::size_t r = 0; r < ours.areas.size(); ++r) {
    if (std::fabs(ours.areas[r] - oracle.areas[r]) > tolerance) {
      return fmt::format("a region of area {} instead of {}", ours.areas[r], oracle.areas[r]);
    }
  }
  return "";
}

// Random points and random segments, each from a point already used, so that all are connected.
template <typename MakePoint>
Drawing randomDrawing(std::mt19937_64& random, unsigned points, unsigned segments, const MakePoint& make) {
  Drawing drawing;
  for (unsigned k = 0; k < points; ++k) {
    drawing.points.push_back(make());
  }
  std::vector<unsigned> used{0};
  for (unsigned k = 0; k < segments; ++k) {
    const unsigned from = used[random() % used.size()];
    const unsigned to = static_cast<unsigned>(random() % points);
    if (drawing.points[from] == drawing.points[to]) {
      continue;
    }
    if (random() % 2 == 0) {
      drawing.segments.push_back({from, to});
    } else {
      drawing.segments.push_back({to, from});
    }
    used.push_back(to);
  }
  return drawing;
}

void compareMany(const char* what, std::uint64_t seed, int drawings, unsigned points, unsigned segments,
                 Vec2 (*make)(std::mt19937_64&)) {
  SCOPED_TRACE(testing::Message() << what << ", seed " << seed);
  std::mt19937_64 random(seed);
  PlanarSubdivision subdivision;
  for (int i = 0; i < drawings; ++i) {
    const Drawing drawing = randomDrawing(random, points, segments, [&] { return make(random); });
    ASSERT_EQ(difference(subdivided(drawing, subdivision), arranged(drawing)), "") << "drawing " << i;
  }
}

TEST(PlanarSubdivision, equalsTheArrangementInGeneralPosition) {
  compareMany("uniform points", 1, 150, 10, 18, [](std::mt19937_64& random) {
    std::uniform_real_distribution<double> uniform(0.0, 1000.0);
    const double x = uniform(random);
    return Vec2(x, uniform(random));
  });
}

TEST(PlanarSubdivision, equalsTheArrangementOnAGridOfCoincidences) {
  compareMany("a 4 x 4 grid: overlaps, coincident points, many segments through one crossing", 2, 400, 12, 18,
              [](std::mt19937_64& random) {
                const double x = static_cast<double>(random() % 4);
                return Vec2(x, static_cast<double>(random() % 4));
              });
  compareMany("a 3 x 2 grid", 3, 200, 8, 12, [](std::mt19937_64& random) {
    const double x = static_cast<double>(random() % 3);
    return Vec2(x, static_cast<double>(random() % 2));
  });
  compareMany("an 11 x 11 grid", 4, 150, 16, 24, [](std::mt19937_64& random) {
    const double x = static_cast<double>(random() % 11);
    return Vec2(x, static_cast<double>(random() % 11));
  });
}

TEST(PlanarSubdivision, equalsTheArrangementWhereOnlyExactArithmeticDecides) {
  // Thirds round: points that ought to lie on one line, or to coincide, differ in the last bit or not.
  compareMany("thirds off the origin", 5, 300, 12, 18, [](std::mt19937_64& random) {
    const double x = 1000.0 + static_cast<double>(random() % 4) / 3.0;
    return Vec2(x, 7.0 + static_cast<double>(random() % 4) / 3.0);
  });
  compareMany("all on a line but for the last bits", 6, 200, 10, 14, [](std::mt19937_64& random) {
    const double t = static_cast<double>(random() % 16) / 7.0;
    return Vec2(100.0 + 3.0 * t, 200.0 + t + static_cast<double>(random() % 3) * 0x1p-45);
  });
}

// The edges of a convex polyhedron, seen along a direction; in an order in which each touches one before it.
Drawing projected(const std::vector<Vec3>& corners, const Vec3& x_axis, const Vec3& y_axis) {
  const Source source = tests::oneCell(vtk_cell::polyhedron, corners);
  Drawing drawing;
  for (const Vec3& p : corners) {
    drawing.points.emplace_back(p.x * x_axis.x + p.y * x_axis.y + p.z * x_axis.z,
                                p.x * y_axis.x + p.y * y_axis.y + p.z * y_axis.z);
  }
  std::set<std::array<unsigned, 2>> edges;
  const auto& stream = source.connectivity;
  for (std::size_t at = 1; at < stream.size(); at += stream[at] + 1) {
    for (std::uint32_t k = 0; k < stream[at]; ++k) {
      const unsigned a = stream[at + 1 + k];
      const unsigned b = stream[at + 1 + (k + 1) % stream[at]];
      edges.insert({std::min(a, b), std::max(a, b)});
    }
  }
  std::set<unsigned> used{(*edges.begin())[0]};
  while (!edges.empty()) {
    const auto touching = std::find_if(edges.begin(), edges.end(),
                                       [&](const auto& e) { return used.count(e[0]) + used.count(e[1]) > 0; });
    used.insert({(*touching)[0], (*touching)[1]});
    drawing.segments.push_back(*touching);
    edges.erase(touching);
  }
  return drawing;
}

TEST(PlanarSubdivision, equalsTheArrangementOfRandomPolyhedra) {
  const std::uint64_t seed = 8;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto point = [&] {
    const double x = normal(random);
    const double y = normal(random);
    const Vec3 p(x, y, normal(random));
    return p / std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
  };
  PlanarSubdivision subdivision;
  for (int i = 0; i < 120; ++i) {
    std::vector<Vec3> corners;
    for (int k = 0; k < 4 + i % 17; ++k) {
      corners.push_back(point());
    }
    const Drawing drawing = projected(corners, point(), point());
    ASSERT_EQ(difference(subdivided(drawing, subdivision), arranged(drawing)), "") << "polyhedron " << i;
  }
}

// Along axes, diagonals and every direction between: edge-on faces, vertex behind vertex, edge behind edge. Directions
// are rounded, so that what ought to coincide does in one view and just fails to in the next.
TEST(PlanarSubdivision, equalsTheArrangementOfAlignedPolyhedra) {
  const std::map<std::string, std::vector<Vec3>> bodies{
      {"box", {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}},
      {"wedge", {{-1, -1, -1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}, {-1, 1, 1}, {1, -1, 1}}},
      {"pyramid", {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {0, 0, 1}}},
      {"octahedron", {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}},
      {"tetrahedron", {{-1, -1, -1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}}}};
  PlanarSubdivision subdivision;
  for (const auto& [name, corners] : bodies) {
    for (int code = 0; code < 125; ++code) {
      const Vec3 d(code % 5 - 2, code / 5 % 5 - 2, code / 25 - 2);
      // Two directions across d, once in whole numbers and once of unit length.
      const Vec3 helper = d.x == 0.0 ? Vec3(1, 0, 0) : d.y == 0.0 ? Vec3(0, 1, 0) : Vec3(0, 0, 1);
      const Vec3 x(d.y * helper.z - d.z * helper.y, d.z * helper.x - d.x * helper.z, d.x * helper.y - d.y * helper.x);
      const Vec3 y(d.y * x.z - d.z * x.y, d.z * x.x - d.x * x.z, d.x * x.y - d.y * x.x);
      const auto unit = [](const Vec3& v) { return v / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); };
      if (x == Vec3(0.0)) {
        continue;
      }
      for (const Drawing& drawing : {projected(corners, x, y), projected(corners, unit(x), unit(y))}) {
        ASSERT_EQ(difference(subdivided(drawing, subdivision), arranged(drawing)), "")
            << name << " along " << d.x << " " << d.y << " " << d.z;
      }
    }
  }
}

TEST(PlanarSubdivision, everyOrderOfInsertionGivesTheSame) {
  const std::uint64_t seed = 7;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  // A star: with its middle as the common point every order is connected.
  for (int i = 0; i < 50; ++i) {
    Drawing drawing;
    drawing.points.emplace_back(2.0, 2.0);
    for (unsigned k = 1; k < 9; ++k) {
      const double x = static_cast<double>(random() % 5);
      drawing.points.emplace_back(x, static_cast<double>(random() % 5));
      drawing.segments.push_back({0, k});
    }
    for (unsigned k = 1; k < 8; ++k) {
      drawing.segments.push_back({k, k + 1});
    }
    PlanarSubdivision subdivision;
    const Counts first = subdivided(drawing, subdivision);
    for (int order = 0; order < 5; ++order) {
      std::shuffle(drawing.segments.begin(), drawing.segments.begin() + 8, random);
      std::shuffle(drawing.segments.begin() + 8, drawing.segments.end(), random);
      ASSERT_EQ(difference(subdivided(drawing, subdivision), first), "") << "drawing " << i;
    }
  }
}

TEST(PlanarSubdivision, aCrossingLiesOnBothSegments) {
  PlanarSubdivision subdivision;
  for (const Vec2& p : {Vec2(0, 0), Vec2(4, 2), Vec2(0, 1), Vec2(4, 0)}) {
    subdivision.addPoint(p);
  }
  subdivision.insert(0, 1);
  subdivision.insert(1, 2);
  subdivision.insert(2, 3);
  subdivision.finish();
  ASSERT_EQ(subdivision.vertexCount(), 5U);
  ASSERT_EQ(subdivision.regionCount(), 1U);
  PlanarSubdivision::Index v = 0;
  while (v < 4 && subdivision.vertex(v).point != PlanarSubdivision::none) {
    ++v;
  }
  const auto& crossing = subdivision.vertex(v);
  ASSERT_EQ(crossing.point, PlanarSubdivision::none);
  for (const int which : {0, 1}) {
    const auto [a, b] = subdivision.segment(crossing.segments[static_cast<std::size_t>(which)]);
    const Vec2 ends[4] = {Vec2(0, 0), Vec2(4, 2), Vec2(0, 1), Vec2(4, 0)};
    const Vec2 p = ends[a] + subdivision.parameter(v, which) * (ends[b] - ends[a]);
    EXPECT_NEAR(p.x, 4.0 / 3.0, 1e-15);
    EXPECT_NEAR(p.y, 2.0 / 3.0, 1e-15);
  }
}

TEST(PlanarSubdivision, nothingAndSegmentsWithoutAreaHaveNoRegion) {
  PlanarSubdivision subdivision;
  subdivision.clear();
  subdivision.finish();
  EXPECT_EQ(subdivision.regionCount(), 0U);
  for (const Vec2& p : {Vec2(0, 0), Vec2(1, 1), Vec2(3, 3), Vec2(0, 0)}) {
    subdivision.addPoint(p);
  }
  EXPECT_EQ(subdivision.insert(0, 3), PlanarSubdivision::none) << "coincident points";
  subdivision.insert(0, 2);
  subdivision.insert(1, 3);
  subdivision.insert(1, 2);
  subdivision.finish();
  EXPECT_EQ(subdivision.vertexCount(), 3U);
  EXPECT_EQ(subdivision.edgeCount(), 2U);
  EXPECT_EQ(subdivision.regionCount(), 0U);
}

TEST(PlanarSubdivision, refusesASegmentThatTouchesNothing) {
  PlanarSubdivision subdivision;
  subdivision.clear();
  for (const Vec2& p : {Vec2(0, 0), Vec2(1, 0), Vec2(0, 1), Vec2(1, 1)}) {
    subdivision.addPoint(p);
  }
  subdivision.insert(0, 1);
  EXPECT_THROW(subdivision.insert(2, 3), Error);
}

}  // namespace
}  // namespace spillikin::mesh
