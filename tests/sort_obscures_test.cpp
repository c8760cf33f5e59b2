// Orders against an oracle that shares nothing with them: whether one cell hides another is a linear program over the
// corners of both, solved in exact arithmetic for all pairs; and against rays through every cell.
#include <gtest/gtest.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include <oneapi/tbb/global_control.h>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/sort/bsp_xmpvo.h"
#include "spillikin/sort/checker.h"
#include "spillikin/sort/cycle_cutter.h"
#include "spillikin/sort/gap_sorter.h"
#include "spillikin/sort/gap_turns.h"
#include "spillikin/sort/merged_filling.h"
#include "spillikin/sort/sort.h"
#include "spillikin/sort/xmpvo.h"
#include "tests/sort_oracle.h"
#include "tests/sort_views.h"
#include "tests/support/meshes.h"

namespace spillikin::sort {
namespace {

// --- Meshes.

mesh::Source keepCells(const mesh::Source& source, const std::function<bool(std::size_t)>& keep) {
  mesh::Source out;
  out.name = "part";
  out.points = source.points;
  out.offsets.push_back(0);
  for (std::size_t c = 0; c < source.types.size(); ++c) {
    if (!keep(c)) continue;
    out.types.push_back(source.types[c]);
    for (auto k = source.offsets[c]; k < source.offsets[c + 1]; ++k)
      out.connectivity.push_back(source.connectivity[k]);
    out.offsets.push_back(out.connectivity.size());
  }
  return out;
}

mesh::Source moved(mesh::Source source, double scale, const Vec3& shift) {
  source.arrays.clear();
  for (Vec3& p : source.points)
    p = scale * p + shift;
  return source;
}

// Concave, hollow, in several parts: cells of a Delaunay mesh taken away by chance.
mesh::Source pierced(std::size_t points, std::uint64_t seed) {
  const mesh::Source whole = tests::delaunayCube(points, seed);
  std::mt19937_64 random(seed);
  return keepCells(whole, [&](std::size_t) { return random() % 2 == 0; });
}

// A cell with hundreds of small ones beside it, touching but sharing no points.
mesh::Source hugeBesideSmall() {
  const mesh::Source small = moved(tests::tetrahedronGrid(2, 0.2, 4), 0.125, Vec3(1.0, 0.3, 0.4));
  return tests::join(moved(tests::hexahedronGrid(1), 1.0, Vec3(0.0)), small);
}

// Blocks of different resolution, face to face.
mesh::Source touching() {
  return tests::join(tests::hexahedronGrid(2), moved(tests::hexahedronGrid(3), 2.0 / 3.0, Vec3(2.0, 0.1, 0.0)));
}

// A block inside the hollow of another.
mesh::Source nested() {
  const mesh::Source grid = tests::hexahedronGrid(3);
  const mesh::Source ring = keepCells(grid, [](std::size_t c) { return c != 13; });
  return tests::join(ring, moved(tests::tetrahedronGrid(1), 0.4, Vec3(1.3, 1.31, 1.32)));
}

std::vector<Viewpoint> someViews(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  return {{0.5 + 4.0 * u(random), 0.5 + 4.0 * u(random), 3.0, 1.0},
          {0.5 + 0.4 * u(random), 0.5 + 0.4 * u(random), 0.5 + 0.4 * u(random), 1.0},
          {u(random), u(random), u(random), 0.0},
          {0.0, 0.0, 1.0, 0.0},
          {0.5, 0.5, 4.0, 1.0}};
}

struct Case {
  const char* what;
  mesh::Source source;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const std::uint64_t seed : {11U, 12U, 13U})
    all.push_back({"pierced", pierced(18, seed)});
  all.push_back({"huge beside small", hugeBesideSmall()});
  all.push_back({"touching", touching()});
  all.push_back({"nested", nested()});
  return all;
}

TEST(Obscures, OracleKnowsTwoBoxes) {
  const mesh::Mesh mesh = mesh::build(tests::join(moved(tests::hexahedronGrid(1), 1.0, Vec3(0.0)),
                                                  moved(tests::hexahedronGrid(1), 1.0, Vec3(0.5, 0.0, 2.0))));
  ASSERT_EQ(mesh.cell_count(), 2U);
  const mesh::Id high = mesh.points[mesh.vertices(0)[0]].z >= 2.0 ? 0 : 1;
  EXPECT_TRUE(obscures(mesh, high, 1 - high, {0.5, 0.5, 9.0, 1.0}));
  EXPECT_FALSE(obscures(mesh, 1 - high, high, {0.5, 0.5, 9.0, 1.0}));
  EXPECT_TRUE(obscures(mesh, 1 - high, high, {0.0, 0.0, -1.0, 0.0}));
  EXPECT_FALSE(obscures(mesh, high, 1 - high, {0.0, 0.0, -1.0, 0.0}));
  EXPECT_FALSE(obscures(mesh, high, 1 - high, {1.0, 0.0, 0.0, 0.0}));
}

TEST(Obscures, NoPairIsInvertedByAnExactSort) {
  for (const Case& c : cases()) {
    const mesh::Mesh mesh = mesh::build(c.source);
    for (const Algorithm a : {Algorithm::xmpvo, Algorithm::bsp_xmpvo, Algorithm::newell, Algorithm::automatic}) {
      const auto sorter = makeSorter(a, mesh);
      ASSERT_TRUE(sorter->exact()) << sorter->why();
      Order order;
      for (const Viewpoint& v : someViews(77)) {
        SCOPED_TRACE(testing::Message() << c.what << ", " << name(a) << ", viewpoint " << v.x << ' ' << v.y << ' '
                                        << v.z << ' ' << v.w);
        (*sorter)(v, order);
        EXPECT_TRUE(order.exact);
        expectAllPairs(mesh, v, order);
      }
    }
  }
}

// A guess that tells nothing leaves all to the searches: every cell has the same turn at first.
TEST(Obscures, TurnsAreMadeRightFromAnyGuess) {
  std::size_t put_off = 0, settled = 0;
  for (const Case& c : cases()) {
    const mesh::Mesh mesh = mesh::build(c.source);
    FaceSigns signs(mesh);
    LayeredSort layered(mesh);
    GapEdges gaps(mesh, signs);
    const ProblemFaces problems(mesh, signs);
    const PartedCells parted(mesh, signs, problems);
    GapTurns turns(mesh, gaps, parted);
    TurnSort by_turn;
    Order order;
    const std::vector<Viewpoint> views = someViews(99);
    for (const Viewpoint& v : {views[0], views[2]}) {
      SCOPED_TRACE(testing::Message() << c.what << ", viewpoint " << v.x << ' ' << v.y << ' ' << v.z << ' ' << v.w);
      signs(v);
      gaps.windows().look(v);
      turns.readSigns();
      turns.begin([](std::uint32_t, int) { return Turn{7}; });
      ASSERT_TRUE(layered(signs, order, nullptr, turns.data()));
      if (!turns.settle(v, layered, {}, {})) continue;  // long chains of put off cells
      ++settled;
      put_off += turns.putOff();
      by_turn(turns.turns(), order.cells);
      expectAllPairs(mesh, v, order);
    }
  }
  EXPECT_GT(put_off, 50U);
  EXPECT_GT(settled, 9U);
}

// What is decided once per geometry holds from everywhere.
TEST(Obscures, TrianglesThatFaceNoneAreRelatedToNone) {
  std::size_t alone = 0, related = 0;
  for (const Case& c : cases()) {
    const mesh::Mesh mesh = mesh::build(c.source);
    FaceSigns signs(mesh);
    GapEdges gaps(mesh, signs, Exterior::all);
    const auto count = static_cast<std::uint32_t>(gaps.tree().triangles().size());
    std::vector<bool> faces(count);
    for (std::uint32_t t = 0; t < count; ++t)
      faces[t] = gaps.facesAny(t);
    alone += static_cast<std::size_t>(std::count(faces.begin(), faces.end(), false));
    for (const Viewpoint& v : someViews(55)) {
      SCOPED_TRACE(testing::Message() << c.what << ", viewpoint " << v.x << ' ' << v.y << ' ' << v.z << ' ' << v.w);
      signs(v);
      for (std::uint32_t exit = 0; exit < count; ++exit) {
        for (std::uint32_t entry = 0; entry < count && gaps.sign(exit) < 0; ++entry) {
          if (gaps.sign(entry) <= 0 || gaps.tree().triangles()[exit].cell == gaps.tree().triangles()[entry].cell)
            continue;
          if (!gaps.related(exit, entry, v)) continue;
          ++related;
          ASSERT_TRUE(faces[exit] && faces[entry]) << exit << ' ' << entry;
        }
      }
    }
  }
  EXPECT_GT(alone, 20U);
  EXPECT_GT(related, 100U);
}

// A view of every kind, on vertices and in planes of faces too.
std::vector<Viewpoint> allViews(const mesh::Mesh& mesh, std::uint64_t seed) {
  std::vector<Viewpoint> views = viewpoints(mesh, seed);
  const auto some = someViews(seed);
  views.insert(views.end(), some.begin(), some.end());
  views.emplace_back(1e-200, 2e-200, -1e-200, 0.0);
  views.emplace_back(1e200, 0.0, 0.0, 1.0);
  return views;
}

// Every pair of triangles that is related is found by the windows, with every instruction set, whatever their turns.
TEST(ExteriorWindows, LeaveOutNoPairThatIsRelated) {
  constexpr std::uint64_t seed = 57;
  std::vector<Case> all = cases();
  all.push_back({"far from the origin", moved(touching(), 1e-3, Vec3(1e4, -2e4, 3e4))});
  all.push_back({"large", moved(pierced(18, seed), 1e120, Vec3(0.0))});
  std::size_t related = 0, found = 0;
  for (const Case& c : all) {
    const mesh::Mesh mesh = mesh::build(c.source);
    FaceSigns signs(mesh);
    GapEdges gaps(mesh, signs);
    const auto count = static_cast<std::uint32_t>(gaps.tree().triangles().size());
    const auto cell = [&](std::uint32_t t) { return gaps.tree().triangles()[t].cell; };
    for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
      hwy::SetSupportedTargetsForTest(left & -left);
      hwy::GetChosenTarget().DeInit();  // to be chosen again
      for (const Viewpoint& v : allViews(mesh, seed)) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << c.what << ", viewpoint " << v.x << ' ' << v.y
                                        << ' ' << v.z << ' ' << v.w);
        signs(v);
        ExteriorWindows& windows = gaps.windows();
        windows.look(v);
        windows.setTurns([&](std::uint32_t t) { return gaps.sign(t) < 0 ? Turn{5} : ExteriorWindows::never; },
                         [](std::uint32_t) { return Turn{5}; });
        std::vector<WindowQuery> queries;
        for (std::uint32_t t = 0; t < count; ++t) {
          if (gaps.sign(t) > 0) queries.push_back({t, 5, 5});
        }
        std::vector<WindowPair> pairs;
        windows.meeting(queries, pairs);
        found += pairs.size();
        std::vector<std::uint8_t> is_found(std::size_t{count} * count);
        for (const auto& [exit, entry] : pairs) {
          ASSERT_LT(gaps.sign(exit), 0);
          is_found[std::size_t{entry} * count + exit] = 1;
        }
        for (const WindowQuery& query : queries) {
          for (std::uint32_t exit = 0; exit < count; ++exit) {
            if (gaps.sign(exit) >= 0 || cell(exit) == cell(query.triangle)) continue;
            if (!gaps.related(exit, query.triangle, v)) continue;
            ++related;
            ASSERT_EQ(is_found[std::size_t{query.triangle} * count + exit], 1) << exit << " before " << query.triangle;
            ASSERT_GE(windows.greatest(exit), windows.least(query.triangle)) << exit << " before " << query.triangle;
          }
        }
        for (auto& query : queries)
          query.last = 4;
        pairs.clear();
        windows.meeting(queries, pairs);
        ASSERT_TRUE(pairs.empty()) << "too late";
      }
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
  }
  EXPECT_GT(related, 1000U);
  EXPECT_LT(found, 20 * related);
}

