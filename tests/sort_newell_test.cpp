// Newell's list: its windows leave out no pair, its tests of pairs agree with linear programs, its orders are right
// from viewpoints of every kind, and the pairs it tests stay in proportion to the cells.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <oneapi/tbb/global_control.h>

#include "spillikin/mesh/build.h"
#include "spillikin/sort/newell.h"
#include "spillikin/sort/newell_facets.h"
#include "spillikin/sort/newell_pairs.h"
#include "spillikin/sort/newell_spheres.h"
#include "spillikin/sort/newell_windows.h"
#include "tests/sort_oracle.h"
#include "tests/sort_orders.h"
#include "tests/support/meshes.h"

namespace spillikin::sort {
namespace {

mesh::Source stretched(mesh::Source source, const Vec3& scale, const Vec3& shift = Vec3(0.0)) {
  source.arrays.clear();
  for (Vec3& p : source.points)
    p = scale * p + shift;
  return source;
}

struct Case {
  const char* what;
  mesh::Mesh mesh;
};

// Tetrahedra that touch nothing.
mesh::Source scattered(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const auto point = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  mesh::Source all;
  for (int i = 0; i < 10; ++i) {
    const mesh::Source one = tests::oneCell(
        mesh::vtk_cell::tetra,
        {point(), point() + Vec3(2.0, 0.0, 0.0), point() + Vec3(0.0, 2.0, 0.0), point() + Vec3(0.0, 0.0, 2.0)});
    const mesh::Source placed = stretched(one, Vec3(0.04 + 0.04 * uniform(random)), point());
    all = i == 0 ? placed : tests::join(all, placed);
  }
  return all;
}

// Convex cells: large beside small, flat, long, of several kinds, with vertices at one place and many in one plane.
std::vector<Case> cases(std::uint64_t seed) {
  const mesh::Source cube = tests::delaunayCube(9, seed);
  const mesh::Source wedge =
      tests::oneCell(mesh::vtk_cell::wedge, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  std::vector<Case> all;
  all.push_back({"tetrahedra", mesh::build(cube)});
  all.push_back({"flat and long", mesh::build(stretched(cube, Vec3(1.0, 1e-4, 40.0), Vec3(7.0, 0.1, -3.0)))});
  all.push_back({"hexahedra", mesh::build(tests::hexahedronGrid(2))});
  all.push_back({"large beside small",
                 mesh::build(tests::join(tests::hexahedronGrid(1),
                                         stretched(tests::tetrahedronGrid(1), Vec3(0.01), Vec3(1.0, 0.3, 0.4))))});
  all.push_back(
      {"wedge and tetrahedra", mesh::build(tests::join(wedge, stretched(cube, Vec3(0.5), Vec3(1.1, 0.3, 0.2))))});
  all.push_back({"scattered", mesh::build(scattered(seed))});
  return all;
}

// Viewpoints without those that the oracle's doubles do not hold the differences of, far away, and those that miss the
// plane of a face by rounding: such a face orders nothing, however much of the sky it fills.
std::vector<Viewpoint> plainViews(const mesh::Mesh& mesh, std::uint64_t seed) {
  const CellFacets facets(mesh);
  std::vector<Viewpoint> views = viewpoints(mesh, seed);
  std::erase_if(views, [&](const Viewpoint& v) {
    bool missed = std::abs(v.x) > 1e6;
    for (std::uint32_t f = 0; f < facets.count() && !missed; ++f) {
      const auto& t = facets.corners(f);
      const Triangle corners{mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]};
      missed = exactSign(mesh, t[0], t[1], t[2], v) != 0 && !seen(corners, v, sliver(corners));
    }
    return missed;
  });
  return views;
}

TEST(Newell, TestsOfPairsAgreeWithLinearPrograms) {
  std::size_t hidden = 0, clear = 0, parted = 0;
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const Case& c : cases(seed)) {
      NewellPairs pairs(c.mesh);
      NewellWindows windows(c.mesh);
      NewellSpheres spheres(c.mesh);
      std::vector<std::uint8_t> offered;
      for (const Viewpoint& v : plainViews(c.mesh, seed)) {
        SCOPED_TRACE(testing::Message() << c.what << ", seed " << seed << ", viewpoint " << v.x << ' ' << v.y << ' '
                                        << v.z << ' ' << v.w);
        pairs.begin(v);
        spheres.begin(v);
        windows(v);
        for (mesh::Id a = 0; a < c.mesh.cell_count(); ++a) {
          offered.assign(c.mesh.cell_count(), 0);
          auto search = windows.search(a);
          for (mesh::Id b = windows.next(search); b != mesh::none; b = windows.next(search))
            offered[b] = 1;
          for (mesh::Id b = 0; b < c.mesh.cell_count(); ++b) {
            if (a == b) continue;
            const double by = obscuring(c.mesh, a, b, v);
            const bool hides = by > 1e-7;  // less may be a sliver, which orders nothing
            if (hides) {
              ASSERT_TRUE(pairs.hides(a, b)) << a << " hides " << b << " by " << by;
              ASSERT_TRUE(offered[b] != 0) << a << " hides " << b << " but is not offered it";
              ASSERT_FALSE(spheres.apart(a, b)) << a << " hides " << b << " but their spheres are apart";
            } else if (by <= 0.0) {
              ASSERT_FALSE(pairs.hides(a, b)) << a << " does not hide " << b;
            }
            ++(hides ? hidden : clear);
            parted += spheres.apart(a, b) ? 1 : 0;
          }
        }
      }
    }
  }
  EXPECT_GT(hidden, 1000U);
  EXPECT_GT(clear, 10000U);
  EXPECT_GT(parted, 1000U);
}

