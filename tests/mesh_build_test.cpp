// Building: orientation, adjacency, numbering, what is kept and what is left out.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "spillikin/mesh/build.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

using tests::checkInvariants;
using tests::volume;

// Renames the points of the file, and reorders its cells.
Source shuffled(const Source& source, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::uint32_t> new_id(source.points.size());
  std::iota(new_id.begin(), new_id.end(), 0U);
  std::shuffle(new_id.begin(), new_id.end(), random);
  std::vector<std::size_t> order(source.types.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  Source result;
  result.points.resize(source.points.size());
  for (std::size_t i = 0; i < new_id.size(); ++i)
    result.points[new_id[i]] = source.points[i];
  result.offsets = {0};
  for (const std::size_t c : order) {
    result.types.push_back(source.types[c]);
    for (std::size_t k = source.offsets[c]; k < source.offsets[c + 1]; ++k) {
      result.connectivity.push_back(new_id[source.connectivity[k]]);
    }
    result.offsets.push_back(result.connectivity.size());
  }
  return result;
}

// Mirrors every other cell's vertex order, so that its volume as read is negative. For tetrahedra and hexahedra.
Source halfInverted(Source source) {
  for (std::size_t c = 0; c < source.types.size(); c += 2) {
    auto* v = source.connectivity.data() + source.offsets[c];
    if (source.types[c] == vtk_cell::tetra) std::swap(v[1], v[2]);
    if (source.types[c] == vtk_cell::hexahedron) std::swap_ranges(v, v + 4, v + 4);
  }
  return source;
}

using Place = std::array<double, 3>;
Place place(const Vec3& p) {
  return {p.x, p.y, p.z};
}

// Faces as their corners in space and whether they are exterior: what does not depend on any numbering.
std::multiset<std::pair<std::set<Place>, bool>> facesInSpace(const Mesh& mesh) {
  std::multiset<std::pair<std::set<Place>, bool>> result;
  for (Id face = 0; face < mesh.face_count(); ++face) {
    std::set<Place> corners;
    if (face < mesh.triangle_count()) {
      for (const Id v : mesh.triangle[face])
        corners.insert(place(mesh.points[v]));
    } else {
      for (const Id v : mesh.quad[face - mesh.triangle_count()])
        corners.insert(place(mesh.points[v]));
    }
    result.emplace(corners, mesh.exterior(face));
  }
  return result;
}

TEST(Build, TetrahedronGridFillsTheCube) {
  const Source source = tests::tetrahedronGrid(5, 0.15, 7);
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_TRUE(mesh.tetrahedral());
  EXPECT_EQ(mesh.cell_count(), source.types.size());
  EXPECT_EQ(mesh.points.size(), source.points.size());
  EXPECT_NEAR(volume(mesh), 125.0, 1e-9);
  EXPECT_EQ(mesh.quad_count(), 0U);
  EXPECT_EQ(mesh.triangle_count(), (4 * mesh.cell_count() + 12 * 25) / 2);
  EXPECT_EQ(report.degenerate + report.collapsed + report.merged_points, 0U);
  EXPECT_TRUE(report.warnings.empty());
}

TEST(Build, HexahedronGridHasTheFacesOfAGrid) {
  const std::size_t n = 4;
  const Mesh mesh = build(tests::hexahedronGrid(n, 0.2, 3));
  checkInvariants(mesh);
  EXPECT_EQ(mesh.triangle_count(), 0U);
  EXPECT_EQ(mesh.quad_count(), 3 * n * n * (n + 1));
  EXPECT_NEAR(volume(mesh), 64.0, 1e-9);
  const Inspection seen = inspect(mesh);
  EXPECT_EQ(seen.exterior_faces, 6 * n * n);
  EXPECT_EQ(seen.components, 1U);
  EXPECT_GT(seen.nonplanar_faces, 0U);
  EXPECT_NEAR(seen.volume, 64.0, 1e-9);
  EXPECT_EQ(seen.lower, Vec3(0.0));
  EXPECT_EQ(seen.upper, Vec3(4.0));
  EXPECT_GT(seen.bytes, mesh.points.size() * sizeof(Vec3));
}

TEST(Build, EulersFormulaHoldsForABall) {
  const Mesh mesh = build(tests::delaunayCube(400, 11));
  checkInvariants(mesh);
  std::set<std::pair<Id, Id>> edges;
  for (const auto& [a, b, c] : mesh.triangle) {
    for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(a, c)}) {
      edges.emplace(std::min(p, q), std::max(p, q));
    }
  }
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  EXPECT_EQ(count(mesh.points.size()) - count(edges.size()) + count(mesh.triangle_count()) - count(mesh.cell_count()),
            1);
  EXPECT_NEAR(volume(mesh), 1.0, 1e-12);
}

