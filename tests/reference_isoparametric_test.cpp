// Curved elements: all roots found, volumes filled, closed forms met where faces are flat.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <random>

#include "reference_support.h"
#include "spillikin/integrate/segment.h"
#include "spillikin/reference/flat_face_cost.h"
#include "spillikin/reference/trilinear.h"

namespace spillikin::tests {
namespace {

using reference::Interval;
using reference::Options;
using reference::Trilinear;

Options isoparametric() {
  Options options;
  options.model = mesh::FieldModel::isoparametric;
  return options;
}

bool holds(const std::vector<Vec3>& roots, const Vec3& root, double tolerance) {
  return std::any_of(roots.begin(), roots.end(), [&](const Vec3& r) {
    const Vec3 d = r - root;
    return std::sqrt(glm::dot(d, d)) < tolerance;
  });
}

TEST(ReferenceTrilinear, FindsThePointItWasMadeFrom) {
  const std::uint64_t seed = 31;
  SCOPED_TRACE(fmt::format("seed {}", seed));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::size_t several = 0;
  std::vector<Vec3> roots;
  for (int n = 0; n < 500; ++n) {
    Trilinear<Vec3> map;
    const double distortion = n < 250 ? 0.4 : 1.5;  // the second half is folded here and there
    for (std::size_t c = 0; c < 8; ++c) {
      map.corner[c] = Vec3(c & 1U, (c >> 1) & 1U, c >> 2) +
                      distortion * (Vec3(uniform(random), uniform(random), uniform(random)) - 0.5);
    }
    const Vec3 at(uniform(random), uniform(random), uniform(random));
    const Vec3 value = map(at);
    for (Vec3& corner : map.corner)
      corner -= value;
    ASSERT_TRUE(findRoots(map, 1e-14, roots));
    ASSERT_TRUE(holds(roots, at, 1e-6)) << n;
    for (const Vec3& root : roots)
      ASSERT_LT(glm::length(map(root)), 1e-12);
    several += roots.size() > 1 ? 1 : 0;
    for (Vec3& corner : map.corner)
      corner += Vec3(100.0);
    ASSERT_TRUE(findRoots(map, 1e-14, roots));
    ASSERT_TRUE(roots.empty());
  }
  EXPECT_GT(several, 3U);
}

// x = u + v, y = u v: every point has its mirror image.
TEST(ReferenceTrilinear, BothSheetsOfAFold) {
  Trilinear<Vec3> map;
  for (std::size_t c = 0; c < 8; ++c) {
    const double u = static_cast<double>(c & 1U), v = static_cast<double>((c >> 1) & 1U);
    map.corner[c] = Vec3(u + v - 1.0, u * v - 0.24, static_cast<double>(c >> 2) - 0.3);
  }
  std::vector<Vec3> roots;
  ASSERT_TRUE(findRoots(map, 1e-14, roots));
  ASSERT_EQ(roots.size(), 2U);
  EXPECT_TRUE(holds(roots, {0.4, 0.6, 0.3}, 1e-9));
  EXPECT_TRUE(holds(roots, {0.6, 0.4, 0.3}, 1e-9));
}

// Near and at the apex of a pyramid, the cube's collapsed top, where the map is singular.
TEST(ReferenceTrilinear, CollapsedCorners) {
  const std::vector<Vec3> base{{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}};
  std::vector<Vec3> roots;
  for (const double near : {0.3, 1e-3, 1e-6, 1e-9, 0.0}) {
    Trilinear<Vec3> map;
    for (std::size_t c = 0; c < 8; ++c)
      map.corner[c] = c < 4 ? base[c] : Vec3(0, 0, 1);
    const Vec3 value = map({0.7, 0.2, 1.0 - near});
    for (Vec3& corner : map.corner)
      corner -= value;
    ASSERT_TRUE(findRoots(map, 1e-15, roots)) << near;
    ASSERT_EQ(roots.size(), 1U) << near;
    EXPECT_LT(glm::length(map(roots[0])), 1e-14);
    EXPECT_NEAR(roots[0].z, 1.0 - near, 1e-12);
  }
}

// A sheared, stretched grid: faces are flat, so lengths are those of the face model, and a linear field is met.
TEST(Isoparametric, ParallelepipedsMeetTheClosedForm) {
  const glm::dmat3 shear(Vec3(1.2, 0.1, -0.3), Vec3(0.4, 0.9, 0.2), Vec3(-0.2, 0.3, 1.1));
  mesh::Source source = hexahedronGrid(3);
  for (Vec3& p : source.points)
    p = shear * p;
  addPointArray(source, "linear", [](const Vec3& p) { return 0.3 * p.x - 0.2 * p.y + 0.5 * p.z; });
  const Scene scene(source, "linear");
  const View view = lookAt({9, 7, 8}, shear * Vec3(1.5), 41, 41);
  const integrate::TransferFunction tf = ramp(-1.0, 3.0, 2.0);
  const Image a = scene.caster.render(view, tf, {}), b = scene.caster.render(view, tf, isoparametric());
  for (std::size_t n = 0; n < a.rgba.size(); ++n)
    ASSERT_NEAR(a.rgba[n], b.rgba[n], 2e-7);
}

// A field that is trilinear, on a unit cube, along a slanted ray: a cubic, integrated in 20000 pieces.
TEST(Isoparametric, TrilinearFieldIsACubicAlongTheRay) {
  mesh::Source source = hexahedronGrid(1);
  const auto f = [](const Vec3& p) { return p.x * p.y * p.z - 0.5 * p.x * p.y + 0.3 * p.z; };
  addPointArray(source, "f", f);
  const Scene scene(source, "f");
  const View view = lookAt({2.5, 2.1, 2.9}, Vec3(0.5), 5, 5);
  const integrate::TransferFunction tf = ramp(-0.5, 0.8, 4.0);
  const Image image = scene.caster.render(view, tf, isoparametric());
  const reference::Rays rays(view);
  std::vector<Interval> whole;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) {
      const reference::Ray ray = rays(x + 0.5, y + 0.5);
      scene.caster.intervals(view, x + 0.5, y + 0.5, {}, whole);
      integrate::Radiance truth;
      constexpr int pieces = 20000;
      const double length = std::sqrt(glm::dot(ray.direction, ray.direction));
      for (int n = 0; n < pieces && !whole.empty(); ++n) {
        const double h = (whole[0].leave - whole[0].enter) / pieces, t = whole[0].enter + n * h;
        truth = over(truth, integrate::integrate(tf, f(ray.origin + t / length * ray.direction),
                                                 f(ray.origin + (t + h) / length * ray.direction), h));
      }
      for (std::size_t c = 0; c < 3; ++c)
        ASSERT_NEAR(image.pixel(x, y)[c], truth.color[c], 3e-6);
      ASSERT_NEAR(image.pixel(x, y)[3], truth.alpha, 3e-6);
    }
  }
}