TEST(Obscures, ConvexifiedIsExactWhereItFills) {
  for (const std::uint64_t seed : {21U, 22U, 23U}) {
    const mesh::Mesh mesh = mesh::build(pierced(18, seed));
    std::unique_ptr<Sorter> sorter;
    try {
      sorter = makeSorter(Algorithm::convexified, mesh);
    } catch (const Error& e) {  // a boundary that touches itself may be beyond TetGen, but nothing else may
      EXPECT_NE(std::string(e.what()).find("cannot be filled"), std::string::npos);
      continue;
    }
    Order order;
    for (const Viewpoint& v : someViews(seed)) {
      (*sorter)(v, order);
      expectAllPairs(mesh, v, order);
    }
  }
  const mesh::Mesh shell = mesh::build(tests::shell(3));
  if (shell.tetrahedral()) {
    EXPECT_TRUE(makeSorter(Algorithm::convexified, shell)->exact());
  }
}

mesh::Source shifted(mesh::Source source, const Vec3& shift) {
  for (Vec3& p : source.points)
    p += shift;
  return source;
}

// Turned over in y, so that diagonals cross those of what lies beside it.
mesh::Source mirrored(mesh::Source source, double size) {
  for (Vec3& p : source.points)
    p.y = size - p.y;
  return source;
}

