// MPVO and its parts: face signs against the exact predicate, orders against every face, layers, convexity.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <hwy/targets.h>
#include <oneapi/tbb/global_control.h>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/predicates.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/radix_sort.h"
#include "spillikin/sort/sort.h"
#include "spillikin/sort/tetrahedron_states.h"
#include "spillikin/sort/triangle_order.h"
#include "tests/sort_orders.h"
#include "tests/sort_views.h"
#include "tests/support/meshes.h"

namespace spillikin::sort {
namespace {

mesh::Mesh delaunay(std::size_t points, std::uint64_t seed) {
  return mesh::build(tests::delaunayCube(points, seed));
}

TEST(FaceSigns, EqualTheExactPredicate) {
  for (const auto& source : {tests::delaunayCube(300, 7), tests::tetrahedronGrid(4), tests::hexahedronGrid(4),
                             tests::hexahedronGrid(4, 0.3, 5), tests::tetrahedronGrid(4, 0.2, 3)}) {
    const mesh::Mesh mesh = mesh::build(source);
    FaceSigns signs(mesh);
    for (const Viewpoint& v : viewpoints(mesh, 11)) {
      signs(v);
      for (std::size_t f = 0; f < mesh.triangle_count(); ++f) {
        const auto& t = mesh.triangle[f];
        ASSERT_EQ(signs.sign(f), exactSign(mesh, t[0], t[1], t[2], v)) << "triangle " << f;
      }
      for (std::size_t q = 0; q < mesh.quad_count(); ++q) {
        const auto& p = mesh.quad[q];
        const auto face = static_cast<mesh::Id>(mesh.triangle_count() + q);
        const int s = exactSign(mesh, p[0], p[1], p[2], v), t = exactSign(mesh, p[0], p[2], p[3], v);
        ASSERT_EQ(signs.sign(signs.firstHalf(face)), s);
        ASSERT_EQ(signs.sign(signs.secondHalf(face)), t);
        const auto& problems = signs.problems();
        const Vec3 first[3] = {mesh.points[p[0]], mesh.points[p[1]], mesh.points[p[2]]};
        const Vec3 second[3] = {mesh.points[p[0]], mesh.points[p[2]], mesh.points[p[3]]};
        const bool both_seen = seen(first, v, 1e-6) && seen(second, v, 1e-6);
        const bool problem = std::find(problems.begin(), problems.end(), face) != problems.end();
        if (both_seen) {
          ASSERT_EQ(problem, s * t < 0);
        }
        if (s * t >= 0) {
          ASSERT_FALSE(problem);
          ASSERT_EQ(signs.sign(signs.row(face)), s != 0 ? s : t);
        }
      }
    }
  }
}

TEST(FaceSigns, RarelyAskTheExactPredicate) {
  const mesh::Mesh mesh = delaunay(3000, 1);
  FaceSigns signs(mesh);
  signs(Viewpoint(2.9, 1.3, 4.1, 1.0));
  EXPECT_LT(signs.exactCalls(), mesh.face_count() / 500);
  const mesh::Mesh grid = mesh::build(tests::tetrahedronGrid(12));
  FaceSigns grid_signs(grid);
  grid_signs(Viewpoint(0.0, 0.0, 1.0, 0.0));
  EXPECT_EQ(grid_signs.exactCalls(), 0U);
}

// Every interior face has its cells in the right order; every cell comes once; layers hold no two neighbours.
void expectSorted(const mesh::Mesh& mesh, const Viewpoint& v, const Order& order) {
  std::vector<std::size_t> position;
  ASSERT_NO_FATAL_FAILURE(findPositions(mesh, order, position));
  std::vector<std::size_t> layer(order.cells.size());
  for (std::size_t l = 0; l + 1 < order.layer_offset.size(); ++l) {
    for (std::size_t i = order.layer_offset[l]; i < order.layer_offset[l + 1]; ++i)
      layer[i] = l;
  }
  ASSERT_EQ(order.layer_offset.back(), order.cells.size());
  expectFaces(mesh, v, position,
              [&](mesh::Id behind, mesh::Id front) { ASSERT_NE(layer[position[behind]], layer[position[front]]); });
}

// Any bits, on every instruction set that this machine has, and ranges that vectors do not fill.
TEST(TetrahedronStates, CountFacesOneByOne) {
  const mesh::Mesh mesh = delaunay(300, 8);
  const std::size_t cells = mesh.cell_count();
  std::mt19937_64 random(5);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same bits each time
  std::vector<std::uint64_t> bits(mesh.face_count() / 32 + 1);
  for (std::uint64_t& word : bits)
    word = random();
  std::vector<std::uint8_t> expected(cells);
  for (mesh::Id c = 0; c < cells; ++c) {
    for (unsigned k = 0; k < 4; ++k) {
      const mesh::FaceUse use = mesh.cell_face[4 * std::size_t{c} + k];
      const auto bit = [&](unsigned side) {
        const std::size_t at = 2 * std::size_t{use.face()} + side;
        return static_cast<unsigned>(bits[at / 64] >> at % 64 & 1U);
      };
      expected[c] = static_cast<std::uint8_t>(expected[c] + bit(1 - use.side()) + (bit(use.side()) << (4 + k)));
    }
  }
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (const std::size_t first : {std::size_t{0}, std::size_t{5}}) {
      for (const std::size_t last : {cells, cells - 3, first + 7}) {
        std::vector<std::uint8_t> state(cells);
        tetrahedronStates(bits.data(), mesh.cell_face.data(), first, last, state.data());
        for (std::size_t c = 0; c < cells; ++c)
          ASSERT_EQ(state[c], c < first || c >= last ? 0 : expected[c]) << hwy::TargetName(target) << ", cell " << c;
      }
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(Mpvo, OrdersConvexMeshesByEveryFace) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const mesh::Mesh mesh = delaunay(400, seed);
    const auto sorter = makeSorter(Algorithm::mpvo, mesh);
    EXPECT_TRUE(sorter->exact()) << sorter->why();
    Order order;
    for (const Viewpoint& v : viewpoints(mesh, seed)) {
      (*sorter)(v, order);
      EXPECT_TRUE(order.exact);
      EXPECT_TRUE(order.cycles.empty());
      expectSorted(mesh, v, order);
    }
  }
}

TEST(Mpvo, IsTheSameOnAnyNumberOfThreads) {
  const mesh::Mesh mesh = mesh::build(tests::tetrahedronGrid(32, 0.2, 9));
  const auto sorter = makeSorter(Algorithm::mpvo, mesh);
  Order one, many;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    (*sorter)(Viewpoint(3.0, 2.0, 5.0, 1.0), one);
  }
  (*sorter)(Viewpoint(3.0, 2.0, 5.0, 1.0), many);
  EXPECT_EQ(one.cells, many.cells);
  EXPECT_EQ(one.layer_offset, many.layer_offset);
  expectSorted(mesh, Viewpoint(3.0, 2.0, 5.0, 1.0), many);
}

// Pairs of cells, side by side, each of which shares a face: layers so large that they are worked off in parallel.
mesh::Source pairs(std::size_t count, bool hexahedra) {
  mesh::Source source;
  source.name = "pairs";
  source.offsets = {0};
  const auto add = [&](std::uint8_t type, std::initializer_list<std::uint32_t> corners) {
    source.types.push_back(type);
    source.connectivity.insert(source.connectivity.end(), corners);
    source.offsets.push_back(source.connectivity.size());
  };
  const auto columns = static_cast<std::size_t>(std::sqrt(static_cast<double>(count)));
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 at(2.0 * static_cast<double>(k % columns), 2.0 * static_cast<double>(k / columns), 0.0);
    const auto v = static_cast<std::uint32_t>(source.points.size());
    if (hexahedra) {
      for (const double z : {0.0, 1.0, 2.0}) {
        for (const Vec3 corner : {Vec3(0, 0, z), Vec3(1, 0, z), Vec3(1, 1, z), Vec3(0, 1, z)})
          source.points.push_back(at + corner);
      }
      add(mesh::vtk_cell::hexahedron, {v, v + 1, v + 2, v + 3, v + 4, v + 5, v + 6, v + 7});
      add(mesh::vtk_cell::hexahedron, {v + 4, v + 5, v + 6, v + 7, v + 8, v + 9, v + 10, v + 11});
    } else {
      for (const Vec3 corner : {Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1), Vec3(0.3, 0.3, 0), Vec3(0.3, 0.3, 2)})
        source.points.push_back(at + corner);
      add(mesh::vtk_cell::tetra, {v, v + 2, v + 1, v + 3});
      add(mesh::vtk_cell::tetra, {v, v + 1, v + 2, v + 4});
    }
  }
  return source;
}

