// Cells subdivided for the time being, points inside cells, folded cells, volumes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/folded.h"
#include "spillikin/mesh/interior_point.h"
#include "spillikin/mesh/predicates.h"
#include "spillikin/mesh/refit.h"
#include "spillikin/mesh/subdivide.h"
#include "spillikin/mesh/subdivision_pools.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

const std::vector<Vec3> cube{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

// Cubes whose corners come in any round of the ids, a pyramid and a wedge, apart from each other: blocks of every size.
Source everySize(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-0.15, 0.15);
  Source source;
  const auto shifted = [&](std::vector<Vec3> points, double x) {
    for (Vec3& p : points)
      p += Vec3(x + unit(random), unit(random), unit(random));
    return points;
  };
  for (int i = 0; i < 40; ++i) {
    const Source cell = tests::oneCell(vtk_cell::hexahedron, shifted(cube, 3.0 * i));
    source = i == 0 ? cell : tests::join(source, cell);
  }
  source = tests::join(
      source,
      tests::oneCell(vtk_cell::pyramid, shifted({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}}, -3.0)));
  return tests::join(source,
                     tests::oneCell(vtk_cell::wedge,
                                    shifted({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}}, -6.0)));
}

double volume(const Mesh& mesh, const Tetrahedron& t) {
  return enclosedVolume(mesh.points,
                        Surface{{{t[0], t[1], t[3]}, {t[1], t[2], t[3]}, {t[2], t[0], t[3]}, {t[0], t[2], t[1]}}, {}});
}

bool has(const Tetrahedron& tetrahedron, const std::array<Id, 3>& triangle) {
  return std::all_of(triangle.begin(), triangle.end(),
                     [&](Id v) { return std::count(tetrahedron.begin(), tetrahedron.end(), v) == 1; });
}

void checkCell(const Mesh& mesh, const SubdividedCell& cell) {
  double sum = 0.0;
  for (const Tetrahedron& t : cell.tetrahedra)
    sum += volume(mesh, t);
  EXPECT_NEAR(sum, tests::volume(mesh, cell.parent), 1e-12);
  Surface boundary;
  surface(mesh, cell.parent, boundary);
  ASSERT_EQ(cell.outer.size(), boundary.triangles.size());
  for (std::size_t k = 0; k < boundary.triangles.size(); ++k)
    EXPECT_TRUE(has(cell.tetrahedra[cell.outer[k]], boundary.triangles[k]));
  for (const InnerFace& face : cell.inner) {
    ASSERT_NE(face.tetrahedron[0], face.tetrahedron[1]);
    for (unsigned side = 0; side < 2; ++side) {
      const Tetrahedron& t = cell.tetrahedra[face.tetrahedron[side]];
      ASSERT_TRUE(has(t, face.vertex));
      const Id tip = *std::find_if(t.begin(), t.end(),
                                   [&](Id v) { return std::count(face.vertex.begin(), face.vertex.end(), v) == 0; });
      const int above = orient3d(mesh.points[face.vertex[0]], mesh.points[face.vertex[1]], mesh.points[face.vertex[2]],
                                 mesh.points[tip]);
      EXPECT_EQ(above, side == 0 ? -1 : 1) << "the normal leads from the first to the second";
    }
  }
  // Four faces each: those of the boundary once, those between twice.
  EXPECT_EQ(4 * cell.tetrahedra.size(), cell.outer.size() + 2 * cell.inner.size());
}

TEST(SubdivisionPools, EveryBlockFillsItsCell) {
  std::set<std::size_t> sizes;
  std::size_t subdivided = 0;
  for (std::uint64_t seed = 1; seed < 12; ++seed) {
    const Mesh mesh = build(everySize(seed));
    SubdivisionPools pools(mesh);
    for (Id c = 0; c < mesh.cell_count(); ++c) {
      if (!pools.subdivide(c)) continue;
      ++subdivided;
      checkCell(mesh, pools[c]);
      sizes.insert(pools[c].tetrahedra.size());
      EXPECT_EQ(pools[c].parent, c);
    }
  }
  EXPECT_EQ(sizes, (std::set<std::size_t>{2, 3, 5, 6}));
  EXPECT_GT(subdivided, 400U);
}