TEST(Xmpvo, IsTheSameOnAnyNumberOfThreads) {
  for (const auto& source : {tests::shell(20), tests::interlockedTori(8), tests::twistedRing(30, 0.5)}) {
    const mesh::Mesh mesh = mesh::build(source);
    for (const Algorithm a : {Algorithm::xmpvo, Algorithm::bsp_xmpvo}) {
      std::vector<Order> one(3), many(3);
      const std::vector<Viewpoint> views = someViews(83);
      const auto sortAll = [&](std::vector<Order>& orders) {
        const auto sorter = makeSorter(a, mesh);
        for (std::size_t k = 0; k < orders.size(); ++k)
          (*sorter)(views[k], orders[k]);
      };
      {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        sortAll(one);
      }
      sortAll(many);
      for (std::size_t k = 0; k < one.size(); ++k)
        EXPECT_EQ(one[k].cells, many[k].cells) << name(a) << ", view " << k;
    }
  }
}

// Cells of the upper part of a mesh as if they filled the outside of the rest.
TEST(MergedFilling, IsOfConvexCellsThatFillTheSame) {
  constexpr std::uint64_t seed = 71;
  for (const auto& source : {tests::delaunayCube(60, seed), tests::tetrahedronGrid(3, 0.0, seed)}) {
    const mesh::Mesh whole = mesh::build(source);
    const std::size_t first = whole.cell_count() / 4;
    const auto merged = mergeFilling(whole, first);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << whole.cell_count() << " cells");
    EXPECT_LT(merged->cell_count(), whole.cell_count());
    EXPECT_LT(merged->face_count(), whole.face_count());
    mesh::Surface surface;
    const auto volumeOf = [&](const mesh::Mesh& mesh, mesh::Id c) {
      mesh::surface(mesh, c, surface);
      double volume = 0.0;
      for (const auto& t : surface.triangles)
        volume += glm::dot(mesh.points[t[0]], glm::cross(mesh.points[t[1]], mesh.points[t[2]])) / 6.0;
      return volume;
    };
    double volume = 0.0, volume_before = 0.0;
    for (mesh::Id c = 0; c < whole.cell_count(); ++c)
      volume_before += volumeOf(whole, c);
    for (mesh::Id c = 0; c < merged->cell_count(); ++c) {
      volume += volumeOf(*merged, c);
      for (const auto& t : surface.triangles) {
        for (const mesh::Id v : merged->vertices(c)) {
          ASSERT_LE(mesh::orient3d(merged->points[t[0]], merged->points[t[1]], merged->points[t[2]], merged->points[v]),
                    0)
              << "cell " << c;
        }
      }
    }
    EXPECT_NEAR(volume, volume_before, 1e-12 * volume_before);
    EXPECT_EQ(exteriorTriangles(*merged).size(), exteriorTriangles(whole).size());
    for (mesh::Id c = 0; c < first; ++c) {
      EXPECT_TRUE(std::ranges::equal(merged->vertices(c), whole.vertices(c)));
      EXPECT_EQ(merged->faces(c).size(), 4U);
    }
  }
}