// The image of the unit cube: integral of the Jacobian, a polynomial that Gauss's two points integrate exactly.
double volume(const std::vector<Vec3>& p) {
  double sum = 0.0;
  const double g = 0.5 / std::sqrt(3.0);
  for (int n = 0; n < 8; ++n) {
    const Vec3 at(0.5 + (n & 1 ? g : -g), 0.5 + (n & 2 ? g : -g), 0.5 + (n & 4 ? g : -g));
    const Trilinear<Vec3> map{{p[0], p[1], p[3], p[2], p[4], p[5], p[7], p[6]}};
    const auto d = [&](const Vec3& h) { return map(at + h) - map(at - h); };
    sum += glm::dot(d({0.5, 0, 0}), glm::cross(d({0, 0.5, 0}), d({0, 0, 0.5}))) / 8.0;
  }
  return sum;
}

double castVolume(const Scene& scene, const View& view, const Options& options) {
  std::vector<Interval> intervals;
  double sum = 0.0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      scene.caster.intervals(view, x + 0.5, y + 0.5, options, intervals);
      sum += totalLength(intervals);
    }
  }
  return sum * std::pow(2.0 * view.parallel_scale / view.height, 2);
}

TEST(Isoparametric, TwistedHexahedronFillsItsVolume) {
  const std::vector<Vec3> p{{0, 0, 0},        {1, 0, 0.2},   {1.1, 1, -0.2},  {0, 1.2, 0.1},
                            {0.2, -0.1, 1.0}, {0.9, 0, 1.3}, {1.2, 1.3, 0.8}, {-0.1, 1, 1.2}};
  const Scene scene(oneCell(12, p));
  View view = lookAt({3.0, 4.0, 5.0}, {0.5, 0.5, 0.5}, 120, 120);
  view.parallel_scale = 1.3;
  const double exact = volume(p);
  EXPECT_NEAR(castVolume(scene, view, isoparametric()), exact, 1e-3 * exact);
  // Flat triangles do not: that is what the model is for.
  EXPECT_GT(std::abs(castVolume(scene, view, {}) - exact), 5e-3 * exact);
}