TEST(Mpvo, LargeLayersAreListedByAscendingId) {
  constexpr std::size_t count = 70000;
  for (const bool hexahedra : {false, true}) {
    const mesh::Mesh mesh = mesh::build(pairs(count, hexahedra));
    ASSERT_EQ(mesh.cell_count(), 2 * count);
    for (const Algorithm algorithm : {Algorithm::mpvo, Algorithm::mpvonc}) {
      const auto sorter = makeSorter(algorithm, mesh);
      Order order, on_one_thread;
      (*sorter)(Viewpoint(0.0, 0.0, 1.0, 0.0), order);
      {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        (*sorter)(Viewpoint(0.0, 0.0, 1.0, 0.0), on_one_thread);
      }
      EXPECT_EQ(order.cells, on_one_thread.cells);
      ASSERT_EQ(order.cells.size(), 2 * count);
      // From above, the lower cell of each pair comes first.
      std::vector<std::size_t> place(2 * count);
      for (std::size_t i = 0; i < order.cells.size(); ++i)
        place[mesh.cell_file_id[order.cells[i]]] = i;
      for (std::size_t k = 0; k < count; ++k)
        ASSERT_LT(place[2 * k], place[2 * k + 1]) << "pair " << k << ", " << name(algorithm);
      if (algorithm != Algorithm::mpvo) continue;
      ASSERT_EQ(order.layer_offset, (std::vector<std::uint32_t>{0, count, 2 * count}));
      for (const std::size_t begin : {std::size_t{0}, count})
        EXPECT_TRUE(std::is_sorted(order.cells.begin() + static_cast<std::ptrdiff_t>(begin),
                                   order.cells.begin() + static_cast<std::ptrdiff_t>(begin + count)));
    }
  }
}