TEST(Obscures, ConvexifiedHoldsBoundariesThatTouch) {
  const mesh::Source hexahedra = tests::hexahedronGrid(1), tetrahedra = tests::tetrahedronGrid(1);
  const Vec3 beside(1.0, 0.0, 0.0);
  // The same faces, but each block with points and values of its own: they stay two vertices at one place.
  mesh::Source left = tetrahedra, right = shifted(tetrahedra, beside);
  tests::addPointArray(left, "side", [](const Vec3&) { return 0.0; });
  tests::addPointArray(right, "side", [](const Vec3&) { return 1.0; });
  std::vector<Case> all{
      {"L of hexahedra", keepCells(tests::hexahedronGrid(2), [](std::size_t c) { return c != 0 && c != 3; })},
      {"hollow hexahedra", keepCells(tests::hexahedronGrid(3), [](std::size_t c) { return c != 13; })},
      {"along an edge", tests::join(tests::hexahedronGrid(1), shifted(tests::hexahedronGrid(1), Vec3(1.0, 1.0, 0.0)))},
      {"at a vertex", tests::join(tests::hexahedronGrid(1), shifted(tests::hexahedronGrid(1), Vec3(1.0, 1.0, 1.0)))},
      {"blocks of their own points", tests::join(left, right)},
      {"crossed diagonals", tests::join(tetrahedra, shifted(mirrored(tetrahedra, 1.0), beside))},
      {"hexahedra beside tetrahedra", tests::join(hexahedra, shifted(tetrahedra, beside))},
      {"the same, crossed", tests::join(hexahedra, shifted(mirrored(tetrahedra, 1.0), beside))},
  };
  const mesh::Source wedge =
      tests::oneCell(mesh::vtk_cell::wedge, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  const mesh::Source pyramid =
      tests::oneCell(mesh::vtk_cell::pyramid, {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0.5, -1, 0.5}});
  all.push_back(
      {"wedge, pyramid and one apart", tests::join(tests::join(wedge, pyramid), shifted(wedge, Vec3(2.0, 0.3, 0.1)))});
  for (const Case& c : all) {
    SCOPED_TRACE(c.what);
    const mesh::Mesh mesh = mesh::build(c.source);
    const auto sorter = makeSorter(Algorithm::convexified, mesh);
    EXPECT_TRUE(sorter->exact());
    Order order;
    for (const Viewpoint& v : someViews(91)) {
      SCOPED_TRACE(testing::Message() << v.x << ' ' << v.y << ' ' << v.z << ' ' << v.w);
      (*sorter)(v, order);
      EXPECT_TRUE(order.exact);
      expectAllPairs(mesh, v, order);
    }
  }
}

