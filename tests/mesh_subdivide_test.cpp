// The smallest-vertex rule: every ordering of the ids of each cell type gives tetrahedra that fill the cell once, with
// the cell's own boundary triangles.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/predicates.h"
#include "spillikin/mesh/subdivide.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

const std::vector<Vec3> cube{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
const std::vector<Vec3> pyramid{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}};
const std::vector<Vec3> wedge{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}};

// A convex prism over n points of a parabola: coordinates are small integers, so that volumes are exact.
std::vector<Vec3> prism(int n) {
  std::vector<Vec3> points;
  for (int layer = 0; layer < 2; ++layer) {
    for (int k = 0; k < n; ++k) {
      points.emplace_back(k, k * (k - n), 2 * layer);
    }
  }
  return points;
}

// One cell whose vertex at position k has the id ids[k], without renumbering.
Mesh oneCellMesh(CellType type, const std::vector<Vec3>& points, const std::vector<Id>& ids) {
  Mesh mesh;
  mesh.points.resize(points.size());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    mesh.points[ids[k]] = points[k];
    mesh.point_file_id.push_back(static_cast<Id>(k));
  }
  mesh.cell_type = {type};
  mesh.cell_vertex_offset = {0, static_cast<Id>(ids.size())};
  mesh.cell_vertex = ids;
  mesh.cell_file_id = {0};
  matchFaces(mesh);
  return mesh;
}

Mesh polyhedronMesh(const Source& source) {
  Mesh mesh;
  mesh.points = source.points;
  mesh.point_file_id.resize(mesh.points.size());
  std::iota(mesh.point_file_id.begin(), mesh.point_file_id.end(), 0U);
  mesh.cell_type = {CellType::polyhedron};
  mesh.cell_vertex = mesh.point_file_id;
  mesh.cell_vertex_offset = {0, static_cast<Id>(mesh.points.size())};
  mesh.cell_file_id = {0};
  mesh.polyhedron_index = {0};
  mesh.polyhedron_polygons = {0, source.connectivity[0]};
  mesh.polygon_offset = {0};
  for (std::size_t at = 1; at < source.connectivity.size(); at += source.connectivity[at] + 1) {
    const auto first = source.connectivity.begin() + static_cast<std::ptrdiff_t>(at) + 1;
    mesh.polygon_vertex.insert(mesh.polygon_vertex.end(), first, first + source.connectivity[at]);
    mesh.polygon_offset.push_back(static_cast<Id>(mesh.polygon_vertex.size()));
  }
  matchFaces(mesh);
  return mesh;
}

std::array<Id, 3> rotatedToSmallest(std::array<Id, 3> t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

double sixVolumes(const Mesh& mesh, const Tetrahedron& t) {
  const Vec3& a = mesh.points[t[0]];
  const Vec3 u = mesh.points[t[1]] - a;
  const Vec3 v = mesh.points[t[2]] - a;
  const Vec3 w = mesh.points[t[3]] - a;
  return u.x * (v.y * w.z - v.z * w.y) + u.y * (v.z * w.x - v.x * w.z) + u.z * (v.x * w.y - v.y * w.x);
}

// Six times the volume inside the boundary triangles.
double sixVolumes(const Mesh& mesh, const Surface& boundary) {
  double sum = 0.0;
  for (const auto& t : boundary.triangles) {
    const Vec3& a = mesh.points[t[0]];
    const Vec3& b = mesh.points[t[1]];
    const Vec3& c = mesh.points[t[2]];
    sum += a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
  }
  return sum;
}

// Tetrahedra of positive volume whose oriented faces cancel in pairs but for the cell's boundary triangles cover every
// point inside once: nothing overlaps and nothing is missing.
std::string fault(const Mesh& mesh, const std::vector<Tetrahedron>& pieces) {
  std::multiset<std::array<Id, 3>> open;
  double volume = 0.0;
  for (const Tetrahedron& t : pieces) {
    if (orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], mesh.points[t[3]]) <= 0) {
      return "a tetrahedron without positive volume";
    }
    volume += sixVolumes(mesh, t);
    for (const std::array<Id, 3> face : {std::array<Id, 3>{t[0], t[2], t[1]}, std::array<Id, 3>{t[0], t[1], t[3]},
                                         std::array<Id, 3>{t[1], t[2], t[3]}, std::array<Id, 3>{t[2], t[0], t[3]}}) {
      const auto other = open.find(rotatedToSmallest({face[0], face[2], face[1]}));
      if (other != open.end()) {
        open.erase(other);
      } else {
        open.insert(rotatedToSmallest(face));
      }
    }
  }
  Surface boundary;
  surface(mesh, 0, boundary);
  if (std::fabs(volume - sixVolumes(mesh, boundary)) > 1e-12 * volume) {
    return "volumes do not sum to the cell's";
  }
  std::multiset<std::array<Id, 3>> expected;
  for (const auto& t : boundary.triangles) {
    expected.insert(rotatedToSmallest(t));
  }
  return open == expected ? "" : "the boundary is not that of surface()";
}

