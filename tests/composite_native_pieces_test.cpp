// Pieces of cells lie in the boxes found for them.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "spillikin/composite/backends.h"
#include "spillikin/composite/native_pieces.h"
#include "tests/composite_native_checks.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

using composite::native::CellShape;
using composite::native::PixelBox;

// Each cell twice, on either side of a plane through one of its faces, of its vertices or of points near by, and a
// third time on one side of another plane too.
sort::Order cutAnywhere(const mesh::Mesh& mesh, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  sort::Order order;
  const auto plane = [&](mesh::Id cell) {
    const auto v = mesh.vertices(cell);
    const auto any = [&] { return mesh.points[v[random() % v.size()]]; };
    const double away = random() % 2 == 0 ? 0.0 : 0.1;
    Vec3 normal(0.0);
    const Vec3 a = any();
    while (glm::length(normal) < 1e-3)
      normal = glm::cross(any() - a + away * Vec3(uniform(random), uniform(random), uniform(random)), any() - a);
    normal = glm::normalize(normal);
    return sort::HalfSpace{normal, -glm::dot(normal, a)};
  };
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    const sort::HalfSpace one = plane(c), other = plane(c);
    const sort::HalfSpace back{-one.normal, -one.offset};
    for (const auto& keep : {std::vector{one}, std::vector{back}, std::vector{back, other}}) {
      order.cells.push_back(c);
      order.cuts.add(static_cast<std::uint32_t>(order.cells.size() - 1), keep);
    }
  }
  return order;
}

TEST(CompositeNativePieces, EveryRayThatMeetsAPieceLiesInItsBox) {
  const unsigned seed = 11;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937 random(seed);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same each time
  std::size_t met = 0, covered = 0, whole = 0;
  for (const bool parallel : {false, true}) {
    for (const double distance : {4.0, 0.3}) {  // the second from within the mesh
      const Subject s(hexahedronGrid(3, 0.25, seed), "", "viridis", 4.0);
      View view = viewOf(s, {0.7, 0.5, 0.9}, 48, 40);
      view.eye = view.target + (view.eye - view.target) * (distance / 4.0);
      if (parallel) view.parallel_scale = 1.3;
      const project::Camera camera(view);
      const sort::Order order = cutAnywhere(s.mesh, random);
      const composite::Frame frame{s.mesh, s.field, s.tf, camera, order};
      composite::native::Screen screen;
      screen.set(frame);
      std::vector<PixelBox> boxes;
      composite::native::findPieces(screen, boxes);
      ASSERT_EQ(boxes.size(), order.cuts.size());
      CellShape shape;
      std::vector<composite::native::Span> spans;
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        const sort::Cut cut = order.cuts[i];
        const PixelBox& box = boxes[i];
        shape.set(screen, order.cells[cut.entry], cut.keep, {0, 0, view.width, view.height});
        for (int y = 0; y < view.height; ++y) {
          for (int x = 0; x < view.width; ++x) {
            shape.spans(x + 0.5, y + 0.5, spans);
            const bool inside = x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1;
            ++whole;
            covered += inside ? 1 : 0;
            if (spans.empty()) continue;
            ++met;
            EXPECT_TRUE(inside) << "piece " << i << " at " << x << "," << y << ", seed " << seed;
          }
        }
      }
    }
  }
  EXPECT_GT(met, 10000U);
  EXPECT_LT(covered, whole / 10 * 7) << "of half of the pieces most is known to be empty";
}

// A cell of a kind, bent at random.
mesh::Source bentCell(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-0.25, 0.25);
  std::vector<Vec3> points = cube();
  for (Vec3& p : points)
    p += Vec3(uniform(random), uniform(random), uniform(random));
  const auto& p = points;
  switch (random() % 4) {
    case 0:
      return oneCell(mesh::vtk_cell::tetra, {p[0], p[1], p[3], p[4]});
    case 1:
      return oneCell(mesh::vtk_cell::pyramid, {p[0], p[1], p[2], p[3], p[6]});
    case 2:
      return oneCell(mesh::vtk_cell::wedge, {p[0], p[1], p[3], p[4], p[5], p[7]});
    default:
      return oneCell(mesh::vtk_cell::hexahedron, points);
  }
}

// The one cell of a mesh in three pieces that share all of it.
sort::Order inThree(const mesh::Mesh& mesh, std::mt19937& random) {
  sort::Order order = cutAnywhere(mesh, random);
  const auto one = order.cuts[1].keep.front(), other = order.cuts[2].keep.back();
  const auto turned = [](const sort::HalfSpace& h) { return sort::HalfSpace{-h.normal, -h.offset}; };
  order.cells.assign(3, 0);
  order.cuts.clear();
  order.cuts.add(0, std::vector{turned(one)});
  order.cuts.add(1, std::vector{one, other});
  order.cuts.add(2, std::vector{one, turned(other)});
  order.exact = true;
  return order;
}

// Whatever the planes, through corners and along faces too: what a ray has in a cell is drawn once, in one go.
TEST(CompositeNativePieces, OnePieceDrawsAnInterval) {
  const unsigned seed = 29;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937 random(seed);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same each time
  std::normal_distribution<double> normal;
  for (int k = 0; k < 150; ++k) {
    const Subject s = uniform(bentCell(random), 0.2);
    View view = viewOf(s, {normal(random), normal(random), normal(random)}, 41, 37, k % 3 == 0 ? 40.0 : 1.5);
    if (k % 3 == 0) view.view_angle = 2.0;
    if (k % 2 == 0) view.parallel_scale = 0.8;
    sort::Order whole;
    whole.cells = {0};
    whole.exact = true;
    const sort::Order pieces = inThree(s.mesh, random);
    const auto native = composite::makeNative();
    Image expected, drawn;
    const auto before = drawWith(*native, s, view, whole, expected), after = drawWith(*native, s, view, pieces, drawn);
    EXPECT_LE(largestDifference(expected, drawn), 2e-5) << "cell " << k << ", seed " << seed;
    EXPECT_EQ(before.fragments, after.fragments) << "cell " << k << ", seed " << seed;
  }
}

}  // namespace
}  // namespace spillikin::tests