// Where only diagonals are crossed nothing has to be filled, and auto knows it; where more is open it does not ask
// TetGen.
TEST(Obscures, AutoMatchesCrossedDiagonals) {
  const mesh::Source beside = shifted(mirrored(tests::tetrahedronGrid(1), 1.0), Vec3(1.0, 0.0, 0.0));
  const mesh::Mesh matched = mesh::build(tests::join(tests::hexahedronGrid(1), beside));
  const auto sorter = makeSorter(Algorithm::automatic, matched);
  ASSERT_EQ(sorter->algorithm(), Algorithm::convexified);
  EXPECT_NE(sorter->why().find("crossed diagonals"), std::string::npos) << sorter->why();
  Order order;
  for (const Viewpoint& v : someViews(92)) {
    SCOPED_TRACE(testing::Message() << v.x << ' ' << v.y << ' ' << v.z << ' ' << v.w);
    (*sorter)(v, order);
    EXPECT_TRUE(order.exact);
    expectAllPairs(matched, v, order);
  }
  const mesh::Mesh apart = mesh::build(tests::join(tests::hexahedronGrid(1), shifted(beside, Vec3(0.5, 0.0, 0.0))));
  EXPECT_EQ(makeSorter(Algorithm::automatic, apart)->algorithm(), Algorithm::xmpvo);
}

// To sorts by gaps too a face with crossed diagonals is one like others: on a convex mesh there is nothing to search.
TEST(Obscures, GapSortsMatchCrossedDiagonals) {
  const mesh::Source hexahedra = tests::hexahedronGrid(1), tetrahedra = tests::tetrahedronGrid(1);
  for (const mesh::Source& other : {tetrahedra, mirrored(tetrahedra, 1.0)}) {
    const mesh::Mesh mesh = mesh::build(tests::join(hexahedra, shifted(other, Vec3(1.0, 0.0, 0.0))));
    Xmpvo xmpvo(mesh);
    BspXmpvo bsp(mesh);
    for (GapSorter* sorter : {static_cast<GapSorter*>(&xmpvo), static_cast<GapSorter*>(&bsp)}) {
      EXPECT_TRUE(sorter->exact());
      Order order;
      for (const Viewpoint& v : someViews(93)) {
        SCOPED_TRACE(testing::Message() << v.x << ' ' << v.y << ' ' << v.z << ' ' << v.w);
        (*sorter)(v, order);
        EXPECT_TRUE(order.exact);
        EXPECT_EQ(sorter->turns().searched(), 0U);
        expectAllPairs(mesh, v, order);
      }
    }
  }
}

TEST(Obscures, ConvexifiedRefusesAnExteriorThatCrossesItself) {
  const mesh::Mesh mesh =
      mesh::build(tests::join(tests::hexahedronGrid(1), shifted(tests::hexahedronGrid(1), Vec3(0.5, 0.4, 0.3))));
  EXPECT_THROW(makeSorter(Algorithm::convexified, mesh), Error);
  EXPECT_EQ(makeSorter(Algorithm::automatic, mesh)->algorithm(), Algorithm::xmpvo);
}

TEST(Obscures, ApproximateSortsListEveryCellOnce) {
  const mesh::Mesh mesh = mesh::build(pierced(60, 5));
  for (const Algorithm a :
       {Algorithm::mpvonc, Algorithm::mpvo, Algorithm::centroid, Algorithm::power, Algorithm::none}) {
    const auto sorter = makeSorter(a, mesh);
    EXPECT_FALSE(sorter->exact());
    Order order;
    (*sorter)({3.0, 2.0, 5.0, 1.0}, order);
    std::vector<mesh::Id> cells = order.cells;
    std::sort(cells.begin(), cells.end());
    ASSERT_EQ(cells.size(), mesh.cell_count()) << name(a);
    for (mesh::Id c = 0; c < cells.size(); ++c)
      ASSERT_EQ(cells[c], c);
    EXPECT_FALSE(order.exact);
  }
}

// --- Rays, for orders with cuts.