struct Counted {
  std::map<std::size_t, int> orderings;  // by number of tetrahedra
  std::string fault;
};

Counted everyOrdering(CellType type, const std::vector<Vec3>& points, bool first_fixed) {
  Counted counted;
  std::vector<Id> ids(points.size());
  std::iota(ids.begin(), ids.end(), 0U);
  std::vector<Tetrahedron> pieces;
  do {
    const Mesh mesh = oneCellMesh(type, points, ids);
    tetrahedra(mesh, 0, pieces);
    ++counted.orderings[pieces.size()];
    const std::string wrong = fault(mesh, pieces);
    if (!wrong.empty()) {
      counted.fault = wrong + " for the ordering";
      for (const Id id : ids) {
        counted.fault += fmt::format(" {}", id);
      }
      return counted;
    }
  } while (std::next_permutation(ids.begin() + (first_fixed ? 1 : 0), ids.end()));
  return counted;
}

TEST(Subdivide, everyOrderingOfAPyramidGivesTwo) {
  const Counted c = everyOrdering(CellType::pyramid, pyramid, false);
  EXPECT_EQ(c.fault, "");
  EXPECT_EQ(c.orderings, (std::map<std::size_t, int>{{2, 120}}));
}

TEST(Subdivide, everyOrderingOfAWedgeGivesThree) {
  const Counted c = everyOrdering(CellType::wedge, wedge, false);
  EXPECT_EQ(c.fault, "");
  EXPECT_EQ(c.orderings, (std::map<std::size_t, int>{{3, 720}}));
}

// The cube's rotations bring any corner to position 0, so that the smallest id may be kept there. Five come when no
// diagonal of a far face ends opposite to it: when on each of the three the smallest is one of the two side corners.
TEST(Subdivide, everyOrderingOfAHexahedronGivesFiveOrSix) {
  const Counted c = everyOrdering(CellType::hexahedron, cube, true);
  EXPECT_EQ(c.fault, "");
  ASSERT_EQ(c.orderings.size(), 2U);
  EXPECT_EQ(c.orderings.at(5) + c.orderings.at(6), 5040);

  // The same count by brute force over the three far faces of corner 0; corner 6 is opposite to it.
  const int far[3][4] = {{1, 2, 6, 5}, {2, 3, 7, 6}, {4, 5, 6, 7}};
  std::array<int, 8> ids{0, 1, 2, 3, 4, 5, 6, 7};
  int five = 0;
  do {
    five += std::none_of(std::begin(far), std::end(far), [&](const auto& face) {
      int at = 0;
      for (int k = 1; k < 4; ++k) {
        const auto id = [&](int i) { return ids[static_cast<std::size_t>(face[i])]; };
        at = id(k) < id(at) ? k : at;
      }
      const int opposite = face[(at + 2) % 4];
      return face[at] == 6 || opposite == 6;
    });
  } while (std::next_permutation(ids.begin() + 1, ids.end()));
  EXPECT_EQ(c.orderings.at(5), five);
}

// The two configurations that Guy and Crawfis held to be impossible and the paper's section IV shows to work: two of
// the three far diagonals, or one, end in the corner opposite to the smallest vertex.
TEST(Subdivide, aHexahedronWithAnyNumberOfDiagonalsInTheFarCornerWorks) {
  std::set<int> seen;
  std::vector<Id> ids(8);
  std::iota(ids.begin(), ids.end(), 0U);
  std::vector<Tetrahedron> pieces;
  do {
    const Mesh mesh = oneCellMesh(CellType::hexahedron, cube, ids);
    Surface boundary;
    surface(mesh, 0, boundary);
    const auto ends = std::count_if(boundary.triangles.begin(), boundary.triangles.end(),
                                    [&](const auto& t) { return std::find(t.begin(), t.end(), ids[6]) != t.end(); });
    const int diagonals = static_cast<int>(ends) - 3;
    tetrahedra(mesh, 0, pieces);
    EXPECT_EQ(pieces.size(), diagonals == 0 ? 5U : 6U);
    EXPECT_EQ(fault(mesh, pieces), "");
    seen.insert(diagonals);
  } while (seen.size() < 4 && std::next_permutation(ids.begin() + 1, ids.end()));
  EXPECT_EQ(seen, (std::set<int>{0, 1, 2, 3}));
}

TEST(Subdivide, prismsAreConedFromTheirSmallestVertex) {
  const std::uint64_t seed = 17;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::vector<Tetrahedron> pieces;
  for (const auto& [type, sides] :
       {std::pair{CellType::pentagonal_prism, 5}, std::pair{CellType::hexagonal_prism, 6}}) {
    const std::vector<Vec3> points = prism(sides);
    std::vector<Id> ids(points.size());
    std::iota(ids.begin(), ids.end(), 0U);
    for (int i = 0; i < 500; ++i) {
      std::shuffle(ids.begin(), ids.end(), random);
      const Mesh mesh = oneCellMesh(type, points, ids);
      tetrahedra(mesh, 0, pieces);
      ASSERT_EQ(fault(mesh, pieces), "") << name(type) << " " << i;
      // Triangles of the far end and of the sides that do not touch the apex.
      ASSERT_EQ(pieces.size(), static_cast<std::size_t>((sides - 2) + 2 * (sides - 2)));
    }
  }
}