TEST(Build, NeighboursSeeEachOther) {
  const Mesh mesh = build(tests::hexahedronGrid(3));
  std::size_t interior = 0;
  for (Id c = 0; c < mesh.cell_count(); ++c) {
    for (const FaceUse use : mesh.faces(c)) {
      const Id other = mesh.neighbour(use);
      EXPECT_EQ(other == none, mesh.exterior(use.face()));
      if (other == none) continue;
      ++interior;
      const auto back = mesh.faces(other);
      EXPECT_TRUE(std::any_of(back.begin(), back.end(), [&](FaceUse u) { return mesh.neighbour(u) == c; }));
    }
  }
  EXPECT_EQ(interior, 2U * 54U);
}

TEST(Build, FileOrderAndOrientationDoNotMatter) {
  for (const bool hexahedra : {false, true}) {
    const Source source = hexahedra ? tests::hexahedronGrid(4, 0.2, 5) : tests::tetrahedronGrid(4, 0.15, 5);
    const auto expected = facesInSpace(build(source));
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(seed);
      BuildReport report;
      const Mesh mesh = build(halfInverted(shuffled(source, seed)), &report);
      checkInvariants(mesh);
      EXPECT_EQ(report.inverted, source.types.size() / 2);
      EXPECT_EQ(facesInSpace(mesh), expected);
      EXPECT_NEAR(volume(mesh), 64.0, 1e-9);
    }
  }
}

TEST(Build, FileIdsAreKept) {
  const Source source = shuffled(tests::tetrahedronGrid(3, 0.1, 2), 9);
  const Mesh mesh = build(source);
  for (Id v = 0; v < mesh.points.size(); ++v)
    EXPECT_EQ(mesh.points[v], source.points[mesh.point_file_id[v]]);
  std::vector<bool> seen(source.types.size(), false);
  for (Id c = 0; c < mesh.cell_count(); ++c) {
    const std::size_t file = mesh.cell_file_id[c];
    EXPECT_FALSE(seen[file]);
    seen[file] = true;
    std::set<std::uint32_t> named, wanted(source.connectivity.begin() + static_cast<std::ptrdiff_t>(4 * file),
                                          source.connectivity.begin() + static_cast<std::ptrdiff_t>(4 * file + 4));
    for (const Id v : mesh.vertices(c))
      named.insert(mesh.point_file_id[v]);
    EXPECT_EQ(named, wanted);
  }
}

// Neighbours along the curve are neighbours in space: the mean distance of successive points is that of a few cells,
// where in file order (shuffled) it is half of the cube's side.
TEST(Build, NumberingFollowsSpace) {
  const std::size_t n = 16;
  const Mesh mesh = build(shuffled(tests::hexahedronGrid(n), 4));
  double points = 0.0, cells = 0.0;
  for (std::size_t v = 1; v < mesh.points.size(); ++v)
    points += glm::length(mesh.points[v] - mesh.points[v - 1]);
  const auto middle = [&](std::size_t c) {
    Vec3 sum(0.0);
    for (const Id v : mesh.vertices(static_cast<Id>(c)))
      sum += mesh.points[v] / 8.0;
    return sum;
  };
  for (std::size_t c = 1; c < mesh.cell_count(); ++c)
    cells += glm::length(middle(c) - middle(c - 1));
  EXPECT_LT(points / static_cast<double>(mesh.points.size()), 2.0);
  EXPECT_LT(cells / static_cast<double>(mesh.cell_count()), 2.0);
}

TEST(Build, DoesNotDependOnTheNumberOfThreads) {
  const Source source =
      tests::join(shuffled(tests::tetrahedronGrid(14, 0.15, 3), 1), shuffled(tests::hexahedronGrid(9), 2));
  std::vector<Mesh> meshes;
  for (const std::size_t threads : {std::size_t{1}, std::size_t{2}, std::size_t{7}}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    meshes.push_back(build(source));
  }
  for (const Mesh& mesh : meshes) {
    EXPECT_EQ(mesh.points, meshes[0].points);
    EXPECT_EQ(mesh.cell_vertex, meshes[0].cell_vertex);
    EXPECT_EQ(mesh.cell_file_id, meshes[0].cell_file_id);
    EXPECT_EQ(mesh.triangle, meshes[0].triangle);
    EXPECT_EQ(mesh.triangle_cells, meshes[0].triangle_cells);
    EXPECT_EQ(mesh.quad, meshes[0].quad);
    EXPECT_EQ(mesh.quad_cells, meshes[0].quad_cells);
    EXPECT_TRUE(std::equal(mesh.cell_face.begin(), mesh.cell_face.end(), meshes[0].cell_face.begin(),
                           meshes[0].cell_face.end(), [](FaceUse a, FaceUse b) { return a.packed == b.packed; }));
  }
}