TEST(Mpvo, KnowsConvexMeshesFromOthers) {
  EXPECT_TRUE(makeSorter(Algorithm::mpvo, mesh::build(tests::tetrahedronGrid(3)))->exact());
  EXPECT_TRUE(makeSorter(Algorithm::mpvo, mesh::build(tests::hexahedronGrid(3)))->exact());
  EXPECT_FALSE(makeSorter(Algorithm::mpvo, mesh::build(tests::shell(4)))->exact());
  EXPECT_FALSE(makeSorter(Algorithm::mpvo, mesh::build(tests::interlockedTori(12)))->exact());
}

TEST(RadixSort, KeepsOrderOfAnyNumbers) {
  std::mt19937_64 random(3);
  std::vector<double> numbers(200000);
  std::normal_distribution<double> normal(5.0, 2.0);
  for (double& x : numbers)
    x = random() % 50 == 0 ? std::ldexp(normal(random), static_cast<int>(random() % 60)) : normal(random);
  const Ladder ladder(numbers.size(), [&](std::size_t i) { return numbers[i]; });
  RadixSort radix;
  std::vector<mesh::Id> out;
  radix(
      numbers.size(),
      [&](std::size_t begin, std::size_t end, std::uint32_t* keys) {
        for (std::size_t i = begin; i < end; ++i)
          keys[i - begin] = ladder(numbers[i]);
      },
      out);
  std::vector<std::uint8_t> seen_once(numbers.size(), 0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    ASSERT_EQ(seen_once[out[i]]++, 0);
    if (i == 0) continue;
    ASSERT_TRUE(radix.sortedKey(i - 1) < radix.sortedKey(i) || out[i - 1] < out[i]);  // stable
    if (radix.sortedKey(i - 1) < radix.sortedKey(i)) {
      ASSERT_GE(numbers[out[i - 1]], numbers[out[i]]);
    }
  }
}

TEST(Sorts, AreFoundByName) {
  EXPECT_EQ(algorithm("bsp-xmpvo"), Algorithm::bsp_xmpvo);
  EXPECT_STREQ(name(Algorithm::automatic), "auto");
  EXPECT_THROW(algorithm("quick"), Error);
  EXPECT_THROW(makeSorter(Algorithm::power, mesh::build(tests::hexahedronGrid(2))), Error);
}

TEST(Sorts, SayWhenTheyGoOnOnOneCore) {
  const mesh::Mesh mesh = delaunay(200, 3);
  using enum Algorithm;
  for (const Algorithm algorithm : {mpvo, mpvonc, xmpvo, bsp_xmpvo, convexified, power, centroid, none}) {
    SCOPED_TRACE(name(algorithm));
    const auto sorter = makeSorter(algorithm, mesh);
    int calls = 0;
    const bool will = sorter->whileSerial([&] { ++calls; });
    EXPECT_EQ(will, algorithm != power && algorithm != centroid && algorithm != none);
    Order order;
    for (const Viewpoint& v : {Viewpoint(3.0, 2.0, 5.0, 1.0), Viewpoint(-3.0, 1.0, 0.5, 1.0)}) {
      const int before = calls;
      (*sorter)(v, order);
      EXPECT_EQ(calls > before, will);
    }
    const int before = calls;
    sorter->whileSerial({});
    (*sorter)(Viewpoint(3.0, 2.0, 5.0, 1.0), order);
    EXPECT_EQ(calls, before);
  }
}

TEST(FileOrder, IsTheFilesOrder) {
  const mesh::Mesh mesh = delaunay(200, 5);
  const auto sorter = makeSorter(Algorithm::none, mesh);
  Order order;
  (*sorter)(Viewpoint(0.0, 0.0, 1.0, 0.0), order);
  std::vector<mesh::Id> file;
  for (const mesh::Id c : order.cells)
    file.push_back(mesh.cell_file_id[c]);
  EXPECT_TRUE(std::is_sorted(file.begin(), file.end()));
}

}  // namespace
}  // namespace spillikin::sort