// Neighbours share their bilinear faces: on every ray the intervals join, and the box around is filled.
TEST(Isoparametric, JitteredGridWithoutGapOrOverlap) {
  const Scene scene(hexahedronGrid(4, 0.2, 3));
  for (const Vec3 eye : {Vec3(9, 8, 11), Vec3(2, 2, 12), Vec3(1.7, 2.2, 2.1)}) {
    const View view = lookAt(eye, Vec3(2.0, 2.0, 1.9), 33, 33);
    const reference::Rays rays(view);
    std::vector<Interval> intervals;
    for (int y = 0; y < view.height; ++y) {
      for (int x = 0; x < view.width; ++x) {
        scene.caster.intervals(view, x + 0.5, y + 0.5, isoparametric(), intervals);
        const double chord = boxChord(rays(x + 0.5, y + 0.5), Vec3(0.0), Vec3(4.0), true);
        ASSERT_NEAR(totalLength(intervals), chord, 1e-8) << fmt::format("pixel {},{}", x, y);
        for (std::size_t n = 1; n < intervals.size(); ++n) {
          ASSERT_NEAR(intervals[n].enter, intervals[n - 1].leave, 1e-9);
          if (intervals[n].cell != intervals[n - 1].cell) {
            ASSERT_NEAR(intervals[n].front, intervals[n - 1].back, 1e-5);  // conforming: continuous across faces
          }
        }
      }
    }
  }
}

TEST(Isoparametric, WedgeAndPyramid) {
  const auto f = [](const Vec3& p) { return 1.0 + 0.5 * p.x - 0.25 * p.y + 0.125 * p.z; };
  const std::vector<Vec3> wedge{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}};
  const std::vector<Vec3> pyramid{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.3, 0.4, 1}};
  for (const auto& [type, points, exact] :
       {std::tuple{std::uint8_t{13}, wedge, 0.5}, std::tuple{std::uint8_t{14}, pyramid, 1.0 / 3}}) {
    mesh::Source source = oneCell(type, points);
    addPointArray(source, "f", f);
    const Scene scene(source, "f");
    for (const Vec3 eye : {Vec3(3, 2, 4), Vec3(-3, 1, 0.5), Vec3(0.4, 0.3, -5)}) {
      View view = lookAt(eye, {0.4, 0.4, 0.4}, 60, 60);
      view.parallel_scale = 1.0;
      EXPECT_NEAR(castVolume(scene, view, isoparametric()), exact, 0.01 * exact);
      // Flat faces and a linear field: ray by ray the face model's answer.
      std::vector<Interval> flat, curved;
      for (int n = 0; n < 60; ++n) {
        scene.caster.intervals(view, n + 0.5, 31.3, {}, flat);
        scene.caster.intervals(view, n + 0.5, 31.3, isoparametric(), curved);
        ASSERT_EQ(flat.empty(), curved.empty());
        if (flat.empty()) continue;
        ASSERT_NEAR(flat.front().enter, curved.front().enter, 1e-7);
        ASSERT_NEAR(flat.back().leave, curved.back().leave, 1e-7);
        ASSERT_NEAR(flat.front().front, curved.front().front, 1e-7);
        ASSERT_NEAR(flat.back().back, curved.back().back, 1e-7);
      }
    }
  }
}

