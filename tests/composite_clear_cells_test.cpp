// Cells of which nothing shows: which they are, and that a picture without them is the same.
#include "spillikin/composite/clear_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <string>

#include "spillikin/composite/backends.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

using integrate::ControlPoint;
using integrate::TransferFunction;

// One hexahedron whose field is constant.
Subject constantCell(double value) {
  mesh::Source source = hexahedronGrid(1);
  addCellArray(source, "one", [value](const Vec3&) { return value; });
  return {source, "one", "viridis", 1.0};
}

bool isClear(double value, const TransferFunction& look) {
  const Subject s = constantCell(value);
  return !composite::clearCells(s.mesh, s.field, look).empty();
}

TEST(ClearCells, JumpsBelongToTheirUpperSide) {
  const auto point = [](double value, double extinction) { return ControlPoint{value, {1.0, 0.5, 0.2}, extinction}; };
  const TransferFunction up({point(0.0, 0.0), point(1.0, 0.0), point(1.0, 2.0), point(2.0, 2.0)});
  EXPECT_TRUE(isClear(-5.0, up));
  EXPECT_TRUE(isClear(0.5, up));
  EXPECT_FALSE(isClear(1.0, up));
  EXPECT_FALSE(isClear(3.0, up));
  const TransferFunction down({point(0.0, 2.0), point(1.0, 2.0), point(1.0, 0.0), point(2.0, 0.0)});
  EXPECT_FALSE(isClear(0.5, down));
  EXPECT_TRUE(isClear(1.0, down));
  EXPECT_TRUE(isClear(7.0, down));
  const TransferFunction ramp({point(0.0, 0.0), point(1.0, 0.0), point(2.0, 1.0)});
  EXPECT_TRUE(isClear(1.0, ramp));
  EXPECT_FALSE(isClear(1.5, ramp));
  // Two clear pieces that meet at a jump of colour are one.
  const TransferFunction both({point(0.0, 0.0), point(1.0, 0.0), {1.0, {0.0, 0.0, 0.0}, 0.0}, point(2.0, 0.0)});
  EXPECT_TRUE(isClear(1.0, both));
  EXPECT_FALSE(isClear(0.0, TransferFunction({point(0.0, 0.1)})));
}

// A look that is clear here and there, with ramps and jumps between.
TransferFunction patchy(const mesh::Field& field, std::mt19937& random, double strength) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const auto color = [&] { return std::array{uniform(random), uniform(random), uniform(random)}; };
  std::vector<ControlPoint> points;
  double extinction = 0.0;
  for (int k = 0; k <= 8; ++k) {
    const double value = field.lo + (field.hi - field.lo) * k / 8.0;
    points.push_back({value, color(), extinction});
    extinction = uniform(random) < 0.6 ? 0.0 : strength * uniform(random);
    if (uniform(random) < 0.5) points.push_back({value, color(), extinction});
  }
  return TransferFunction(points);
}

// Against the look itself, at many scalars of each cell.
void expectNothingShows(const Subject& s, std::span<const std::uint8_t> clear) {
  for (mesh::Id c = 0; c < s.mesh.cell_count(); ++c) {
    if (clear[c] == 0) continue;
    const auto ids = s.mesh.vertices(c);
    for (const mesh::Id a : ids) {
      for (const mesh::Id b : ids) {
        for (const double t : {0.0, 0.25, 0.5, 0.75})
          EXPECT_EQ(s.tf(s.field.values[a] + t * (s.field.values[b] - s.field.values[a])).extinction, 0.0);
      }
    }
  }
}

void expectSamePicture(Subject& s, composite::Compositor& compositor, std::mt19937& random) {
  std::size_t left_out = 0;
  for (int k = 0; k < 6; ++k) {
    SCOPED_TRACE(testing::Message() << "seed 7, look " << k);
    s.tf = patchy(s.field, random, 4.0);
    const auto clear = composite::clearCells(s.mesh, s.field, s.tf);
    if (clear.empty()) continue;
    if (s.field.association == mesh::Association::points) expectNothingShows(s, clear);
    left_out += static_cast<std::size_t>(std::count_if(clear.begin(), clear.end(), [](auto c) { return c != 0; }));
    const View view = viewOf(s, {1.0, 0.4, 0.7}, 64, 48);
    const sort::Order order = orderOf(s, view);
    const project::Camera camera(view);
    Image with, without;
    const auto all = compositor.draw({s.mesh, s.field, s.tf, camera, order}, with);
    const auto some = compositor.draw(
        {.mesh = s.mesh, .field = s.field, .transfer_function = s.tf, .camera = camera, .order = order, .clear = clear},
        without);
    // A scalar that is rounded out of the cell's range may glow by next to nothing.
    EXPECT_LE(largestDifference(with, without), 1e-5);
    EXPECT_LE(some.fragments, all.fragments);
  }
  EXPECT_GT(left_out, s.mesh.cell_count());
}

TEST(ClearCells, PicturesAreTheSameWithoutThem) {
  std::mt19937 random(7);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same looks each time
  mesh::Source materials = hexahedronGrid(4, 0.1, 3);
  addCellArray(materials, "layer", [](const Vec3& p) { return std::floor(p.z); });
  Subject tetrahedra(delaunayCube(300, 4), "", "viridis", 1.0),
      hexahedra(hexahedronGrid(6, 0.15, 2), "", "viridis", 1.0), layers(materials, "layer", "viridis", 1.0);
  for (Subject* s : {&tetrahedra, &hexahedra, &layers}) {
    for (const auto make : {composite::makeNative, composite::makeOsmesa})
      expectSamePicture(*s, *make(), random);
  }
}

}  // namespace
}  // namespace spillikin::tests