// Appends the intervals of a ray in a cell, convex or not: where it crosses the triangles of the cell's boundary.
void intersect(const mesh::Mesh& mesh, mesh::Id cell, const Vec3& origin, const Vec3& direction,
               std::vector<Crossing>& out) {
  mesh::Surface surface;
  mesh::surface(mesh, cell, surface);
  std::vector<double> at;
  for (const auto& t : surface.triangles) {
    const Vec3 a = mesh.points[t[0]] - origin, b = mesh.points[t[1]] - origin, c = mesh.points[t[2]] - origin;
    const double u = glm::dot(direction, glm::cross(b, c)), v = glm::dot(direction, glm::cross(c, a)),
                 w = glm::dot(direction, glm::cross(a, b));
    if ((u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0))
      at.push_back(glm::dot((u * a + v * b + w * c) / (u + v + w), direction));
  }
  std::sort(at.begin(), at.end());
  for (std::size_t i = 0; i + 1 < at.size(); i += 2) {
    if (at[i + 1] > 0.0) out.push_back({cell, std::max(0.0, at[i]), at[i + 1]});
  }
}

Tally shootRays(const mesh::Mesh& mesh, const Order& order, const Viewpoint& v, std::uint64_t seed, int rays = 20000) {
  const OrderChecker checker(order, mesh.cell_count());
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  Vec3 lower = mesh.points.front(), upper = lower;
  for (const Vec3& p : mesh.points) {
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], p[k]);
      upper[k] = std::max(upper[k], p[k]);
    }
  }
  Tally tally;
  for (int i = 0; i < rays; ++i) {
    const Vec3 target = lower + (upper - lower) * Vec3(u(random), u(random), u(random));
    Vec3 direction = v.w == 0.0 ? -Vec3(v) : target - Vec3(v);
    direction /= std::sqrt(direction.x * direction.x + direction.y * direction.y + direction.z * direction.z);
    const Vec3 origin = v.w == 0.0 ? target - 100.0 * direction : Vec3(v);
    std::vector<Crossing> crossings;
    for (mesh::Id c = 0; c < mesh.cell_count(); ++c)
      intersect(mesh, c, origin, direction, crossings);
    checker.add(i, 0, origin, direction, crossings, tally);
  }
  return tally;
}

mesh::Source box(const Vec3& lower, const Vec3& upper) {
  const Vec3 &a = lower, &b = upper;
  return tests::oneCell(mesh::vtk_cell::hexahedron, {{a.x, a.y, a.z},
                                                     {b.x, a.y, a.z},
                                                     {b.x, b.y, a.z},
                                                     {a.x, b.y, a.z},
                                                     {a.x, a.y, b.z},
                                                     {b.x, a.y, b.z},
                                                     {b.x, b.y, b.z},
                                                     {a.x, b.y, b.z}});
}

// A stick along the axis a to b, of square section, leaning so that its ends lie at different heights.
mesh::Source stick(const Vec3& a, const Vec3& b, double thick) {
  const Vec3 d = b - a, side = Vec3(-d.y, d.x, 0.0) * (thick / std::sqrt(d.x * d.x + d.y * d.y)), up(0.0, 0.0, thick);
  return tests::oneCell(mesh::vtk_cell::hexahedron, {a - side - up, b - side - up, b + side - up, a + side - up,
                                                     a - side + up, b - side + up, b + side + up, a + side + up});
}

// k sticks, each with one end above the next and the other below the one before: a cycle for viewers on the axis.
mesh::Source pinwheel(int k) {
  mesh::Source all;
  for (int i = 0; i < k; ++i) {
    const double at = 2.0 * M_PI * i / k, next = at + 2.0 * M_PI / k;
    const Vec3 p(std::cos(at), std::sin(at), 0.0), q(std::cos(next), std::sin(next), 0.0), d = q - p;
    const mesh::Source s = stick(p - 0.4 * d + Vec3(0.0, 0.0, -0.3), q + 0.4 * d + Vec3(0.0, 0.0, 0.3), 0.05);
    all = i == 0 ? s : tests::join(all, s);
  }
  return all;
}

TEST(Cycles, PinwheelsAreNamedAndCut) {
  for (const int k : {3, 4, 5, 7}) {
    const mesh::Mesh mesh = mesh::build(pinwheel(k));
    ASSERT_EQ(mesh.cell_count(), static_cast<std::size_t>(k));
    for (const Algorithm a : {Algorithm::xmpvo, Algorithm::bsp_xmpvo, Algorithm::newell, Algorithm::automatic}) {
      const auto sorter = makeSorter(a, mesh);
      for (const Viewpoint& v :
           {Viewpoint(0.01, 0.02, 6.0, 1.0), Viewpoint(0.0, 0.0, -5.0, 1.0), Viewpoint(0.0, 0.0, 1.0, 0.0)}) {
        SCOPED_TRACE(testing::Message() << k << " sticks, " << name(a) << ", z " << v.z << ", w " << v.w);
        Order order;
        (*sorter)(v, order);
        ASSERT_EQ(order.cycles.size(), 1U);
        EXPECT_EQ(order.cycles.front().size(), static_cast<std::size_t>(k));
        EXPECT_FALSE(order.cuts.empty());
        EXPECT_TRUE(order.exact);
        const Tally tally = shootRays(mesh, order, v, 3);
        EXPECT_GT(tally.pairs, 10U);
        EXPECT_EQ(tally.inversions, 0U);
      }
      Order order;
      (*sorter)(Viewpoint(9.0, 0.3, 0.1, 1.0), order);  // from the side there is none
      EXPECT_TRUE(order.cycles.empty());
      EXPECT_EQ(shootRays(mesh, order, Viewpoint(9.0, 0.3, 0.1, 1.0), 4).inversions, 0U);
    }
  }
}