TEST(SubdivisionPools, OnlyWhatChangesIsTouchedAndBlocksAreUsedAgain) {
  const Mesh mesh = build(tests::hexahedronGrid(6, 0.15, 3));
  SubdivisionPools pools(mesh);
  const auto view = [&](Id begin, Id end) {
    for (Id c = begin; c < end; ++c)
      ASSERT_TRUE(pools.subdivide(c));
    pools.restoreOthers();
  };
  view(0, 100);
  EXPECT_EQ(pools.size(), 100U);
  EXPECT_EQ(pools.made(), 100U);
  const auto kept = pools[60].tetrahedra[0];  // by value: the pools may move their blocks
  view(50, 150);
  EXPECT_EQ(pools.size(), 100U);
  EXPECT_EQ(pools.made(), 150U) << "cells 50 to 99 keep their blocks";
  EXPECT_EQ(pools[60].tetrahedra[0], kept);
  EXPECT_FALSE(pools.subdivided(10));
  EXPECT_TRUE(pools.subdivided(149));
  const auto blocks = pools.blocks(), unused = pools.unused();
  EXPECT_EQ(blocks[2] + blocks[3] - unused[2] - unused[3], 100U);
  for (int i = 0; i < 20; ++i)
    view(static_cast<Id>(5 * i), static_cast<Id>(5 * i + 100));
  const auto after = pools.blocks();
  EXPECT_LE(after[2] + after[3], 205U) << "the arrays grow no further than to two views' cells";
  view(0, 0);
  EXPECT_EQ(pools.size(), 0U);
  EXPECT_EQ(pools.unused(), pools.blocks());
  for (Id c = 0; c < mesh.cell_count(); ++c)
    EXPECT_FALSE(pools.subdivided(c));
}

// A corner pushed through the bottom: no subdivision fills it.
std::vector<Vec3> foldedCube() {
  std::vector<Vec3> points = cube;
  points[6] = {0.8, 0.8, -0.3};
  return points;
}

TEST(SubdivisionPools, CellsThatTheirTetrahedraDoNotFillAreLeftWhole) {
  Source source = tests::join(
      tests::oneCell(vtk_cell::hexahedron, cube),
      tests::oneCell(vtk_cell::polyhedron, {{3, 0, 0}, {4, 0, 0}, {3, 1, 0}, {3, 0, 1}, {4, 1, 1}, {4.2, .5, .5}}));
  std::vector<Vec3> folded = foldedCube();
  for (Vec3& p : folded)
    p.x += 9.0;
  source = tests::join(source, tests::oneCell(vtk_cell::hexahedron, folded));
  const Mesh mesh = build(source);
  SubdivisionPools pools(mesh);
  std::size_t subdivided = 0;
  for (Id c = 0; c < mesh.cell_count(); ++c)
    subdivided += pools.subdivide(c) ? 1U : 0U;
  EXPECT_EQ(subdivided, 1U);
  EXPECT_EQ(pools.made(), 1U);
}

TEST(Folded, AreCellsWhoseFacesCrossAndNoOthers) {
  EXPECT_TRUE(foldedCells(build(tests::hexahedronGrid(6, 0.3, 1))).empty());
  EXPECT_TRUE(foldedCells(build(tests::twistedBar(4, 2.0))).empty());
  EXPECT_TRUE(foldedCells(build(tests::curvedBall(6))).empty());
  EXPECT_TRUE(foldedCells(build(tests::delaunayCube(50, 1))).empty());
  // Not convex, but no face crosses another: a dent that stops before the opposite corner.
  std::vector<Vec3> dented = cube;
  dented[6] = {0.45, 0.45, 0.45};
  EXPECT_TRUE(foldedCells(build(tests::oneCell(vtk_cell::hexahedron, dented))).empty());
  EXPECT_EQ(foldedCells(build(tests::oneCell(vtk_cell::hexahedron, foldedCube()))).size(), 1U);
  // Among good ones, it is the one that is named.
  Source source = tests::hexahedronGrid(3);
  source.points[static_cast<std::size_t>((1 * 4 + 1) * 4 + 1)] = {2.4, 2.4, 2.4};
  const Mesh mesh = build(source);
  const std::vector<Id> folded = foldedCells(mesh);
  ASSERT_FALSE(folded.empty());
  for (const Id c : folded) {
    const std::size_t file = mesh.cell_file_id[c];
    EXPECT_LE(std::max({file % 3, file / 3 % 3, file / 9}), 1U) << "cells at the moved point";
  }
}