// The report of a picture looks at curved faces too: nothing on a conforming grid; where the cells of a plane of faces
// have been pulled apart behind the mesh's back, each ray that passes it has a gap.
TEST(Isoparametric, GapsAtCurvedFacesAreCounted) {
  Scene scene(hexahedronGrid(4, 0.2, 3));
  const View view = lookAt({9, 8, 11}, Vec3(2.0, 2.0, 1.9), 33, 33);
  reference::Report report;
  scene.caster.render(view, constantMedium(1.0), isoparametric(), &report);
  EXPECT_GT(report.intervals, 0U);
  EXPECT_EQ(report.gaps, 0U);
  EXPECT_EQ(report.overlaps, 0U);

  // One cell gets corners of its own, drawn in towards its middle: the rays that come to it from a neighbour find
  // nothing where that one ends.
  mesh::Mesh torn = mesh::build(hexahedronGrid(2));
  const mesh::Id cell = 0;
  Vec3 middle(0.0);
  for (const mesh::Id v : torn.vertices(cell))
    middle += torn.points[v] / 8.0;
  for (mesh::Id k = torn.cell_vertex_offset[cell]; k < torn.cell_vertex_offset[cell + 1]; ++k) {
    const mesh::Id v = torn.cell_vertex[k];
    torn.cell_vertex[k] = static_cast<mesh::Id>(torn.points.size());
    torn.points.push_back(middle + 0.9 * (torn.points[v] - middle));
    torn.point_file_id.push_back(torn.point_file_id[v]);
  }
  mesh::Field field;
  field.values.assign(torn.points.size(), 1.0);
  const reference::RayCaster caster(torn, field);
  // From the far side, so that neighbours are in front of the cell.
  View behind = lookAt(Vec3(1.0) + 4.0 * (Vec3(1.0) - middle), middle, 33, 33);
  caster.render(behind, constantMedium(1.0), isoparametric(), &report);
  EXPECT_GT(report.gaps, 0U);
  EXPECT_EQ(report.overlaps, 0U);
}

// What flat faces cost, cell by cell: nothing on parallelepipeds; on a twisted hexahedron the difference of the
// volumes, which a polynomial knows exactly for the curved one and the divergence theorem for the flat one.
TEST(Isoparametric, CostOfFlatFacesByCell) {
  const Scene straight(hexahedronGrid(2));
  for (const auto& cost : reference::flatFaceCost(straight.caster, lookAt({9, 7, 8}, Vec3(1.0), 24, 24), 8)) {
    EXPECT_GT(cost.rays, 0U);
    EXPECT_LT(cost.worst_length, 1e-8);
    EXPECT_LT(cost.relative(), 1e-8);
  }
  const std::vector<Vec3> p{{0, 0, 0},        {1, 0, 0.2},   {1.1, 1, -0.2},  {0, 1.2, 0.1},
                            {0.2, -0.1, 1.0}, {0.9, 0, 1.3}, {1.2, 1.3, 0.8}, {-0.1, 1, 1.2}};
  const Scene twisted(oneCell(12, p));
  View view = lookAt({3.0, 4.0, 5.0}, {0.5, 0.5, 0.5}, 120, 120);
  view.parallel_scale = 1.3;
  const auto costs = reference::flatFaceCost(twisted.caster, view, 1);
  const double pixel = std::pow(2.0 * view.parallel_scale / view.height, 2);
  mesh::Surface surface;
  mesh::surface(twisted.mesh, 0, surface);
  double flat = 0.0;
  for (const auto& t : surface.triangles) {
    const auto& q = twisted.mesh.points;
    flat += glm::dot(q[t[0]], glm::cross(q[t[1]], q[t[2]])) / 6.0;
  }
  EXPECT_NEAR(costs[0].length_curved * pixel, volume(p), 2e-3 * volume(p));
  EXPECT_NEAR(costs[0].length_face * pixel, flat, 2e-3 * flat);
  EXPECT_NEAR(costs[0].relative(), std::abs(flat - volume(p)) / volume(p), 4e-3);
  EXPECT_GT(costs[0].worst_length, 0.01);
}

}  // namespace
}  // namespace spillikin::tests