TEST(Subdivide, convexPolyhedraAreConedFromTheirSmallestVertex) {
  const std::uint64_t seed = 23;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Tetrahedron> pieces;
  for (int i = 0; i < 100; ++i) {
    std::vector<Vec3> points;
    for (int k = 0; k < 5 + i % 15; ++k) {
      const Vec3 p(normal(random), normal(random), normal(random));
      points.push_back(p / std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z));
    }
    const Mesh mesh = polyhedronMesh(tests::oneCell(vtk_cell::polyhedron, points));
    tetrahedra(mesh, 0, pieces);
    ASSERT_EQ(fault(mesh, pieces), "") << "polyhedron " << i;
  }
}

TEST(Subdivide, aDeformedHexahedronKeepsItsVolumeAndBoundary) {
  const std::uint64_t seed = 29;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> shift(-0.1, 0.1);
  std::vector<Id> ids(8);
  std::iota(ids.begin(), ids.end(), 0U);
  std::vector<Tetrahedron> pieces;
  for (int i = 0; i < 500; ++i) {
    std::vector<Vec3> points = cube;
    for (Vec3& p : points) {
      p += Vec3(shift(random), shift(random), shift(random));
    }
    std::shuffle(ids.begin(), ids.end(), random);
    const Mesh mesh = oneCellMesh(CellType::hexahedron, points, ids);
    tetrahedra(mesh, 0, pieces);
    ASSERT_EQ(fault(mesh, pieces), "") << "hexahedron " << i;
  }
}

TEST(Tetrahedralize, aHexahedralMeshBecomesOneConformingMesh) {
  const Mesh mesh = build(tests::hexahedronGrid(6, 0.15, 9));
  const Tetrahedralization t = tetrahedralize(mesh);
  EXPECT_TRUE(t.mesh.tetrahedral());
  ASSERT_EQ(t.parent.size(), t.mesh.cell_count());
  EXPECT_TRUE(std::is_sorted(t.parent.begin(), t.parent.end()));
  std::size_t exterior = 0;
  for (Id face = 0; face < t.mesh.face_count(); ++face) {
    exterior += t.mesh.exterior(face) ? 1 : 0;
  }
  EXPECT_EQ(exterior, 6U * 36U * 2U) << "every inner face is shared";
  EXPECT_EQ(t.mesh.points, mesh.points);
  double volume = 0.0;
  for (Id cell = 0; cell < t.mesh.cell_count(); ++cell) {
    const auto v = t.mesh.vertices(cell);
    const double six = sixVolumes(t.mesh, {v[0], v[1], v[2], v[3]});
    EXPECT_GT(six, 0.0);
    volume += six / 6.0;
    EXPECT_EQ(t.mesh.cell_file_id[cell], mesh.cell_file_id[t.parent[cell]]);
  }
  EXPECT_NEAR(volume, 216.0, 1e-9);
}

TEST(Tetrahedralize, differentCellsAgreeOnTheDiagonalOfTheirFace) {
  // A hexahedron with a pyramid on one face and a wedge on the next.
  Source source;
  source.points = cube;
  source.points.insert(source.points.end(), {{0.5, 0.5, 2}, {2, 0, 0.5}, {2, 1, 0.5}});
  source.types = {vtk_cell::hexahedron, vtk_cell::pyramid, vtk_cell::wedge};
  source.connectivity = {0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 6, 7, 8, 1, 5, 9, 2, 6, 10};
  source.offsets = {0, 8, 13, 19};
  const Tetrahedralization t = tetrahedralize(build(source));
  std::size_t exterior = 0;
  for (Id face = 0; face < t.mesh.face_count(); ++face) {
    exterior += t.mesh.exterior(face) ? 1 : 0;
  }
  EXPECT_EQ(exterior, 4U * 2U + 4U + 2U + 2U * 2U);
}

TEST(Tetrahedralize, dropsFlatTetrahedra) {
  // A wedge whose far edge lies in the plane of a side: a pyramid drawn as a wedge without repeated ids.
  const Mesh mesh = oneCellMesh(CellType::wedge, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {0, 0.5, 1}},
                                {0, 1, 2, 3, 4, 5});
  std::vector<Tetrahedron> pieces;
  tetrahedra(mesh, 0, pieces);
  EXPECT_EQ(pieces.size(), 3U);
  const Tetrahedralization t = tetrahedralize(mesh);
  EXPECT_LT(t.mesh.cell_count(), 3U);
  for (Id cell = 0; cell < t.mesh.cell_count(); ++cell) {
    const auto v = t.mesh.vertices(cell);
    EXPECT_GT(sixVolumes(t.mesh, {v[0], v[1], v[2], v[3]}), 0.0);
  }
}

}  // namespace
}  // namespace spillikin::mesh