TEST(InteriorPoint, SeesAllOfTheBoundary) {
  // A deep dent, whose mean of vertices is hidden from some faces; a pyramid dented from below.
  std::vector<Vec3> dented = cube;
  dented[6] = {0.12, 0.12, 0.12};
  const Mesh mesh = build(tests::oneCell(vtk_cell::hexahedron, dented));
  Surface boundary;
  surface(mesh, 0, boundary);
  InteriorPoint found;
  ASSERT_TRUE(interiorPoint(mesh, 0, boundary, found));
  Vec3 sum(0.0);
  for (std::size_t i = 0; i < found.vertex.size(); ++i) {
    EXPECT_GE(found.weight[i], 0.0);
    sum += found.weight[i] * mesh.points[found.vertex[i]];
  }
  EXPECT_NEAR(std::accumulate(found.weight.begin(), found.weight.end(), 0.0), 1.0, 1e-12);
  EXPECT_EQ(sum, found.place);
  for (const auto& t : boundary.triangles)
    EXPECT_LT(orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], found.place), 0);
  const Mesh folded = build(tests::oneCell(vtk_cell::hexahedron, foldedCube()));
  surface(folded, 0, boundary);
  EXPECT_FALSE(interiorPoint(folded, 0, boundary, found));
}

// Badly shaped hexahedra: where their own tetrahedra do not fill them they are coned from a point inside, and an affine
// field stays one.
TEST(Tetrahedralize, DentedCellsAreConedFromInside) {
  std::size_t inside = 0, whole_meshes = 0;
  for (std::uint64_t seed = 1; seed < 16; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Source source = tests::hexahedronGrid(5, 0.33, seed);
    tests::addPointArray(source, "affine", [](const Vec3& p) { return 2.0 * p.x - 3.0 * p.y + 0.5 * p.z + 1.0; });
    const Mesh mesh = build(source);
    const Tetrahedralization t = tetrahedralize(mesh);
    inside += t.mesh.points.size() - mesh.points.size();
    std::vector<double> sum(mesh.cell_count(), 0.0);
    for (Id c = 0; c < t.mesh.cell_count(); ++c)
      sum[t.parent[c]] += tests::volume(t.mesh, c);
    for (Id c = 0; c < mesh.cell_count(); ++c) {
      if (std::count(t.unfilled.begin(), t.unfilled.end(), c) != 0) continue;
      EXPECT_NEAR(sum[c], tests::volume(mesh, c), 1e-12);
    }
    const Field field = tetrahedraField(t, selectField(source, mesh, "affine"));
    ASSERT_EQ(field.values.size(), t.mesh.points.size());
    for (std::size_t v = 0; v < field.values.size(); ++v) {
      const Vec3& p = t.mesh.points[v];
      EXPECT_NEAR(field.values[v], 2.0 * p.x - 3.0 * p.y + 0.5 * p.z + 1.0, 1e-12);
    }
    if (!t.unfilled.empty()) continue;
    ++whole_meshes;
    const auto exterior = std::count_if(t.mesh.triangle_cells.begin(), t.mesh.triangle_cells.end(),
                                        [](const auto& cells) { return cells[1] == none; });
    EXPECT_EQ(exterior, 2 * 6 * 25) << "neighbours fit";
  }
  EXPECT_GT(inside, 3U);
  EXPECT_GT(whole_meshes, 3U);
}

