// Turns: bands of depth that never put the nearer before the farther, the counting sort, and MPVONC built on them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include <oneapi/tbb/global_control.h>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/predicates.h"
#include "spillikin/sort/sort.h"
#include "spillikin/sort/turns.h"
#include "tests/sort_orders.h"
#include "tests/support/meshes.h"

namespace spillikin::sort {
namespace {

// Two triangles through points of one ray, the first point not farther: bands must not tell the opposite.
TEST(DepthBands, NeverPutTheNearerBehind) {
  constexpr std::uint64_t seed = 41;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::size_t told = 0;
  for (int i = 0; i < 20000; ++i) {
    const bool parallel = i % 2 == 0;
    const double scale = std::pow(10.0, 6.0 * u(random) - 3.0);
    const Vec3 eye = scale * Vec3(normal(random), normal(random), normal(random));
    const Vec3 sight = glm::normalize(Vec3(normal(random), normal(random), normal(random)));
    const Viewpoint v = parallel ? Viewpoint(-3.7 * sight, 0.0) : Viewpoint(eye, 1.0);
    const double near = u(random), far = i % 7 == 0 ? near : near + u(random);
    // Any plane through the point, and the point in the middle of a triangle of it.
    const auto around = [&](double depth, double size) {
      const Vec3 p = eye + depth * sight;
      const Vec3 a = size * Vec3(normal(random), normal(random), normal(random));
      const Vec3 b = size * Vec3(normal(random), normal(random), normal(random));
      return Triangle{p + a, p + b, p - a - b};
    };
    const double size = std::pow(10.0, -4.0 * u(random));
    const Triangle a = around(near, size), b = around(far, size);
    Vec3 lower = a[0], upper = a[0];
    for (const Triangle& t : {a, b}) {
      for (const Vec3& p : t) {
        lower = glm::min(lower, p);
        upper = glm::max(upper, p);
      }
    }
    const DepthBands bands(lower, upper, v);
    ASSERT_GE(bands.latest(a), bands.earliest(b)) << "seed " << seed << ", case " << i;
    ASSERT_GE(bands.latest(a), bands.earliest(a));
    told += bands.latest(b) < bands.earliest(a) ? 1U : 0U;
  }
  EXPECT_GT(told, 5000U);  // and they do tell depths apart
}

TEST(TurnSort, IsStable) {
  std::mt19937_64 random(5);
  for (const std::size_t count : {0U, 1U, 1000U, 300000U}) {
    std::vector<Turn> turn(count);
    for (Turn& t : turn)
      t = static_cast<Turn>(random() % 5000);
    std::vector<mesh::Id> cells(count), expected;
    for (std::size_t i = 0; i < count; ++i)
      cells[i] = static_cast<mesh::Id>(i);
    std::shuffle(cells.begin(), cells.end(), random);
    expected = cells;
    std::stable_sort(expected.begin(), expected.end(), [&](mesh::Id a, mesh::Id b) { return turn[a] < turn[b]; });
    TurnSort by_turn;
    by_turn(turn, cells);
    EXPECT_EQ(cells, expected);
  }
}

TEST(Mpvonc, OrdersEveryFaceOfNonconvexMeshes) {
  for (const auto& source : {tests::shell(12), tests::interlockedTori(6)}) {
    const mesh::Mesh mesh = mesh::build(source);
    const auto sorter = makeSorter(Algorithm::mpvonc, mesh);
    Order order;
    for (const Viewpoint& v : {Viewpoint(3.0, 1.0, 2.0, 1.0), Viewpoint(0.1, 0.2, 0.0, 1.0),
                               Viewpoint(0.3, -0.2, 1.0, 0.0), Viewpoint(0.0, 0.0, 1.0, 0.0)}) {
      (*sorter)(v, order);
      EXPECT_FALSE(order.exact);
      EXPECT_TRUE(order.cycles.empty());
      expectEveryFace(mesh, v, order);
    }
  }
}

TEST(Mpvonc, IsTheSameOnAnyNumberOfThreads) {
  const mesh::Mesh mesh = mesh::build(tests::shell(28));
  const auto sorter = makeSorter(Algorithm::mpvonc, mesh);
  Order one, many;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    (*sorter)(Viewpoint(3.0, 2.0, 5.0, 1.0), one);
  }
  (*sorter)(Viewpoint(3.0, 2.0, 5.0, 1.0), many);
  EXPECT_EQ(one.cells, many.cells);
}

// Apart in depth by more than a band, parts are in the right order whatever their ids.
TEST(Mpvonc, OrdersPartsThatDepthTellsApart) {
  mesh::Source source;
  for (int k = 0; k < 5; ++k) {
    mesh::Source part = tests::tetrahedronGrid(2, 0.15, static_cast<std::uint64_t>(k + 1));
    part.arrays.clear();
    for (Vec3& p : part.points)
      p += Vec3(0.3 * k, -0.2 * k, 4.0 * k);
    source = k == 0 ? part : tests::join(source, part);
  }
  const mesh::Mesh mesh = mesh::build(source);
  const auto part = [&](mesh::Id c) { return static_cast<int>((mesh.points[mesh.vertices(c)[0]].z + 1.0) / 4.0); };
  const auto sorter = makeSorter(Algorithm::mpvonc, mesh);
  Order order;
  for (const double side : {1.0, -1.0}) {
    for (const double w : {0.0, 1.0}) {
      (*sorter)(Viewpoint(1.0, 2.0, 60.0 * side, w), order);
      for (std::size_t i = 1; i < order.cells.size(); ++i)
        ASSERT_GE(side * (part(order.cells[i]) - part(order.cells[i - 1])), 0.0);
    }
  }
}

// Problem faces of twisted hexahedra make cycles: every cell is still listed, once.
TEST(Mpvonc, ListsCyclesToo) {
  const mesh::Mesh mesh = mesh::build(tests::hexahedronGrid(6, 0.35, 17));
  const auto sorter = makeSorter(Algorithm::mpvonc, mesh);
  Order order;
  (*sorter)(Viewpoint(2.0, 1.3, 0.7, 1.0), order);
  EXPECT_FALSE(order.cycles.empty());
  std::vector<mesh::Id> cells = order.cells;
  std::sort(cells.begin(), cells.end());
  ASSERT_EQ(cells.size(), mesh.cell_count());
  for (mesh::Id c = 0; c < cells.size(); ++c)
    ASSERT_EQ(cells[c], c);
}

}  // namespace
}  // namespace spillikin::sort
