// The generated meshes are what their comments say: counts, volumes, closed surfaces, no point left over.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>

#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

double tetrahedronVolume(const mesh::Source& s, std::size_t cell) {
  const auto* id = s.connectivity.data() + s.offsets[cell];
  const Vec3& a = s.points[id[0]];
  return glm::dot(glm::cross(s.points[id[1]] - a, s.points[id[2]] - a), s.points[id[3]] - a) / 6.0;
}

struct Summary {
  double volume = 0.0;
  std::size_t exterior = 0, crowded = 0, flat = 0;
  std::size_t unused = 0;
  long euler = 0;  // of the exterior surface
};

Summary summary(const mesh::Source& source) {
  Summary result;
  std::map<std::array<std::uint32_t, 3>, int> faces;
  std::vector<char> used(source.points.size(), 0);
  for (std::size_t cell = 0; cell < source.types.size(); ++cell) {
    EXPECT_EQ(source.types[cell], mesh::vtk_cell::tetra);
    const double volume = std::fabs(tetrahedronVolume(source, cell));
    result.volume += volume;
    result.flat += volume < 1e-14 ? 1 : 0;
    const auto* id = source.connectivity.data() + source.offsets[cell];
    for (int skip = 0; skip < 4; ++skip) {
      std::array<std::uint32_t, 3> face{};
      for (int k = 0, out = 0; k < 4; ++k) {
        used[id[k]] = 1;
        if (k != skip) {
          face[static_cast<std::size_t>(out++)] = id[k];
        }
      }
      std::sort(face.begin(), face.end());
      ++faces[face];
    }
  }
  std::map<std::array<std::uint32_t, 2>, int> edges;
  std::map<std::uint32_t, int> corners;
  for (const auto& [face, count] : faces) {
    result.crowded += count > 2 ? 1 : 0;
    if (count == 1) {
      ++result.exterior;
      ++edges[{face[0], face[1]}], ++edges[{face[0], face[2]}], ++edges[{face[1], face[2]}];
      ++corners[face[0]], ++corners[face[1]], ++corners[face[2]];
    }
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 2) << "the surface is closed";
  }
  result.euler =
      static_cast<long>(corners.size()) - static_cast<long>(edges.size()) + static_cast<long>(result.exterior);
  result.unused = static_cast<std::size_t>(std::count(used.begin(), used.end(), 0));
  return result;
}

TEST(Support, delaunayCubeFillsTheCube) {
  for (const std::size_t points : {8U, 60U, 2000U}) {
    const Summary s = summary(delaunayCube(points, 5));
    EXPECT_NEAR(s.volume, 1.0, 1e-12) << points;
    EXPECT_EQ(s.exterior, 12U);
    EXPECT_EQ(s.crowded + s.flat + s.unused, 0U);
  }
}

TEST(Support, delaunayCubeDependsOnTheSeedAlone) {
  EXPECT_EQ(delaunayCube(300, 1).connectivity, delaunayCube(300, 1).connectivity);
  EXPECT_NE(delaunayCube(300, 1).points, delaunayCube(300, 2).points);
}

TEST(Support, tetrahedronGridFillsTheCube) {
  for (const double jitter : {0.0, 0.19}) {
    const mesh::Source grid = tetrahedronGrid(5, jitter, 3);
    const Summary s = summary(grid);
    EXPECT_EQ(grid.types.size(), 750U);
    EXPECT_NEAR(s.volume, 125.0, 1e-10);
    EXPECT_EQ(s.exterior, 12U * 25U);
    EXPECT_EQ(s.crowded + s.flat + s.unused, 0U);
    for (std::size_t cell = 0; cell < grid.types.size(); ++cell) {
      EXPECT_GT(tetrahedronVolume(grid, cell), 0.0);
    }
  }
}

TEST(Support, shellIsOneBallWithACavityThatIsOpen) {
  const Summary s = summary(shell(8));
  EXPECT_EQ(s.euler, 2) << "a bowl: one sphere";
  EXPECT_EQ(s.crowded + s.flat + s.unused, 0U);
  const double whole = 4.0 / 3.0 * std::acos(-1.0) * (1.0 - 0.6 * 0.6 * 0.6);
  EXPECT_GT(s.volume, 0.75 * whole);
  EXPECT_LT(s.volume, 0.95 * whole);
}

TEST(Support, toriAreTwoAndDoNotTouch) {
  const mesh::Source tori = interlockedTori(3);
  const Summary s = summary(tori);
  EXPECT_EQ(tori.types.size(), 96U * 27U);
  EXPECT_EQ(s.euler, 0) << "two tori";
  EXPECT_EQ(s.crowded + s.flat + s.unused, 0U);
  const std::size_t half = tori.points.size() / 2;
  double closest = 10.0;
  for (std::size_t a = 0; a < half; ++a) {
    for (std::size_t b = half; b < tori.points.size(); ++b) {
      closest = std::min(closest, glm::distance(tori.points[a], tori.points[b]));
    }
  }
  EXPECT_GT(closest, 0.1);
}

TEST(Support, joinKeepsCellsAndCommonArrays) {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh::Source a = oneCell(mesh::vtk_cell::tetra, corners);
  mesh::Source b = oneCell(mesh::vtk_cell::polyhedron, corners);
  addCellArray(a, "middle", [](const Vec3& p) { return p.x; });
  addCellArray(b, "middle", [](const Vec3& p) { return p.x; });
  addPointArray(a, "only here", [](const Vec3& p) { return p.x; });
  const mesh::Source joined = join(a, b);
  ASSERT_EQ(joined.arrays.size(), 2U);
  EXPECT_EQ(joined.arrays[0].values.size(), 8U);
  EXPECT_EQ(joined.arrays[1].values, (std::vector<double>{0.25, 0.25}));
  ASSERT_EQ(joined.connectivity.size(), 4U + 1U + 4U * 4U);
  EXPECT_EQ(joined.connectivity[4], 4U);
  for (std::size_t face = 0; face < 4; ++face) {
    EXPECT_EQ(joined.connectivity[5 + 4 * face], 3U);
    EXPECT_GE(joined.connectivity[6 + 4 * face], 4U);
  }
}

}  // namespace
}  // namespace spillikin::tests
