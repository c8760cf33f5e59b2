// Cells trimmed by the eye plane, clip planes and the half-spaces of a cut, and cells that are not convex: against rays
// cast by brute force. Trimming shortens the segment and leaves the field along the whole one as it is.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "spillikin/mesh/build.h"
#include "spillikin/project/cell_projection.h"
#include "tests/support/meshes.h"
#include "tests/support/projection_checks.h"

namespace spillikin::project {
namespace {

using mesh::Mesh;
using tests::oneCell;
using tests::RayInterval;
namespace cells = mesh::vtk_cell;

// Rays this close to an edge on the screen are left to either side.
constexpr double margin = 1e-7;  // pixels

struct Tally {
  std::size_t rays = 0, hits = 0, doubles = 0;
};

std::vector<sort::HalfSpace> planesOf(const Camera& camera, std::span<const sort::HalfSpace> keep) {
  std::vector<sort::HalfSpace> planes;
  for (const ClipPlane& clip : camera.view().clips) {
    planes.push_back({clip.normal, -glm::dot(clip.normal, clip.point)});
  }
  planes.insert(planes.end(), keep.begin(), keep.end());
  return planes;
}

struct Trimmed {
  RayInterval whole;
  double near, far;
};

// What is left of each interval between the planes and, in perspective, in front of the eye.
std::vector<Trimmed> trim(const std::vector<RayInterval>& intervals, const Camera& camera,
                          std::span<const sort::HalfSpace> planes, double x, double y) {
  std::vector<Trimmed> left;
  for (const RayInterval& interval : intervals) {
    double near = camera.parallel() ? interval.near : std::max(interval.near, 0.0);
    double far = interval.far;
    for (const auto& [normal, offset] : planes) {
      const double at_origin = glm::dot(normal, camera.origin(x, y)) + offset;
      const double slope = glm::dot(normal, camera.direction(x, y));
      if (slope > 0.0) {
        near = std::max(near, -at_origin / slope);
      } else if (slope < 0.0) {
        far = std::min(far, -at_origin / slope);
      } else if (at_origin < 0.0) {
        far = near;
      }
    }
    if (far > near + 1e-9) {
      left.push_back({interval, near, far});
    }
  }
  return left;
}

// Casts rays at random positions of the image and at positions just inside the regions' vertices.
std::string fault(const Mesh& mesh, const mesh::Field& field, const Camera& camera, std::mt19937_64& random,
                  Tally& tally, std::span<const sort::HalfSpace> keep = {}) {
  std::vector<Vec3> screen;
  screenPoints(mesh, camera, screen);
  CellProjector projector(mesh, camera, screen);
  Regions regions;
  projector(0, field, regions, keep);
  const auto planes = planesOf(camera, keep);

  constexpr std::size_t none = ~std::size_t{0};
  struct Ray {
    double x, y;
    std::size_t vertex;  // the one that the ray passes next to
  };
  std::vector<Ray> rays;
  std::uniform_real_distribution<double> px(0.0, camera.width());
  std::uniform_real_distribution<double> py(0.0, camera.height());
  for (int i = 0; i < 60; ++i) {
    const double x = px(random);
    rays.push_back({x, py(random), none});
  }
  for (std::size_t p = 0; p < regions.polygons(); ++p) {
    if (tests::area(regions, p) < 0.0) {
      return "a polygon runs clockwise";
    }
    double cx = 0.0;
    double cy = 0.0;
    const auto [begin, end] = std::pair{regions.offset[p], regions.offset[p + 1]};
    for (std::size_t v = begin; v < end; ++v) {
      cx += regions.x[v] / (end - begin);
      cy += regions.y[v] / (end - begin);
    }
    for (std::size_t v = begin; v < end; ++v) {
      const double near = 1.0 - 1e-5;
      rays.push_back({cx + near * (regions.x[v] - cx), cy + near * (regions.y[v] - cy), v});
    }
  }

  for (const auto& [x, y, vertex] : rays) {
    if (x < 0.0 || y < 0.0 || x > camera.width() || y > camera.height()) {
      continue;
    }
    const auto expected = trim(tests::castRay(mesh, field, 0, camera, x, y), camera, planes, x, y);
    std::size_t found = 0;
    bool on_border = false;
    for (std::size_t p = 0; p < regions.polygons(); ++p) {
      const bool inside = tests::contains(regions, p, x, y, margin);
      on_border = on_border || (!inside && tests::contains(regions, p, x, y, -margin));
      if (!inside) {
        continue;
      }
      ++found;
      const double near = tests::depthAt(regions, regions.front_depth, p, x, y, camera.parallel());
      const double far = tests::depthAt(regions, regions.back_depth, p, x, y, camera.parallel());
      const auto match = std::find_if(expected.begin(), expected.end(), [&](const Trimmed& t) {
        return std::fabs(t.near - near) < 1e-6 && std::fabs(t.far - far) < 1e-6;
      });
      if (match == expected.end()) {
        return fmt::format("at {}, {} no interval from {} to {} ({} expected{})", x, y, near, far, expected.size(),
                           expected.empty() ? "" : fmt::format(", first {} to {}", expected[0].near, expected[0].far));
      }
      const double front = tests::along(match->whole, match->near);
      const double back = tests::along(match->whole, match->far);
      const bool thin = match->whole.far - match->whole.near < 0.05;  // the line's slope is lost
      // On a triangle the scalar is known everywhere in the region; on a plane that trims, at its vertices.
      const auto off = [&](const std::vector<double>& value, const std::vector<double>& depth, std::int32_t end_of,
                           double exact) {
        if (end_of == ends_at_triangle) {
          return std::fabs(tests::valueAt(regions, value, depth, p, x, y, camera.parallel()) - exact) > 1e-5;
        }
        const bool next_to = vertex != none && vertex >= regions.offset[p] && vertex < regions.offset[p + 1];
        return next_to && !thin && std::fabs(value[vertex] - exact) > 2e-3;
      };
      if (off(regions.front, regions.front_depth, regions.front_end[p], front) ||
          off(regions.back, regions.back_depth, regions.back_end[p], back)) {
        return fmt::format("at {}, {} the scalars are not {}, {}", x, y, front, back);
      }
    }
    const bool close =
        std::any_of(expected.begin(), expected.end(), [](const Trimmed& t) { return t.far - t.near < 1e-4; });
    if (!on_border && !close && found != expected.size()) {
      return fmt::format("at {}, {} there are {} regions for {} intervals", x, y, found, expected.size());
    }
    ++tally.rays;
    tally.hits += found > 0 ? 1 : 0;
    tally.doubles += found > 1 ? 1 : 0;
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

Vec3 randomVector(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const double x = uniform(random);
  const double y = uniform(random);
  return {x, y, uniform(random)};
}

mesh::Field randomField(const Mesh& mesh, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> values;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    values.push_back(uniform(random));
  }
  return tests::pointField(values);
}

View looking(const Vec3& eye, const Vec3& sight, bool parallel) {
  View view;
  view.eye = eye;
  view.target = eye + sight;
  view.up = std::fabs(glm::normalize(sight).y) < 0.9 ? Vec3(0, 1, 0) : Vec3(1, 0, 0);
  view.view_angle = 70.0;
  view.parallel_scale = parallel ? 1.3 : 0.0;
  view.width = 320;
  view.height = 240;
  return view;
}

Mesh randomCell(std::mt19937_64& random, int i) {
  return mesh::build(i % 3 == 0 ? oneCell(cells::tetra, randomPolyhedron(random, 4))
                                : oneCell(cells::polyhedron, randomPolyhedron(random, 5 + i % 9)));
}

TEST(Trimmed, theEyeInsideACell) {
  const std::uint64_t seed = 53;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  Tally tally;
  for (int i = 0; i < 120; ++i) {
    const Mesh mesh = randomCell(random, i);
    Vec3 eye(0.0);
    for (const Vec3& p : mesh.points) {
      eye += p / static_cast<double>(mesh.points.size());
    }
    eye += 0.05 * randomVector(random);
    const Camera camera(looking(eye, randomVector(random), false));
    ASSERT_EQ(fault(mesh, randomField(mesh, random), camera, random, tally), "") << "cell " << i;
  }
  EXPECT_GT(static_cast<double>(tally.hits), 0.9 * static_cast<double>(tally.rays));
}

TEST(Trimmed, theEyeBesideOrBeforeACellThatCrossesItsPlane) {
  const std::uint64_t seed = 59;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  Tally tally;
  for (int i = 0; i < 200; ++i) {
    const Mesh mesh = randomCell(random, i);
    const Camera camera(looking(1.2 * randomVector(random), randomVector(random), false));
    ASSERT_EQ(fault(mesh, randomField(mesh, random), camera, random, tally), "") << "cell " << i;
  }
  EXPECT_GT(tally.hits, tally.rays / 10);
}

TEST(Trimmed, clipPlanesAndTheHalfSpacesOfACut) {
  const std::uint64_t seed = 61;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  Tally tally;
  for (int i = 0; i < 200; ++i) {
    const Mesh mesh = randomCell(random, i);
    const bool parallel = i % 2 == 0;
    const Vec3 sight = randomVector(random);
    View view = looking(-3.0 * glm::normalize(sight), sight, parallel);
    for (int k = 0; k < i % 4; ++k) {
      view.clips.push_back({0.4 * randomVector(random), randomVector(random)});
    }
    std::vector<sort::HalfSpace> keep;
    if (i % 3 == 0) {
      keep.push_back({randomVector(random), 0.2});
      keep.push_back({-keep[0].normal, 0.1});
    }
    ASSERT_EQ(fault(mesh, randomField(mesh, random), Camera(view), random, tally, keep), "") << "cell " << i;
  }
  EXPECT_GT(tally.hits, tally.rays / 10);
}

TEST(Trimmed, clipPlanesInsideACellWithTheEye) {
  const std::uint64_t seed = 67;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  Tally tally;
  for (int i = 0; i < 100; ++i) {
    const Mesh mesh = randomCell(random, i);
    View view = looking(0.2 * randomVector(random), randomVector(random), false);
    view.clips = {{0.3 * randomVector(random), randomVector(random)},
                  {0.3 * randomVector(random), randomVector(random)}};
    ASSERT_EQ(fault(mesh, randomField(mesh, random), Camera(view), random, tally), "") << "cell " << i;
  }
}

TEST(Trimmed, planesSeenEdgeOnAndAlongTheSight) {
  const std::uint64_t seed = 71;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  Tally tally;
  const Mesh mesh = mesh::build(
      oneCell(cells::hexahedron,
              {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}));
  const mesh::Field field = randomField(mesh, random);
  for (const bool parallel : {false, true}) {
    for (const Vec3& normal : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(1, 1, 0)}) {
      View view = looking({0, 0, 4}, {0, 0, -1}, parallel);
      view.clips = {{Vec3(0.0), normal}};
      ASSERT_EQ(fault(mesh, field, Camera(view), random, tally), "") << normal.x << " " << normal.y << " " << normal.z;
    }
  }
}

TEST(Trimmed, aPlaneThatLeavesNothingOrEverything) {
  const Mesh mesh = mesh::build(oneCell(cells::tetra, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  const mesh::Field field = tests::linearField(mesh, {1, 0, 0}, 0.0);
  View view = looking({0.2, 0.3, 4}, {0, 0, -1}, true);
  const auto polygons = [&] {
    const Camera camera(view);
    std::vector<Vec3> screen;
    screenPoints(mesh, camera, screen);
    CellProjector projector(mesh, camera, screen);
    Regions regions;
    projector(0, field, regions);
    return regions.polygons();
  };
  const std::size_t whole = polygons();
  EXPECT_GT(whole, 0U);
  view.clips = {{Vec3(-1.0), Vec3(1.0)}};
  EXPECT_EQ(polygons(), whole);
  view.clips = {{Vec3(0.0), Vec3(1.0)}};
  EXPECT_EQ(polygons(), whole) << "a plane that only touches a corner trims nothing";
  view.clips = {{Vec3(0.0), Vec3(-1.0)}};
  EXPECT_EQ(polygons(), 0U);
}

// Twisted hexahedra: creased faces through which a ray may leave and come back.
TEST(NotConvex, everyIntervalOfARayHasItsRegion) {
  const std::uint64_t seed = 73;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  Tally tally;
  for (int i = 0; i < 150; ++i) {
    std::vector<Vec3> corners{{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                              {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    for (Vec3& p : corners) {
      p = 0.6 * (p + 0.35 * randomVector(random));
    }
    const Mesh mesh = mesh::build(oneCell(cells::hexahedron, corners));
    const Vec3 sight = randomVector(random);
    View view = looking(-3.0 * glm::normalize(sight), sight, i % 2 == 0);
    if (i % 5 == 0) {
      view.clips = {{0.2 * randomVector(random), randomVector(random)}};
    }
    if (i % 7 == 0) {
      view.parallel_scale = 0.0;
      view.eye = 0.3 * randomVector(random);
    }
    ASSERT_EQ(fault(mesh, randomField(mesh, random), Camera(view), random, tally), "") << "cell " << i;
  }
  EXPECT_GT(tally.doubles, 20U) << "some rays cross a cell twice";
}

// From the middle of a mesh of curved cells every ray is covered from the eye to the mesh's border, without gap or
// overlap: cells around the eye, cells beside it and whole ones together.
TEST(Trimmed, theEyeInsideAMesh) {
  const std::uint64_t seed = 79;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  const double side = 4.0;
  for (const Mesh& mesh :
       {mesh::build(tests::hexahedronGrid(4, 0.2, seed)), mesh::build(tests::tetrahedronGrid(4, 0.15, seed))}) {
    const mesh::Field field = randomField(mesh, random);
    for (int view = 0; view < 3; ++view) {
      const Camera camera(looking(Vec3(2.0) + 0.9 * randomVector(random), randomVector(random), false));
      std::vector<Vec3> screen;
      screenPoints(mesh, camera, screen);
      CellProjector projector(mesh, camera, screen);
      Regions regions;
      for (mesh::Id cell = 0; cell < mesh.cell_count(); ++cell) {
        projector(cell, field, regions);
      }
      std::uniform_real_distribution<double> px(0.0, camera.width());
      std::uniform_real_distribution<double> py(0.0, camera.height());
      for (int ray = 0; ray < 60; ++ray) {
        const double x = px(random);
        const double y = py(random);
        const Vec3 eye = camera.origin(x, y);
        const Vec3 direction = camera.direction(x, y);
        double leaves = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
          leaves = std::min(leaves, ((direction[axis] > 0.0 ? side : 0.0) - eye[axis]) / direction[axis]);
        }
        double covered = 0.0;
        bool on_border = false;
        for (std::size_t p = 0; p < regions.polygons(); ++p) {
          if (tests::contains(regions, p, x, y, margin)) {
            covered += tests::depthAt(regions, regions.back_depth, p, x, y, false) -
                       tests::depthAt(regions, regions.front_depth, p, x, y, false);
          } else {
            on_border = on_border || tests::contains(regions, p, x, y, -margin);
          }
        }
        if (!on_border) {
          ASSERT_NEAR(covered, leaves, 1e-7) << "view " << view << " ray " << ray;
        }
      }
    }
  }
}

}  // namespace
}  // namespace spillikin::project