TEST(Build, LeavesOutWhatIsNotDrawnWithCounts) {
  Source source = tests::hexahedronGrid(2);
  source.left_out.assign(8, 0);
  source.left_out[3] = 1;
  const auto add = [&](std::uint8_t type, std::initializer_list<std::uint32_t> ids) {
    source.types.push_back(type);
    source.connectivity.insert(source.connectivity.end(), ids);
    source.offsets.push_back(source.connectivity.size());
    source.left_out.push_back(0);
  };
  add(1, {0});            // vertex
  add(3, {0, 1});         // line
  add(9, {0, 1, 4, 3});   // quadrilateral
  add(72, {0, 1, 2, 3});  // Lagrange hexahedron
  add(72, {0, 1, 2, 3});
  source.points.emplace_back(std::numeric_limits<double>::quiet_NaN());  // no cell uses it, so it does not matter
  source.arrays.clear();
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_EQ(mesh.cell_count(), 7U);
  EXPECT_EQ(report.source_cells, 13U);
  EXPECT_EQ(report.source_points, 28U);
  EXPECT_EQ(report.left_out, 1U);
  EXPECT_EQ(report.lower_dimension, 3U);
  EXPECT_EQ(report.unsupported, 2U);
  EXPECT_EQ(report.unsupported_types, (std::map<int, std::size_t>{{72, 2}}));
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_NE(report.warnings[0].find("72"), std::string::npos);
  EXPECT_EQ(report.unused_points, 2U);  // the far corner of the cell left out, and the one added
}

TEST(Build, PointsOfDroppedCellsAreDropped) {
  Source source = tests::oneCell(vtk_cell::tetra, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  source = tests::join(source, tests::oneCell(vtk_cell::tetra, {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {7, 7, 0}}));
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_EQ(mesh.cell_count(), 1U);
  EXPECT_EQ(mesh.points.size(), 4U);
  EXPECT_EQ(report.degenerate, 1U);
}

TEST(Build, VolumesOfEitherSignDownToTheLastBit) {
  // A tetrahedron 2^-30 high: its volume is not zero, and a rounded determinant far from the origin would not know.
  for (const double height : {0x1p-30, -0x1p-30}) {
    const Vec3 far(1e6, 2e6, 3e6);
    BuildReport report;
    const Mesh mesh = build(tests::oneCell(vtk_cell::tetra, {far, far + Vec3(1, 0, 0), far + Vec3(0, 1, 0),
                                                             far + Vec3(0.25, 0.25, height)}),
                            &report);
    EXPECT_EQ(mesh.cell_count(), 1U);
    EXPECT_EQ(report.inverted, height < 0 ? 1U : 0U);
    EXPECT_EQ(report.degenerate, 0U);
  }
}

TEST(Inspect, CountsPartsAndFacesThatDoNotMatch) {
  // A cube, a wedge pair on top of it whose bottom is cut into two triangles, and a cube apart.
  const Source below = tests::oneCell(
      vtk_cell::hexahedron, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}});
  const Source left =
      tests::oneCell(vtk_cell::wedge, {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 0, 2}, {1, 0, 2}, {1, 1, 2}});
  const Source right =
      tests::oneCell(vtk_cell::wedge, {{0, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0, 0, 2}, {1, 1, 2}, {0, 1, 2}});
  const Source apart = tests::oneCell(
      vtk_cell::voxel, {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {6, 1, 0}, {5, 0, 1}, {6, 0, 1}, {5, 1, 1}, {6, 1, 1}});
  const Mesh mesh = build(tests::join(tests::join(below, left), tests::join(right, apart)));
  checkInvariants(mesh);
  const Inspection seen = inspect(mesh);
  EXPECT_EQ(seen.components, 3U);
  EXPECT_EQ(seen.nonmatching_faces, 1U);
  EXPECT_EQ(seen.nonplanar_faces, 0U);
  EXPECT_EQ(seen.nonconvex_cells, 0U);
  EXPECT_NEAR(seen.volume, 3.0, 1e-14);
  EXPECT_EQ(seen.cells_by_type[static_cast<std::size_t>(CellType::hexahedron)], 2U);
  EXPECT_EQ(seen.cells_by_type[static_cast<std::size_t>(CellType::wedge)], 2U);
}

TEST(Inspect, SeesADentedCell) {
  const Mesh mesh = build(
      tests::oneCell(vtk_cell::hexahedron,
                     {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0.3, 0.3, 0.4}, {0, 1, 1}}));
  EXPECT_EQ(inspect(mesh).nonconvex_cells, 1U);
}

}  // namespace
}  // namespace spillikin::mesh
