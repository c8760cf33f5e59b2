// Building: orientation, adjacency, numbering, what is kept and what is left out.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/predicates.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

using tests::checkInvariants;
using tests::volume;

TEST(Build, TetrahedronGridFillsTheCube) {
  const Source source = tests::tetrahedronGrid(5, 0.3, 7);
  BuildReport report;
  const Mesh mesh = build(source, &report);
  checkInvariants(mesh);
  EXPECT_TRUE(mesh.tetrahedral());
  EXPECT_EQ(mesh.cell_count(), source.types.size());
  EXPECT_EQ(mesh.points.size(), source.points.size());
  EXPECT_NEAR(volume(mesh), 125.0, 1e-9);
  EXPECT_EQ(mesh.quad_count(), 0U);
}

TEST(Build, HexahedronGridHasTheFacesOfAGrid) {
  const std::size_t n = 4;
  const Mesh mesh = build(tests::hexahedronGrid(n, 0.2, 3));
  checkInvariants(mesh);
  EXPECT_EQ(mesh.quad_count(), 3 * n * n * (n + 1));
  EXPECT_NEAR(volume(mesh), 64.0, 1e-9);
}

}  // namespace
}  // namespace spillikin::mesh
