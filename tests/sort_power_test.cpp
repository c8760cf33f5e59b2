// Power distances: regularity against known triangulations, orders against every face, keys against their bound.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "spillikin/mesh/build.h"
#include "spillikin/sort/key_sort.h"
#include "spillikin/sort/power.h"
#include "spillikin/sort/regularity.h"
#include "spillikin/sort/weights.h"
#include "tests/sort_orders.h"
#include "tests/sort_views.h"
#include "tests/support/meshes.h"

namespace spillikin::sort {
namespace {

// Points of a lattice moved by up to `jitter`, in Delaunay position: nearly cospherical neighbours everywhere, and flat
// tetrahedra along the hull.
mesh::Source nearLattice(std::size_t n, double jitter, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-jitter, jitter);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n * n * n; ++i) {
    const Vec3 p(static_cast<double>(i % n), static_cast<double>(i / n % n), static_cast<double>(i / (n * n)));
    points.push_back(p + Vec3(uniform(random), uniform(random), uniform(random)));
  }
  return tests::delaunay(points);
}

// Two concentric triangles, their rim cut by three diagonals that follow one another around, and an apex above. With
// the inner triangle parallel to the outer one the plane triangulation is of no heights at all (the "mother of all
// examples" of De Loera, Rambau and Santos), nor is it with the inner triangle turned a little along the diagonals;
// turned the other way it is. The same holds of the tetrahedra to the apex. `turn` in radians.
mesh::Source cone(double turn) {
  mesh::Source source;
  source.name = "cone";
  source.points = {{0, 0, 0}, {12, 0, 0}, {0, 12, 0}};
  for (const Vec3& p : {Vec3(-1, -1, 0), Vec3(2, -1, 0), Vec3(-1, 2, 0)}) {
    const double c = std::cos(turn), s = std::sin(turn);
    source.points.emplace_back(4.0 + c * p.x - s * p.y, 4.0 + s * p.x + c * p.y, 0.0);
  }
  source.points.emplace_back(5.0, 4.0, 7.0);
  source.offsets.push_back(0);
  const auto add = [&](std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    for (const std::uint64_t v : {a, b, c, std::uint64_t{6}})
      source.connectivity.push_back(static_cast<decltype(source.connectivity)::value_type>(v));
    source.offsets.push_back(source.connectivity.size());
    source.types.push_back(mesh::vtk_cell::tetra);
  };
  add(3, 4, 5);
  for (std::uint64_t k = 0; k < 3; ++k) {
    const std::uint64_t next = (k + 1) % 3;
    add(k, next, 3 + next);  // the diagonal runs from outer k to inner k + 1
    add(k, 3 + next, 3 + k);
  }
  return source;
}

TEST(Regularity, OfKnownTriangulations) {
  const Regularity delaunay = regularity(mesh::build(tests::delaunayCube(2000, 4)));
  EXPECT_GT(delaunay.regular, 20000U);
  EXPECT_EQ(delaunay.irregular, 0U);
  EXPECT_LT(delaunay.tied, 13U);  // of the cube's eight corners
  EXPECT_TRUE(delaunay.ordered());

  const mesh::Mesh grid = mesh::build(tests::tetrahedronGrid(4));
  const Regularity lattice = regularity(grid);
  EXPECT_EQ(lattice.irregular, 0U);
  EXPECT_GE(lattice.tied, 6U * 64U);  // all within a cube, at least
  EXPECT_FALSE(lattice.ties_are_trees);
  EXPECT_FALSE(lattice.ordered());
  const std::vector<double> level(grid.points.size(), 1.0);
  const Regularity none = regularity(grid, level);
  EXPECT_EQ(none.regular + none.irregular, 0U);

  const Regularity moved = regularity(mesh::build(tests::tetrahedronGrid(6, 0.2, 3)));
  EXPECT_GT(moved.irregular, 100U);
  EXPECT_FALSE(moved.ordered());
}