TEST(Newell, CertainSidesAreThoseOfThePredicate) {
  constexpr std::uint64_t seed = 5;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const mesh::Mesh mesh = mesh::build(tests::tetrahedronGrid(3, 0.0, seed));  // many points in one plane
  const CellFacets facets(mesh);
  std::size_t certain = 0, open = 0;
  for (std::uint32_t f = 0; f < facets.count(); ++f) {
    const auto& t = facets.corners(f);
    for (int i = 0; i < 40; ++i) {
      // Points of the mesh, some of them a little beside it.
      Vec3 p = mesh.points[random() % mesh.points.size()];
      if (i % 2 == 0) p += std::pow(10.0, -16.0 + 16.0 * std::abs(u(random))) * Vec3(u(random), u(random), u(random));
      const int side = facets.side(f, p - mesh.points[t[0]]);
      ++(side == 0 ? open : certain);
      if (side != 0) {
        ASSERT_EQ(side, mesh::orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], p)) << "seed " << seed;
      }
    }
  }
  EXPECT_GT(certain, 10000U);
  EXPECT_GT(open, 100U);
}

// Folded along a diagonal inwards, a quadrilateral has the planes of the other one.
TEST(Newell, FoldedFacesHaveSupportingPlanes) {
  const mesh::Mesh mesh = mesh::build(tests::hexahedronGrid(3, 0.2, 9));
  const CellFacets facets(mesh);
  std::size_t supporting = 0, others = 0;
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    for (std::uint32_t f = facets.begin(c); f < facets.end(c); ++f) {
      if (!facets.is(f, CellFacets::supports)) continue;
      ++supporting;
      others += facets.is(f, CellFacets::bounds) ? 0U : 1U;
      const auto& t = facets.corners(f);
      for (const mesh::Id v : mesh.vertices(c))
        ASSERT_LE(mesh::orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], mesh.points[v]), 0);
    }
  }
  EXPECT_EQ(supporting, 12 * mesh.cell_count());
  EXPECT_GT(others, mesh.cell_count());
}

// Both cells of every face come in the order that its exact sign demands. A face that is seen no wider than a sliver
// orders nothing: the plane of one through the viewpoint misses it by rounding.
void expectSeenFaces(const mesh::Mesh& mesh, const Viewpoint& v, const Order& order) {
  ASSERT_TRUE(order.cuts.empty());
  std::vector<std::size_t> position;
  ASSERT_NO_FATAL_FAILURE(findPositions(mesh, order, position));
  for (std::size_t f = 0; f < mesh.triangle_count(); ++f) {
    const auto [behind, front] = mesh.triangle_cells[f];
    const auto& t = mesh.triangle[f];
    const int s = exactSign(mesh, t[0], t[1], t[2], v);
    const Triangle corners{mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]};
    if (front == mesh::none || s == 0 || !seen(corners, v, sliver(corners))) continue;
    ASSERT_EQ(position[behind]<position[front], s> 0) << "face " << f;
  }
}

TEST(Newell, EveryFaceIsRightFromEverywhere) {
  for (const std::uint64_t seed : {31U, 32U}) {
    for (const mesh::Source& source : {tests::delaunayCube(300, seed), tests::tetrahedronGrid(4),
                                       stretched(tests::delaunayCube(200, seed), Vec3(1e-3, 1.0, 30.0))}) {
      const mesh::Mesh mesh = mesh::build(source);
      Newell sorter(mesh);
      Order order;
      for (const Viewpoint& v : viewpoints(mesh, seed)) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << mesh.cell_count() << " cells, viewpoint " << v.x
                                        << ' ' << v.y << ' ' << v.z << ' ' << v.w);
        sorter(v, order);
        EXPECT_TRUE(order.exact);
        expectSeenFaces(mesh, v, order);
      }
    }
  }
}

// Direct neighbours and what lies around them: the same number of pairs a cell, however many cells there are.
TEST(Newell, PairsTestedGrowWithTheCells) {
  for (const Viewpoint& v :
       {Viewpoint(0.4, 0.7, 3.0, 1.0), Viewpoint(0.51, 0.48, 0.53, 1.0), Viewpoint(0.3, 0.2, 1.0, 0.0)}) {
    double before = 0.0;
    for (const std::size_t n : {6U, 12U}) {
      const mesh::Mesh mesh = mesh::build(tests::tetrahedronGrid(n, 0.18, 3));
      Newell sorter(mesh);
      Order order;
      sorter(Viewpoint(static_cast<double>(n) * Vec3(v), v.w), order);
      ASSERT_EQ(order.cells.size(), mesh.cell_count());
      const double pairs = static_cast<double>(sorter.pairsTested()) / static_cast<double>(mesh.cell_count());
      EXPECT_LT(pairs, 100.0);
      if (before > 0.0) {
        EXPECT_LT(pairs, 1.5 * before);
      }
      before = pairs;
    }
  }
}

TEST(Newell, OrdersDoNotDependOnThreads) {
  const mesh::Mesh mesh = mesh::build(tests::shell(6));
  Newell sorter(mesh);
  Order one, many;
  for (const Viewpoint& v : viewpoints(mesh, 17)) {
    sorter(v, many);
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    sorter(v, one);
    EXPECT_EQ(one.cells, many.cells);
  }
}

}  // namespace
}  // namespace spillikin::sort