// Pinwheels behind one another and a cloud of cells: of the pairs across gaps only those are asked for that cycles
// need, and a view leaves nothing behind for the next.
TEST(Cycles, EdgesAcrossGapsAreThoseOfCyclesAlone) {
  for (const std::uint64_t seed : {61U, 62U, 63U, 64U}) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    mesh::Source source = pinwheel(3);
    for (int i = 1; i < 4; ++i)
      source = tests::join(source, moved(pinwheel(3 + i), 1.0, Vec3(0.2 * u(random), 0.2 * u(random), -2.0 * i)));
    source = tests::join(source, moved(pierced(40, seed), 1.5, Vec3(-0.7, -0.7, -10.0)));
    const mesh::Mesh mesh = mesh::build(source);
    FaceSigns signs(mesh);
    GapEdges gaps(mesh, signs);
    Xmpvo xmpvo(mesh);
    BspXmpvo bsp(mesh);
    const std::vector<Viewpoint> views{{0.3 * u(random), 0.3 * u(random), 8.0, 1.0},
                                       {9.0, u(random), -3.0, 1.0},
                                       {0.1 * u(random), 0.1 * u(random), 1.0, 0.0},
                                       {0.1, 0.1 * u(random), -30.0, 1.0}};
    for (GapSorter* sorter : {static_cast<GapSorter*>(&xmpvo), static_cast<GapSorter*>(&bsp)}) {
      std::size_t cycles = 0;
      for (const Viewpoint& v : views) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << name(sorter->algorithm()) << ", viewpoint " << v.x
                                        << ' ' << v.y << ' ' << v.z << ' ' << v.w);
        Order order, fresh;
        (*sorter)(v, order);
        EXPECT_TRUE(order.exact);
        cycles += order.cycles.size();
        const Tally tally = shootRays(mesh, order, v, seed, 1500);
        EXPECT_GT(tally.pairs, 10U);
        EXPECT_EQ(tally.inversions, 0U);
        signs(v);
        ExtraEdges all;
        gaps(v, all);
        EXPECT_LT(2 * sorter->addedEdges(), all.successor.size());
        (*makeSorter(sorter->algorithm(), mesh))(v, fresh);
        EXPECT_EQ(order.cells, fresh.cells);
      }
      EXPECT_GE(cycles, 6U);
    }
  }
}

// Three rings, two of them interlocked, one for each axis: no direction makes an angle above acos(1/sqrt(3)) with all
// of them, so that at least one ring is cyclic from everywhere far away.
mesh::Source ringsForEveryView(std::size_t cells) {
  const auto turned = [&](int axis, const Vec3& centre) {
    mesh::Source ring = tests::twistedRing(cells, 0.5);
    ring.arrays.clear();
    for (Vec3& p : ring.points) {
      Vec3 q(0.0);
      for (int k = 0; k < 3; ++k)
        q[(k + axis + 1) % 3] = p[k];
      p = q + centre;
    }
    return ring;
  };
  return tests::join(tests::join(turned(2, Vec3(0.0)), turned(1, Vec3(0.75, 0.0, 0.0))),
                     turned(0, Vec3(0.0, 0.0, 3.0)));
}

TEST(Cycles, TwistedRingsAreCyclicFromEverywhere) {
  for (const std::size_t cells : {7U, 9U, 12U}) {
    const mesh::Mesh mesh = mesh::build(ringsForEveryView(cells));
    ASSERT_EQ(mesh.cell_count(), 3 * cells);
    std::mt19937_64 random(cells);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 8; ++i) {
      Vec3 away(normal(random), normal(random), normal(random));
      away *= 60.0 / std::sqrt(away.x * away.x + away.y * away.y + away.z * away.z);
      const Viewpoint v(away, i % 2 == 0 ? 1.0 : 0.0);
      for (const Algorithm a : {Algorithm::xmpvo, Algorithm::bsp_xmpvo, Algorithm::newell}) {
        SCOPED_TRACE(testing::Message() << cells << " cells, " << name(a) << ", view " << i);
        const auto sorter = makeSorter(a, mesh);
        Order order;
        (*sorter)(v, order);
        EXPECT_GE(order.cycles.size(), 1U);
        EXPECT_FALSE(order.cuts.empty());
        EXPECT_TRUE(order.exact) << sorter->why();
        const Tally tally = shootRays(mesh, order, v, 5, 1000);
        EXPECT_GT(tally.pairs, 10U);
        EXPECT_EQ(tally.inversions, 0U);
      }
    }
  }
}