TEST(Power, IsExactOnDelaunayMeshesFromEverywhere) {
  struct Case {
    const char* what;
    mesh::Source source;
  };
  const Case all[] = {{"random", tests::delaunayCube(2000, 4)},
                      {"lattice, moved by 0.2", nearLattice(8, 0.2, 5)},
                      {"lattice, moved by 1e-6", nearLattice(8, 1e-6, 6)},
                      {"lattice, moved by 1e-12", nearLattice(7, 1e-12, 7)}};
  for (const Case& c : all) {
    SCOPED_TRACE(c.what);
    const mesh::Mesh mesh = mesh::build(c.source);
    PowerSort sorter(mesh);
    ASSERT_TRUE(sorter.exact()) << sorter.why();
    Order order;
    std::size_t repaired = 0;
    for (const Viewpoint& v : viewpoints(mesh, 12)) {
      SCOPED_TRACE(testing::Message() << v.x << ' ' << v.y << ' ' << v.z << ' ' << v.w);
      sorter(v, order);
      EXPECT_TRUE(order.exact);
      expectEveryFace(mesh, v, order);
      repaired += sorter.repairedCells();
    }
    EXPECT_GT(repaired, 0U);  // else nothing of it was tried
  }
}

TEST(Power, SaysWhenItIsNotExact) {
  const mesh::Mesh shell = mesh::build(tests::shell(4)), turned = mesh::build(cone(0.0));
  Order order;
  for (const mesh::Mesh* mesh : {&shell, &turned}) {
    PowerSort sorter(*mesh);
    EXPECT_FALSE(sorter.exact()) << sorter.why();
    sorter(Viewpoint(9.0, 8.0, 7.0, 1.0), order);
    EXPECT_FALSE(order.exact);
    std::sort(order.cells.begin(), order.cells.end());
    for (mesh::Id i = 0; i < order.cells.size(); ++i)
      ASSERT_EQ(order.cells[i], i);
  }
}

TEST(Weights, AreFoundWhereTheyExist) {
  // A grid is the projection of convex heights whatever its vertices are moved by, if by little; all its cubes tie.
  for (const double jitter : {0.0, 0.1, 0.2}) {
    const mesh::Mesh mesh = mesh::build(tests::tetrahedronGrid(3, jitter, 3));
    const Weights weights = findWeights(mesh, true);
    ASSERT_EQ(weights.verdict, Weights::Verdict::exist) << jitter;
    const Regularity found = regularity(mesh, weights.heights);
    EXPECT_GT(found.regular, 0U);
    EXPECT_EQ(found.irregular + found.tied, 0U);
    PowerSort sorter(mesh);
    ASSERT_TRUE(sorter.exact()) << sorter.why();
    Order order;
    for (const Viewpoint& v : viewpoints(mesh, 13)) {
      sorter(v, order);
      EXPECT_TRUE(order.exact);
      expectEveryFace(mesh, v, order);
    }
  }
}

TEST(Weights, AreProvenNotToExist) {
  std::size_t exist = 0;
  for (const double turn : {-0.2, -0.1, 0.0, 0.1, 0.2}) {
    const mesh::Mesh mesh = mesh::build(cone(turn));
    ASSERT_EQ(mesh.cell_count(), 7U);
    const Weights weights = findWeights(mesh, true);
    ASSERT_NE(weights.verdict, Weights::Verdict::undecided) << turn;
    if (weights.verdict == Weights::Verdict::exist) {
      EXPECT_EQ(regularity(mesh, weights.heights).irregular, 0U);
      ++exist;
    } else {
      EXPECT_GE(weights.contradiction.size(), 3U);  // the three diagonals at least
      EXPECT_FALSE(PowerSort(mesh).exact());
    }
    if (turn == 0.0) {
      EXPECT_EQ(weights.verdict, Weights::Verdict::none);
    }
  }
  EXPECT_EQ(exist, 2U);
}

