// Quadratic cells as linear ones: whole volumes, neighbours that agree, values by the shape functions.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <random>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::mesh {
namespace {

using tests::checkInvariants;
using tests::volume;
using Ids = std::vector<std::uint32_t>;

// Nodes besides the corners, each the middle of the corners listed, in VTK's order.
const std::map<std::uint8_t, std::vector<Ids>>& extraNodes() {
  static const std::vector<Ids> tetra{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
  static const std::vector<Ids> hexa{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                     {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  static const std::vector<Ids> wedge{{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}};
  static const std::vector<Ids> upright{{0, 3}, {1, 4}, {2, 5}};
  static const std::vector<Ids> pyramid{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}};
  static const auto plus = [](std::vector<Ids> a, const std::vector<Ids>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  static const std::vector<Ids> sides{{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}};
  static const std::map<std::uint8_t, std::vector<Ids>> table{
      {vtk_cell::quadratic_tetra, tetra},
      {vtk_cell::quadratic_hexahedron, hexa},
      {vtk_cell::biquadratic_quadratic_hexahedron, plus(hexa, sides)},
      {vtk_cell::triquadratic_hexahedron,
       plus(plus(hexa, sides), {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 2, 3, 4, 5, 6, 7}})},
      {vtk_cell::quadratic_linear_wedge, wedge},
      {vtk_cell::quadratic_wedge, plus(wedge, upright)},
      {vtk_cell::biquadratic_quadratic_wedge, plus(plus(wedge, upright), {{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}})},
      {vtk_cell::quadratic_pyramid, pyramid},
      {vtk_cell::triquadratic_pyramid,
       plus(pyramid, {{0, 1, 2, 3}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 1, 2, 3, 4}})}};
  return table;
}

// The linear cells of `linear` as quadratic ones of the types that `type` gives; nodes are shared between neighbours
// and moved by `shift` from the middle of their corners.
Source quadratic(const Source& linear, const std::function<std::uint8_t(std::size_t)>& type,
                 const std::function<Vec3(const Vec3&)>& shift) {
  Source result;
  result.points = linear.points;
  result.offsets = {0};
  std::map<Ids, std::uint32_t> node;
  for (std::size_t c = 0; c < linear.types.size(); ++c) {
    const std::uint32_t* corner = linear.connectivity.data() + linear.offsets[c];
    const std::size_t corners = linear.offsets[c + 1] - linear.offsets[c];
    result.connectivity.insert(result.connectivity.end(), corner, corner + corners);
    for (const Ids& local : extraNodes().at(type(c))) {
      Ids key;
      Vec3 middle(0.0);
      for (const std::uint32_t k : local) {
        key.push_back(corner[k]);
        middle += linear.points[corner[k]] / static_cast<double>(local.size());
      }
      std::sort(key.begin(), key.end());
      const auto [at, fresh] = node.try_emplace(key, static_cast<std::uint32_t>(result.points.size()));
      if (fresh) result.points.push_back(middle + shift(middle));
      result.connectivity.push_back(at->second);
    }
    result.types.push_back(type(c));
    result.offsets.push_back(result.connectivity.size());
  }
  return result;
}

// Each hexahedron of the grid as two wedges, or as six pyramids around its middle.
Source wedgeGrid(std::size_t n) {
  const Source hexahedra = tests::hexahedronGrid(n);
  Source result;
  result.points = hexahedra.points;
  result.offsets = {0};
  for (std::size_t c = 0; c < hexahedra.types.size(); ++c) {
    const std::uint32_t* v = hexahedra.connectivity.data() + 8 * c;
    for (const Ids& local : {Ids{0, 2, 1, 4, 6, 5}, Ids{0, 3, 2, 4, 7, 6}}) {
      for (const std::uint32_t k : local)
        result.connectivity.push_back(v[k]);
      result.types.push_back(vtk_cell::wedge);
      result.offsets.push_back(result.connectivity.size());
    }
  }
  return result;
}

Source pyramidGrid(std::size_t n) {
  const Source hexahedra = tests::hexahedronGrid(n);
  Source result;
  result.points = hexahedra.points;
  result.offsets = {0};
  for (std::size_t c = 0; c < hexahedra.types.size(); ++c) {
    const std::uint32_t* v = hexahedra.connectivity.data() + 8 * c;
    result.points.push_back(0.5 * (hexahedra.points[v[0]] + hexahedra.points[v[6]]));
    for (const Ids& face :
         {Ids{0, 3, 7, 4}, Ids{1, 5, 6, 2}, Ids{0, 4, 5, 1}, Ids{3, 2, 6, 7}, Ids{0, 1, 2, 3}, Ids{4, 7, 6, 5}}) {
      for (const std::uint32_t k : face)
        result.connectivity.push_back(v[k]);
      result.connectivity.push_back(static_cast<std::uint32_t>(result.points.size() - 1));
      result.types.push_back(vtk_cell::pyramid);
      result.offsets.push_back(result.connectivity.size());
    }
  }
  return result;
}

// Moves points inside the cube [0, n]^3, different ones differently, and leaves its boundary in place.
std::function<Vec3(const Vec3&)> bulge(double n, double amount) {
  return [n, amount](const Vec3& p) {
    const auto inside = [n](double x) { return x * (n - x); };
    const double scale = amount * std::min(1.0, inside(p.x) * inside(p.y) * inside(p.z));
    return scale * Vec3(std::sin(7 * p.x + p.y), std::cos(5 * p.y + p.z), std::sin(6 * p.z + 2 * p.x));
  };
}

struct Case {
  const char* what;
  Source linear;
  std::vector<std::uint8_t> types;  // taken in turn
  std::size_t cells;                // linear cells from each
  std::size_t exterior;             // faces
};

std::vector<Case> cases() {
  using namespace vtk_cell;
  const std::size_t n = 2, sides = 6 * n * n;
  return {
      {"tetrahedra", tests::tetrahedronGrid(n), {quadratic_tetra}, 8, 8 * sides},
      {"hexahedra", tests::hexahedronGrid(n), {quadratic_hexahedron}, 8, 4 * sides},
      {"24-node hexahedra", tests::hexahedronGrid(n), {biquadratic_quadratic_hexahedron}, 8, 4 * sides},
      {"27-node hexahedra", tests::hexahedronGrid(n), {triquadratic_hexahedron}, 8, 4 * sides},
      {"mixed hexahedra",
       tests::hexahedronGrid(n),
       {quadratic_hexahedron, triquadratic_hexahedron, biquadratic_quadratic_hexahedron},
       8,
       4 * sides},
      {"wedges", wedgeGrid(n), {quadratic_wedge}, 8, (4 * 4 + 2 * 8) * n * n},
      {"18-node wedges", wedgeGrid(n), {biquadratic_quadratic_wedge}, 8, (4 * 4 + 2 * 8) * n * n},
      {"12-node wedges", wedgeGrid(n), {quadratic_linear_wedge}, 4, (4 * 2 + 2 * 8) * n * n},
      {"pyramids", pyramidGrid(n), {quadratic_pyramid}, 10, 4 * sides},
      {"19-node pyramids", pyramidGrid(n), {quadratic_pyramid, triquadratic_pyramid}, 10, 4 * sides},
  };
}

TEST(Quadratic, NeighboursAgreeAndFillTheCube) {
  for (const Case& test : cases()) {
    for (const double amount : {0.0, 0.06}) {
      SCOPED_TRACE(testing::Message() << test.what << ", bulge " << amount);
      const Source source = quadratic(
          test.linear, [&](std::size_t c) { return test.types[c % test.types.size()]; }, bulge(2.0, amount));
      BuildReport report;
      const Mesh mesh = build(source, &report);
      checkInvariants(mesh);
      if (testing::Test::HasFatalFailure()) return;
      EXPECT_EQ(report.quadratic, source.types.size());
      EXPECT_EQ(mesh.cell_count(), test.cells * source.types.size());
      EXPECT_EQ(report.inverted, 0U);
      EXPECT_EQ(report.collapsed + report.degenerate + report.unsupported, 0U);
      EXPECT_TRUE(report.warnings.empty());
      EXPECT_NEAR(volume(mesh), 8.0, 1e-12);
      const Inspection seen = inspect(mesh);
      EXPECT_EQ(seen.exterior_faces, test.exterior);
      EXPECT_EQ(seen.components, 1U);
      // Every file cell has its share.
      std::vector<std::size_t> pieces(source.types.size(), 0);
      for (const Id file : mesh.cell_file_id)
        ++pieces[file];
      EXPECT_TRUE(std::all_of(pieces.begin(), pieces.end(), [&](std::size_t k) { return k == test.cells; }));
    }
  }
}

TEST(Quadratic, SubdivisionDoesNotSeeTheFilesNumbering) {
  // Mirrored and renumbered cells fill the same volume.
  const std::uint64_t seed = 40;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  for (const Case& test : cases()) {
    SCOPED_TRACE(test.what);
    Source source = quadratic(
        test.linear, [&](std::size_t c) { return test.types[c % test.types.size()]; }, bulge(2.0, 0.06));
    for (Vec3& p : source.points)
      p.x = -p.x;
    Ids id(source.points.size());
    std::iota(id.begin(), id.end(), 0U);
    std::shuffle(id.begin(), id.end(), random);
    std::vector<Vec3> moved(id.size());
    for (std::size_t i = 0; i < id.size(); ++i)
      moved[id[i]] = source.points[i];
    source.points = moved;
    for (std::uint32_t& v : source.connectivity)
      v = id[v];
    BuildReport report;
    const Mesh mesh = build(source, &report);
    checkInvariants(mesh);
    EXPECT_EQ(report.inverted, mesh.cell_count());
    EXPECT_NEAR(volume(mesh), 8.0, 1e-12);
    EXPECT_EQ(inspect(mesh).exterior_faces, test.exterior);
  }
}

TEST(Quadratic, ValuesOfMadePointsFollowTheShapeFunctions) {
  for (const Case& test : cases()) {
    SCOPED_TRACE(test.what);
    Source source = quadratic(
        test.linear, [&](std::size_t c) { return test.types[c % test.types.size()]; }, bulge(2.0, 0.06));
    // Places and values are made alike, so that a linear function stays one, and a constant stays exactly constant.
    tests::addPointArray(source, "linear", [](const Vec3& p) { return 1.0 + 2.0 * p.x - 3.0 * p.y + 0.5 * p.z; });
    tests::addPointArray(source, "constant", [](const Vec3&) { return 0.1; });
    const Mesh mesh = build(source);
    const Field linear = selectField(source, mesh, "linear");
    const Field constant = selectField(source, mesh, "constant");
    EXPECT_EQ(constant.lo, 0.1);
    EXPECT_EQ(constant.hi, 0.1);
    for (Id v = 0; v < mesh.points.size(); ++v) {
      const Vec3& p = mesh.points[v];
      ASSERT_NEAR(linear.values[v], 1.0 + 2.0 * p.x - 3.0 * p.y + 0.5 * p.z, 1e-13);
      ASSERT_EQ(constant.values[v], 0.1);
    }
  }
}

TEST(Quadratic, BodyCentreOfTheSerendipityHexahedron) {
  // Only corners and edges count: the centre of x^2 over [0, 2]^3 is 1 by the 20 nodes as by the function.
  Source source = quadratic(
      tests::hexahedronGrid(1), [](std::size_t) { return vtk_cell::quadratic_hexahedron; },
      [](const Vec3&) { return Vec3(0.0); });
  tests::addPointArray(source, "square", [](const Vec3& p) { return 4.0 * p.x * p.x; });
  const Mesh mesh = build(source);
  const Field field = selectField(source, mesh, "square");
  ASSERT_EQ(mesh.points.size(), 27U);
  for (Id v = 0; v < 27; ++v)
    EXPECT_NEAR(field.values[v], 4.0 * mesh.points[v].x * mesh.points[v].x, 1e-14);
}

TEST(Quadratic, OctahedronIsCutWhereItsPiecesAreFattest) {
  // A curved edge leaves only some of the three diagonals without a turned-over piece.
  const Source linear = tests::oneCell(vtk_cell::tetra, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  const std::array<Ids, 6> edges{{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
  for (const Ids& edge : edges) {
    const Vec3 middle = 0.5 * (linear.points[edge[0]] + linear.points[edge[1]]);
    Source source = quadratic(
        linear, [](std::size_t) { return vtk_cell::quadratic_tetra; },
        [&](const Vec3& p) { return p == middle ? 0.3 * (Vec3(0.25) - p) : Vec3(0.0); });
    BuildReport report;
    const Mesh mesh = build(source, &report);
    checkInvariants(mesh);
    EXPECT_EQ(mesh.cell_count(), 8U);
    EXPECT_EQ(report.inverted, 0U);
    EXPECT_EQ(report.degenerate, 0U);
    EXPECT_TRUE(report.warnings.empty());
  }
}

TEST(Quadratic, CentresMatchAcrossASeam) {
  // Two blocks side by side whose points at the seam exist twice: with equal values they become one, with different
  // values the made centres still lie at one place and the faces match.
  const auto block = [](double shift, double value, std::uint8_t type) {
    Source linear = tests::hexahedronGrid(2);
    Source source = quadratic(
        linear, [type](std::size_t) { return type; }, bulge(2.0, 0.05));
    for (Vec3& p : source.points) {
      // A seam that is not plane, the same from both sides.
      p.x += shift + 0.03 * std::sin(3 * p.y) * std::cos(4 * p.z);
    }
    tests::addPointArray(source, "v", [value](const Vec3& p) { return value + p.y; });
    return source;
  };
  for (const double jump : {0.0, 1.0}) {
    SCOPED_TRACE(jump);
    Source source =
        tests::join(block(0.0, 0.0, vtk_cell::quadratic_hexahedron), block(2.0, jump, vtk_cell::quadratic_hexahedron));
    // Seam coordinates must be equal to the last bit.
    std::map<std::pair<double, double>, double> seam;
    for (Vec3& p : source.points) {
      if (std::abs(p.x - 2.0) > 0.05) continue;
      p.x = seam.try_emplace({p.y, p.z}, p.x).first->second;
    }
    BuildReport report;
    const Mesh mesh = build(source, &report);
    checkInvariants(mesh);
    EXPECT_EQ(inspect(mesh).components, 1U);
    EXPECT_EQ(inspect(mesh).exterior_faces, 4U * 4U * 10U);
    const std::size_t seam_points = 25;  // 21 of the file and 4 made
    EXPECT_EQ(report.coincident_points, jump == 0.0 ? 0U : 2 * seam_points);
    EXPECT_EQ(report.merged_points, jump == 0.0 ? 21U : 0U);
  }
}

}  // namespace
}  // namespace spillikin::mesh