// A twisted bar along its axis: each of its layers is a cycle, and so is every ring of cells around its middle. A plane
// through the middle ends them all: pieces are as many as cells that it meets, not as cells.
TEST(Cycles, LongOnesAroundOneMiddleAreCutTogether) {
  for (const std::size_t n : {8U, 12U}) {
    const mesh::Mesh mesh = mesh::build(tests::twistedBar(n, 1.5));
    const std::size_t layers = 3 * n;
    const auto sorter = makeSorter(Algorithm::xmpvo, mesh);
    for (const Viewpoint& v : {Viewpoint(0.03, 0.02, 9.0, 1.0), Viewpoint(0.0, 0.0, 1.0, 0.0)}) {
      SCOPED_TRACE(testing::Message() << n << " x " << n << " cells, viewpoint " << v.z << ' ' << v.w);
      Order order;
      (*sorter)(v, order);
      EXPECT_TRUE(order.exact);
      EXPECT_GE(order.cycles.size(), layers);
      EXPECT_LE(order.cells.size(), mesh.cell_count() + 4 * n * layers);
      const Tally tally = shootRays(mesh, order, v, 5, 200);
      EXPECT_GT(tally.pairs, 1000U);
      EXPECT_EQ(tally.inversions, 0U);
    }
  }
}

TEST(Cycles, ProblemFacesOfTwistedHexahedra) {
  const mesh::Mesh mesh = mesh::build(tests::hexahedronGrid(5, 0.35, 17));
  const auto sorter = makeSorter(Algorithm::automatic, mesh);
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> u(-3.0, 4.0);
  std::size_t cuts = 0;
  for (int i = 0; i < 12; ++i) {
    const Viewpoint v(u(random), u(random), u(random), 1.0);
    Order order;
    (*sorter)(v, order);
    EXPECT_TRUE(order.exact);
    cuts += order.cuts.size();
    std::vector<std::size_t> entries(mesh.cell_count(), 0);
    for (const mesh::Id c : order.cells)
      ++entries[c];
    EXPECT_EQ(std::count(entries.begin(), entries.end(), 0U), 0);
  }
  EXPECT_GT(cuts, 0U);
}

TEST(BadInput, OneCellAndTwoDistantCells) {
  const mesh::Mesh one = mesh::build(box(Vec3(0.0), Vec3(1.0)));
  const mesh::Mesh two = mesh::build(tests::join(box(Vec3(0.0), Vec3(1.0)), box(Vec3(1e6), Vec3(1e6 + 1.0))));
  for (const Algorithm a : {Algorithm::automatic, Algorithm::mpvo, Algorithm::mpvonc, Algorithm::xmpvo,
                            Algorithm::bsp_xmpvo, Algorithm::newell, Algorithm::centroid, Algorithm::none}) {
    Order order;
    for (const Viewpoint& v : someViews(1)) {
      (*makeSorter(a, one))(v, order);
      ASSERT_EQ(order.cells, std::vector<mesh::Id>{0}) << name(a);
      (*makeSorter(a, two))(v, order);
      ASSERT_EQ(order.cells.size(), 2U) << name(a);
    }
  }
  Order order;
  (*makeSorter(Algorithm::automatic, two))(Viewpoint(-1e6, -1e6, -1e6, 1.0), order);
  const bool first_is_far = two.points[two.vertices(order.cells[0])[0]].x > 1e5;
  EXPECT_TRUE(first_is_far);
}

// Blocks that reach into each other have no right order; blocks that only touch do.
TEST(BadInput, OverlappingCellsAreNamed) {
  const mesh::Mesh into = mesh::build(tests::join(box(Vec3(0.0), Vec3(1.0)), box(Vec3(0.4, 0.5, 0.6), Vec3(2.0))));
  const mesh::Mesh beside = mesh::build(tests::join(box(Vec3(0.0), Vec3(1.0)), box(Vec3(1.0, 0.5, 0.6), Vec3(2.0))));
  for (const Algorithm a : {Algorithm::xmpvo, Algorithm::bsp_xmpvo, Algorithm::newell}) {
    const auto sorter = makeSorter(a, into);
    EXPECT_FALSE(sorter->exact());
    EXPECT_NE(sorter->why().find("overlap"), std::string::npos) << sorter->why();
    Order order;
    (*sorter)(Viewpoint(5.0, 4.0, 3.0, 1.0), order);
    EXPECT_FALSE(order.exact);
    EXPECT_TRUE(makeSorter(a, beside)->exact());
  }
}

}  // namespace
}  // namespace spillikin::sort