TEST(Power, IsTheSameOnAnyNumberOfThreads) {
  const mesh::Mesh mesh = mesh::build(tests::delaunayCube(20000, 9));
  PowerSort sorter(mesh);
  Order one, many;
  const Viewpoint v(0.4, 0.3, 0.6, 1.0);
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    sorter(v, one);
  }
  sorter(v, many);
  EXPECT_EQ(one.cells, many.cells);
  expectEveryFace(mesh, v, many);
}

TEST(Power, IsExactWithEveryInstructionSet) {
  const mesh::Mesh mesh = mesh::build(tests::delaunayCube(3000, 14));
  PowerSort sorter(mesh);
  Order order;
  const std::int64_t all = hwy::SupportedTargets();
  for (std::int64_t left = all; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().DeInit();  // to be chosen again
    for (const Viewpoint& v : viewpoints(mesh, 15)) {
      sorter(v, order);
      EXPECT_TRUE(order.exact);
      expectEveryFace(mesh, v, order);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

TEST(Power, IsTakenForDelaunayMeshes) {
  const auto taken = [](const mesh::Source& source) {
    const mesh::Mesh mesh = mesh::build(source);
    return makeSorter(Algorithm::automatic, mesh)->algorithm();
  };
  EXPECT_EQ(taken(tests::delaunayCube(1000, 2)), Algorithm::power);
  EXPECT_EQ(taken(tests::tetrahedronGrid(8, 0.2, 3)), Algorithm::mpvo);
  EXPECT_EQ(taken(tests::shell(4)), Algorithm::xmpvo);
}

TEST(KeySort, IsStableWhateverTheKeys) {
  std::mt19937_64 random(31);
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{100000}, std::size_t{2200000}}) {
    const unsigned bits = KeySort::keyBits(count);
    std::vector<std::uint32_t> keys(count);
    // Even, bunched, and a bucket that holds a third of all.
    for (std::size_t i = 0; i < count; ++i) {
      const auto any = static_cast<std::uint32_t>(random()) >> (32 - bits);
      keys[i] = i % 3 == 0 ? any : i % 3 == 1 ? (any & ~7U) : (1U << (bits - 2)) + (any & 1023U);
    }
    KeySort sort;
    std::vector<mesh::Id> out, wanted(count);
    sort(
        count, [](std::size_t, std::size_t) {}, keys.data(), out);
    std::iota(wanted.begin(), wanted.end(), 0U);
    std::stable_sort(wanted.begin(), wanted.end(), [&](mesh::Id a, mesh::Id b) { return keys[a] < keys[b]; });
    ASSERT_EQ(out, wanted) << count;
    for (std::size_t i = 0; i < count; i += 97) {
      ASSERT_LE(sort.bucketBegin(keys[out[i]] >> KeySort::low_bits), i);
      ASSERT_GT(sort.bucketBegin((keys[out[i]] >> KeySort::low_bits) + 1), i);
    }
  }
}

TEST(LiftedKey, AscendsOverAllFloats) {
  for (const unsigned bits : {20U, 22U}) {
    KeyQuery query;
    query.bits = bits;
    query.middle = 0.25F;
    query.scale = 3.0F;
    std::vector<float> numbers{0.25F};
    for (int e = -40; e < 60; ++e) {
      for (int k = 0; k < 64; ++k) {
        const float x = std::ldexp(1.0F + static_cast<float>(k) / 64.0F, e);
        numbers.push_back(x);
        numbers.push_back(-x);
      }
    }
    std::sort(numbers.begin(), numbers.end());
    for (std::size_t i = 1; i < numbers.size(); ++i) {
      const std::uint32_t below = liftedKey(numbers[i - 1], query), key = liftedKey(numbers[i], query);
      ASSERT_LE(below, key) << numbers[i];
      ASSERT_LT(key, 1U << bits);
      // No more keys than the even spacing has, but for roundings.
      const double steps = (static_cast<double>(numbers[i]) - static_cast<double>(numbers[i - 1])) * 3.0 * query.even();
      ASSERT_LE(key - below, std::min(steps, 1e9) + 2.0) << numbers[i];
    }
  }
}

}  // namespace
}  // namespace spillikin::sort
