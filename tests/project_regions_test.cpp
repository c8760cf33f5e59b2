// The regions of convex cells: they tile the projection, their thickness holds the volume, their scalars are the
// field's, in general position and in every alignment that makes points, edges or faces coincide on the screen.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <random>
#include <set>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/subdivide.h"
#include "spillikin/project/cell_projection.h"
#include "spillikin/project/tetrahedron_projection.h"
#include "tests/support/meshes.h"
#include "tests/support/projection_checks.h"

namespace spillikin::project {
namespace {

using mesh::Mesh;
using tests::oneCell;
namespace cells = mesh::vtk_cell;

View viewFrom(const Vec3& eye, bool parallel, const Vec3& target = Vec3(0.0)) {
  View view;
  view.eye = eye;
  view.target = target;
  const Vec3 sight = glm::normalize(target - eye);
  view.up = std::fabs(sight.y) < 0.9 ? Vec3(0.0, 1.0, 0.0) : Vec3(0.0, 0.0, 1.0);
  view.view_angle = 40.0;
  view.parallel_scale = parallel ? 3.0 : 0.0;
  view.width = 600;
  view.height = 500;
  return view;
}

Regions project(const Mesh& mesh, const mesh::Field& field, const Camera& camera, Faces faces = Faces::triangles) {
  std::vector<Vec3> screen;
  screenPoints(mesh, camera, screen);
  CellProjector projector(mesh, camera, screen, faces);
  Regions regions;
  for (mesh::Id cell = 0; cell < mesh.cell_count(); ++cell) {
    projector(cell, field, regions);
  }
  return regions;
}

// What must hold for the regions of one convex cell that lies in the image, whatever the field is at its vertices.
std::string fault(const Mesh& mesh, const Camera& camera, Faces faces) {
  const Vec3 gradient(0.3, -0.7, 0.45);
  const mesh::Field field = tests::linearField(mesh, gradient, 2.0);
  const Regions regions = project(mesh, field, camera, faces);
  const double hull = tests::hullArea(mesh, 0, camera);
  if (std::fabs(tests::area(regions) - hull) > 1e-9 * hull) {
    return fmt::format("area {} instead of the hull's {}", tests::area(regions), hull);
  }
  const double whole = tests::cellVolume(mesh, 0);
  if (std::fabs(tests::volume(regions, camera) - whole) > (camera.parallel() ? 1e-9 : 1e-7) * whole) {
    return fmt::format("volume {} instead of {}", tests::volume(regions, camera), whole);
  }
  for (std::size_t p = 0; p < regions.polygons(); ++p) {
    if (tests::area(regions, p) < -1e-9) {
      return fmt::format("polygon {} runs clockwise", p);
    }
    for (std::size_t v = regions.offset[p]; v < regions.offset[p + 1]; ++v) {
      const Vec3 origin = camera.origin(regions.x[v], regions.y[v]);
      const Vec3 direction = camera.direction(regions.x[v], regions.y[v]);
      const auto exact = [&](double depth) { return glm::dot(gradient, origin + depth * direction) + 2.0; };
      const double off = std::max(std::fabs(regions.front[v] - exact(regions.front_depth[v])),
                                  std::fabs(regions.back[v] - exact(regions.back_depth[v])));
      if (off > 1e-9) {
        return fmt::format("a linear field is off by {} at vertex {} of polygon {}", off, v - regions.offset[p], p);
      }
      const double length = (regions.back_depth[v] - regions.front_depth[v]) * glm::length(direction);
      if (regions.thickness[v] < 0.0 || std::fabs(regions.thickness[v] - length) > 1e-9) {
        return fmt::format("thickness {} between depths that are {} apart", regions.thickness[v], length);
      }
    }
  }
  return "";
}

std::vector<Vec3> randomPolyhedron(std::mt19937_64& random, int points) {
  std::normal_distribution<double> normal;
  std::vector<Vec3> corners;
  for (int k = 0; k < points; ++k) {
    const double x = normal(random);
    const double y = normal(random);
    corners.push_back(glm::normalize(Vec3(x, y, normal(random))));
  }
  return corners;
}

Vec3 randomEye(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random);
  const double y = normal(random);
  return 5.0 * glm::normalize(Vec3(x, y, normal(random)));
}

const std::vector<Vec3> box{{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                            {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
const std::vector<Vec3> wedge{{-1, -1, -1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}, {-1, 1, 1}, {1, -1, 1}};
const std::vector<Vec3> pyramid{{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {0, 0, 1}};
const std::vector<Vec3> octahedron{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

class RegionsOf : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Views, RegionsOf, testing::Bool(),
                         [](const auto& parameter) { return parameter.param ? "parallel" : "perspective"; });

TEST_P(RegionsOf, randomPolyhedraTileTheirProjection) {
  const std::uint64_t seed = 31;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 150; ++i) {
    const Mesh mesh = mesh::build(oneCell(cells::polyhedron, randomPolyhedron(random, 4 + i % 17)));
    const Camera camera(viewFrom(randomEye(random), GetParam()));
    ASSERT_EQ(fault(mesh, camera, Faces::triangles), "") << "polyhedron " << i;
    ASSERT_EQ(fault(mesh, camera, Faces::planar), "") << "polyhedron " << i;
  }
}

// Every direction with components in -2 .. 2: along axes, along diagonals of faces and of space, and between them.
TEST_P(RegionsOf, alignedCellsTileTheirProjection) {
  const std::map<std::string, Mesh> meshes{
      {"box", mesh::build(oneCell(cells::hexahedron, box))},
      {"wedge", mesh::build(oneCell(cells::wedge, wedge))},
      {"pyramid", mesh::build(oneCell(cells::pyramid, pyramid))},
      {"octahedron", mesh::build(oneCell(cells::polyhedron, octahedron))},
      {"box as polyhedron", mesh::build(oneCell(cells::polyhedron, box))},
      {"tetrahedron", mesh::build(oneCell(cells::tetra, {box[0], box[2], box[5], box[7]}))},
      {"corner", mesh::build(oneCell(cells::tetra, {box[0], box[1], box[3], box[4]}))}};
  for (const auto& [name, mesh] : meshes) {
    for (int x = -2; x <= 2; ++x) {
      for (int y = -2; y <= 2; ++y) {
        for (int z = -2; z <= 2; ++z) {
          if (x == 0 && y == 0 && z == 0) {
            continue;
          }
          const Vec3 eye = Vec3(x, y, z) * (GetParam() ? 1.0 : 3.0);
          const Camera camera(viewFrom(eye, GetParam()));
          for (const Faces faces : {Faces::triangles, Faces::planar}) {
            ASSERT_EQ(fault(mesh, camera, faces), "") << name << " from " << x << " " << y << " " << z;
          }
        }
      }
    }
  }
}

// Eyes in the plane of a face (edge-on) or on the line of an edge (seen as a point).
TEST(RegionsInPerspective, fromThePlaneOfAFaceAndTheLineOfAnEdge) {
  const Mesh mesh = mesh::build(oneCell(cells::hexahedron, box));
  for (const Vec3& eye : {Vec3(1, 0.3, 5), Vec3(1, 1, 5), Vec3(1, 5, 0.2), Vec3(5, 5, 1), Vec3(-1, -1, -4)}) {
    View view = viewFrom(eye, false, eye - Vec3(0, 0, eye.z > 0 ? 1 : -1));
    view.view_angle = 100.0;
    if (std::fabs(eye.z) < 2.0) {
      view.target = Vec3(0.0);
      view.up = Vec3(0.0, 0.0, 1.0);
      view.view_angle = 60.0;
    }
    const Camera camera(view);
    for (const Faces faces : {Faces::triangles, Faces::planar}) {
      EXPECT_EQ(fault(mesh, camera, faces), "") << eye.x << " " << eye.y << " " << eye.z;
    }
  }
}

TEST(Regions, aBoxSeenAlongAnAxisIsOneRectangleOfItsDepth) {
  const Mesh mesh = mesh::build(oneCell(cells::hexahedron, box));
  const Regions regions =
      project(mesh, tests::linearField(mesh, {0, 0, 1}, 0.0), Camera(viewFrom({0, 0, 5}, true)), Faces::planar);
  ASSERT_EQ(regions.polygons(), 1U);
  ASSERT_EQ(regions.vertices(), 4U);
  for (std::size_t v = 0; v < 4; ++v) {
    EXPECT_EQ(regions.front_depth[v], 4.0);
    EXPECT_EQ(regions.back_depth[v], 6.0);
    EXPECT_EQ(regions.thickness[v], 2.0);
    EXPECT_EQ(regions.front[v], 1.0);
    EXPECT_EQ(regions.back[v], -1.0);
  }
}

// The ways to count the vertices that draw a set of polygons.
struct VertexCounts {
  std::size_t corners = 0;         // polygon by polygon, as OpenGL's polygons and fans from a corner are sent
  std::size_t separate = 0;        // as single triangles of fans from a corner
  std::size_t about_centre = 0;    // as fans about a point inside, left open
  std::size_t closed = 0;          // the same, with the first corner again at the end
  std::size_t front_and_back = 0;  // corners, those with a thickness at the front and again at the back
  bool operator==(const VertexCounts&) const = default;
};
VertexCounts verticesOf(const Regions& regions) {
  VertexCounts n;
  for (std::size_t p = 0; p < regions.polygons(); ++p) {
    const std::size_t size = regions.offset[p + 1] - regions.offset[p];
    n.corners += size;
    n.separate += 3 * (size - 2);
    n.about_centre += size + 1;
    n.closed += size + 2;
    for (std::size_t v = regions.offset[p]; v < regions.offset[p + 1]; ++v)
      n.front_and_back += regions.thickness[v] > 1e-12 ? 2U : 1U;
  }
  return n;
}

// The paper's Figure 4: five quadrilaterals and two triangles, against 22 triangles of the six tetrahedra. The paper
// gives the seven polygons "a total of 41 vertices (counting repetitions, as would be necessary in OpenGL polygon
// calls)" and the 22 triangles 66. Counting repetitions, five quadrilaterals and two triangles have 5 * 4 + 2 * 3 = 26
// corners, and by Euler's formula so has every subdivision of a hexagon into seven polygons by two crossings; no other
// way of sending them gives 41 either. The 66 are corners counted in the same way, so that 26 stands against them.
TEST(Regions, theCubeOfFigure4IsSevenPolygonsAgainstTwentyTwo) {
  const Mesh cube = mesh::build(oneCell(cells::hexahedron, box));
  mesh::Field field = tests::linearField(cube, {1, 2, 3}, 0.0);
  const Mesh six = mesh::build(tests::tetrahedronGrid(1));
  const mesh::Field six_field = tests::linearField(six, {1, 2, 3}, 0.0);
  ASSERT_EQ(six.cell_count(), 6U);
  const Vec3 direction(1.0, 1.7, 4.0);
  for (const bool parallel : {true, false}) {
    const Regions whole = project(cube, field, Camera(viewFrom(2.0 * direction, parallel)), Faces::planar);
    EXPECT_EQ(whole.polygons(), 7U);
    std::map<std::size_t, int> sizes;
    for (std::size_t p = 0; p < whole.polygons(); ++p) {
      ++sizes[whole.offset[p + 1] - whole.offset[p]];
    }
    EXPECT_EQ(sizes, (std::map<std::size_t, int>{{3, 2}, {4, 5}}));
    EXPECT_EQ(verticesOf(whole), (VertexCounts{26, 36, 33, 40, 40}));
    EXPECT_EQ(whole.vertices(), 26U);

    const Vec3 centre(0.5);
    const Regions cut = project(six, six_field, Camera(viewFrom(centre + direction, parallel, centre)), Faces::planar);
    EXPECT_EQ(cut.polygons(), 22U);
    EXPECT_EQ(verticesOf(cut).corners, 66U);
  }
}

// A region as a set of vertices, for comparison whatever the order.
using Key = std::vector<std::array<double, 7>>;
std::vector<Key> keys(const Regions& r) {
  std::vector<Key> all;
  for (std::size_t p = 0; p < r.polygons(); ++p) {
    Key key;
    const auto rounded = [](double v) { return std::round(v * 1e7) / 1e7 + 0.0; };
    for (std::size_t v = r.offset[p]; v < r.offset[p + 1]; ++v) {
      key.push_back({rounded(r.x[v]), rounded(r.y[v]), rounded(r.front_depth[v]), rounded(r.back_depth[v]),
                     rounded(r.thickness[v]), rounded(r.front[v]), rounded(r.back[v])});
    }
    std::sort(key.begin(), key.end());
    key.push_back({static_cast<double>(r.front_triangle[p]), static_cast<double>(r.back_triangle[p])});
    all.push_back(key);
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::string difference(const Regions& a, const Regions& b) {
  const auto ka = keys(a);
  const auto kb = keys(b);
  if (ka.size() != kb.size()) {
    return fmt::format("{} regions instead of {}", ka.size(), kb.size());
  }
  for (std::size_t p = 0; p < ka.size(); ++p) {
    if (ka[p].size() != kb[p].size()) {
      return "regions with other numbers of vertices";
    }
    for (std::size_t v = 0; v < ka[p].size(); ++v) {
      for (std::size_t k = 0; k < 7; ++k) {
        if (std::fabs(ka[p][v][k] - kb[p][v][k]) > 1e-6) {
          return fmt::format("region {}: {} instead of {} (attribute {})", p, ka[p][v][k], kb[p][v][k], k);
        }
      }
    }
  }
  return "";
}

// Projects a tetrahedron both ways; returns its number of regions.
std::size_t compareBothWays(const std::vector<Vec3>& corners, const View& view, std::string& wrong) {
  const Mesh mesh = mesh::build(oneCell(cells::tetra, corners));
  const mesh::Field field = tests::pointField({0.3, 1.7, -0.4, 2.2});
  const Camera camera(view);
  std::vector<Vec3> screen;
  screenPoints(mesh, camera, screen);
  CellOnScreen cell;
  cell.setCorners(mesh, camera, screen, field, 0);
  cell.setTriangles(mesh);
  Regions fast;
  Regions general;
  projectTetrahedron(cell, camera, fast);
  PolyhedronProjection polyhedron;
  if (!polyhedron(cell, camera, Faces::triangles, general)) {
    wrong = "the general way finds no convex body";
  } else {
    wrong = difference(fast, general);
  }
  return fast.polygons();
}

TEST_P(RegionsOf, tetrahedraOfAllClassesAreTheSameBothWays) {
  const std::uint64_t seed = 37;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::map<std::size_t, int> classes;
  std::string wrong;
  for (int i = 0; i < 300; ++i) {
    const std::vector<Vec3> corners = randomPolyhedron(random, 4);
    ++classes[compareBothWays(corners, viewFrom(randomEye(random), GetParam()), wrong)];
    ASSERT_EQ(wrong, "") << "tetrahedron " << i;
  }
  EXPECT_GT(classes[3], 20) << "a corner inside";
  EXPECT_GT(classes[4], 20) << "two edges cross";
}

TEST(RegionsOfTetrahedra, alignedOnesAreTheSameBothWaysInEveryClass) {
  const std::uint64_t seed = 41;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::map<std::size_t, int> classes;
  std::string wrong;
  for (int i = 0; i < 1500; ++i) {
    std::vector<Vec3> corners;
    for (int k = 0; k < 4; ++k) {
      const double x = static_cast<double>(random() % 3) - 1.0;
      const double y = static_cast<double>(random() % 3) - 1.0;
      corners.emplace_back(x, y, static_cast<double>(random() % 3) - 1.0);
    }
    const Vec3 u = corners[1] - corners[0];
    if (glm::dot(glm::cross(u, corners[2] - corners[0]), corners[3] - corners[0]) == 0.0) {
      continue;
    }
    View view = viewFrom({0, 0, 5}, true);
    view.height = 512;  // powers of two: the screen is as aligned as the mesh
    view.parallel_scale = 4.0;
    const std::size_t regions = compareBothWays(corners, view, wrong);
    ++classes[regions];
    ASSERT_EQ(wrong, "") << "tetrahedron " << i;
    ASSERT_EQ(fault(mesh::build(oneCell(cells::tetra, corners)), Camera(view), Faces::triangles), "") << i;
  }
  for (const std::size_t regions : {1U, 2U, 3U, 4U}) {
    EXPECT_GT(classes[regions], 10) << regions << " regions";
  }
}

TEST(Regions, aConstantFieldIsThatConstantToTheBit) {
  const std::uint64_t seed = 43;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  const double value = 0.1;
  for (int i = 0; i < 60; ++i) {
    const Mesh mesh = mesh::build(oneCell(cells::polyhedron, randomPolyhedron(random, 4 + i % 9)));
    View view = viewFrom(randomEye(random) * (i % 2 == 0 ? 1.0 : 0.1), i % 3 == 0);
    if (i % 4 == 0) {
      view.clips = {{Vec3(0.0), Vec3(0.3, 0.5, 1.0)}};
    }
    const Camera camera(view);
    for (const mesh::Field& field :
         {tests::pointField(std::vector<double>(mesh.points.size(), value)), tests::cellField({value})}) {
      const Regions regions = project(mesh, field, camera);
      for (std::size_t v = 0; v < regions.vertices(); ++v) {
        ASSERT_EQ(regions.front[v], value);
        ASSERT_EQ(regions.back[v], value);
      }
    }
  }
}

TEST(Regions, profileVerticesHaveNoThickness) {
  const std::uint64_t seed = 47;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 40; ++i) {
    const Mesh mesh = mesh::build(oneCell(cells::polyhedron, randomPolyhedron(random, 8)));
    const Camera camera(viewFrom(randomEye(random), i % 2 == 0));
    const Regions regions = project(mesh, tests::linearField(mesh, {1, 0, 0}, 0.0), camera);
    double left = regions.x[0];
    for (const double x : regions.x) {
      left = std::min(left, x);
    }
    for (std::size_t v = 0; v < regions.vertices(); ++v) {
      if (regions.x[v] == left) {
        EXPECT_EQ(regions.thickness[v], 0.0);
        EXPECT_EQ(regions.front[v], regions.back[v]);
      }
    }
  }
}

// A mesh's cells tile it: the volume of all regions is the mesh's, whichever way its cells are projected.
TEST_P(RegionsOf, aWholeMeshHoldsItsVolume) {
  const Mesh mesh = mesh::build(tests::hexahedronGrid(4));
  const mesh::Field field = tests::linearField(mesh, {1, 1, 1}, 0.0);
  View view = viewFrom(Vec3(9, 13, 19), GetParam(), Vec3(2.0));
  view.parallel_scale = GetParam() ? 6.0 : 0.0;
  const Camera camera(view);
  EXPECT_NEAR(tests::volume(project(mesh, field, camera, Faces::planar), camera), 64.0, 1e-6);
  EXPECT_NEAR(tests::volume(project(mesh, field, camera), camera), 64.0, 1e-6);
  const mesh::Tetrahedralization cut = mesh::tetrahedralize(mesh);
  EXPECT_NEAR(tests::volume(project(cut.mesh, field, camera), camera), 64.0, 1e-6);
  const Mesh curved = mesh::build(tests::hexahedronGrid(4, 0.25, 83));
  EXPECT_NEAR(tests::volume(project(curved, tests::linearField(curved, {1, 1, 1}, 0.0), camera), camera), 64.0, 1e-5)
      << "cells that are not convex, seed 83";
}

TEST(Regions, cellsOutsideTheImageGiveNone) {
  const Mesh mesh = mesh::build(oneCell(cells::hexahedron, box));
  const mesh::Field field = tests::linearField(mesh, {1, 0, 0}, 0.0);
  View beside = viewFrom({0, 0, 5}, false, {9, 0, 0});
  beside.view_angle = 20.0;
  EXPECT_EQ(project(mesh, field, Camera(beside)).polygons(), 0U);
  EXPECT_EQ(project(mesh, field, Camera(viewFrom({0, 0, 5}, false, {0, 0, 10}))).polygons(), 0U) << "behind the eye";
  View behind_in_parallel = viewFrom({0, 0, -9}, true, {0, 0, -10});
  EXPECT_GT(project(mesh, field, Camera(behind_in_parallel)).polygons(), 0U) << "a parallel view has no eye plane";
}

}  // namespace
}  // namespace spillikin::project