TEST(Tetrahedralize, NonconvexPolyhedraAreFilled) {
  // A pyramid with a star-shaped base of eight corners, as a polyhedron.
  Source source;
  source.points.push_back({0.0, 0.0, 2.0});
  for (int k = 0; k < 8; ++k) {
    const double r = k % 2 == 0 ? 1.0 : 0.35, a = std::acos(-1.0) * k / 4.0;
    source.points.push_back({r * std::cos(a), r * std::sin(a), 0.0});
  }
  source.points.push_back({0.0, 0.0, -1.5});
  std::vector<std::uint32_t> stream{16};
  for (std::uint32_t k = 0; k < 8; ++k) {
    const std::uint32_t p = 1 + k, q = 1 + (k + 1) % 8;
    stream.insert(stream.end(), {3, p, q, 0, 3, q, p, 9});
  }
  source.types = {vtk_cell::polyhedron};
  source.connectivity = stream;
  source.offsets = {0, stream.size()};
  tests::addPointArray(source, "value", [](const Vec3& p) { return p.z; });
  const Mesh mesh = build(source);
  ASSERT_EQ(mesh.cell_count(), 1U);
  EXPECT_EQ(inspect(mesh).nonconvex_polyhedra, 1U);
  EXPECT_EQ(inspect(mesh).folded_cells, 0U);
  const Tetrahedralization t = tetrahedralize(mesh);
  EXPECT_TRUE(t.unfilled.empty());
  double sum = 0.0;
  for (Id c = 0; c < t.mesh.cell_count(); ++c)
    sum += tests::volume(t.mesh, c);
  EXPECT_NEAR(sum, tests::volume(mesh, 0), 1e-12);
}

TEST(Tetrahedralize, KeepsTheTablesOfMadePointsAndNamesWhatCannotBeFilled) {
  const Mesh folded = build(tests::oneCell(vtk_cell::hexahedron, foldedCube()));
  EXPECT_EQ(tetrahedralize(folded).unfilled, std::vector<Id>{0});
  Source source = tests::oneCell(vtk_cell::hexahedron, cube);
  Mesh mesh = build(source);
  mesh.made_offset = {0, 2};
  mesh.made_point = {0, 1};
  mesh.made_weight = {0.5, 0.5};
  const Mesh tets = tetrahedralize(mesh).mesh;
  EXPECT_EQ(tets.made_offset, mesh.made_offset);
  EXPECT_EQ(tets.made_point, mesh.made_point);
  EXPECT_EQ(tets.made_weight, mesh.made_weight);
}

TEST(Inspect, CountsFansOncePerFace) {
  // Two hexagonal prisms on top of each other: three hexagons.
  Source source;
  for (int layer = 0; layer < 3; ++layer) {
    for (int k = 0; k < 6; ++k) {
      const double a = std::acos(-1.0) * k / 3.0;
      source.points.push_back({std::cos(a), std::sin(a), layer + (layer == 1 && k == 2 ? 0.3 : 0.0)});
    }
  }
  source.offsets = {0, 12, 24};
  source.types = {vtk_cell::hexagonal_prism, vtk_cell::hexagonal_prism};
  for (std::uint32_t i = 0; i < 12; ++i)
    source.connectivity.push_back(i);
  for (std::uint32_t i = 6; i < 18; ++i)
    source.connectivity.push_back(i);
  const Inspection found = inspect(build(source));
  EXPECT_EQ(found.fanned_faces, 3U);
  EXPECT_EQ(found.nonplanar_fans, 1U);
}

TEST(Refit, RefusesConvexPointSets) {
  Source source = tests::oneCell(vtk_cell::hexahedron, cube);
  BuildReport report;
  Mesh mesh = build(source, &report);
  EXPECT_TRUE(refit(mesh, report, source));
  source.types = {vtk_cell::convex_point_set};
  mesh = build(source, &report);
  EXPECT_FALSE(refit(mesh, report, source)) << "its hull depends on the places";
}

TEST(EnclosedVolume, OfAnyClosedSurface) {
  const Mesh mesh = build(tests::twistedBar(3, 1.0));
  Surface boundary;
  double sum = 0.0;
  for (Id c = 0; c < mesh.cell_count(); ++c) {
    surface(mesh, c, boundary);
    const double v = enclosedVolume(mesh.points, boundary);
    EXPECT_NEAR(v, tests::volume(mesh, c), 1e-14);
    sum += v;
    for (auto& t : boundary.triangles)
      std::swap(t[0], t[1]);
    EXPECT_NEAR(enclosedVolume(mesh.points, boundary), -v, 1e-15);
  }
  EXPECT_NEAR(sum, inspect(mesh).volume, 1e-12);
  EXPECT_EQ(enclosedVolume(mesh.points, {}), 0.0);
}

}  // namespace
}  // namespace spillikin::mesh
