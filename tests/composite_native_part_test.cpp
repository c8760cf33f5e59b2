// What of a large tetrahedron lies in a tile, and pictures of cells that reach over many tiles.
#include <gtest/gtest.h>

// One instruction set, whichever this file is compiled for.
#include "spillikin/composite/native_part-inl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <random>

#include "tests/composite_native_checks.h"
#include "tests/support/meshes.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

constexpr double z0 = 0.4;

// A tetrahedron before the eye, corners as place on the screen and depth, with a linear field.
struct Cell {
  std::array<Vec3, 4> place;
  std::array<double, 4> value{};

  // As PartCorner has it: in perspective, places times depth; in a parallel view, depths behind the middle.
  Vec3 point(std::size_t k, bool parallel) const {
    const Vec3& p = place[k];
    return parallel ? Vec3(p.x, p.y, p.z - z0) : Vec3(p.x * p.z, p.y * p.z, p.z);
  }
};

Cell randomCell(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-40.0, 70.0), depth(1.0, 3.0), value(0.0, 1.0);
  Cell cell;
  for (std::size_t k = 0; k < 4; ++k) {
    cell.place[k] = {place(random), place(random), depth(random)};
    cell.value[k] = value(random);
  }
  return cell;
}

// s(p) = apex + dot(slope, p) over the corners.
struct Linear {
  Vec3 slope;
  double apex;
};
Linear fieldOf(const Cell& cell, bool parallel) {
  const Vec3 p0 = cell.point(0, parallel);
  const glm::dmat3 edges(cell.point(1, parallel) - p0, cell.point(2, parallel) - p0, cell.point(3, parallel) - p0);
  const Vec3 gains(cell.value[1] - cell.value[0], cell.value[2] - cell.value[0], cell.value[3] - cell.value[0]);
  const Vec3 slope = gains * glm::inverse(edges);
  return {slope, cell.value[0] - glm::dot(slope, p0)};
}

// The planes of the faces as nearness, and by which the cell is left.
void setPlanes(const Cell& cell, bool parallel, CellBatch& batch) {
  std::int32_t code = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto nearness = [&](std::size_t c) { return parallel ? z0 - cell.place[c].z : 1.0 / cell.place[c].z - z0; };
    const auto row = [&](std::size_t c) { return Vec3(cell.place[c].x, cell.place[c].y, 1.0); };
    const std::size_t a = (k + 1) % 4, b = (k + 2) % 4, c = (k + 3) % 4;
    const glm::dmat3 rows = glm::transpose(glm::dmat3(row(a), row(b), row(c)));
    const Vec3 plane = glm::inverse(rows) * Vec3(nearness(a), nearness(b), nearness(c));
    for (int j = 0; j < 3; ++j)
      std::fill_n(batch.face[k][j], batch_cells, static_cast<float>(plane[j]));
    // Left where the corner opposite is nearer than the plane.
    if (nearness(k) > glm::dot(plane, row(k))) code |= 1 << k;
  }
  std::fill_n(batch.code, batch_cells, code);
}

TilePart partOfCell(const Cell& cell, bool parallel, const TileView& view, CellBatch& batch) {
  const auto set = [](double v) { return hn::Set(DH(), static_cast<float>(v)); };
  PartCorner corners[4];
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3 p = cell.point(k, parallel);
    corners[k] = {set(p.x), set(p.y), set(p.z), set(cell.value[k])};
  }
  TilePart part(view, corners, parallel);
  const Linear field = fieldOf(cell, parallel);
  setPlanes(cell, parallel, batch);
  part.takeRays({set(field.slope.x), set(field.slope.y), set(field.slope.z), set(field.apex)}, 0, batch);
  return part;
}

struct Sampled {
  double lo = 1e300, hi = -1e300;
  void take(double v) {
    lo = std::min(lo, v);
    hi = std::max(hi, v);
  }
};

// Points of the cell, thick on its edges, that are seen between the tile's outermost pixel centres.
template <class F>
void samplePart(const Cell& cell, bool parallel, const TileView& view, std::mt19937_64& random, const F& f) {
  std::exponential_distribution<double> share;
  std::bernoulli_distribution none(0.4);
  for (int n = 0; n < 20000; ++n) {
    double weight[4], sum = 0.0;
    for (double& w : weight)
      sum += w = none(random) ? 0.0 : share(random);
    if (sum == 0.0) continue;
    Vec3 p(0.0);
    double value = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
      p += weight[k] / sum * cell.point(k, parallel);
      value += weight[k] / sum * cell.value[k];
    }
    const double x = parallel ? p.x : p.x / p.z, y = parallel ? p.y : p.y / p.z;
    if (x < 0.5 || x > view.width - 0.5 || y < 0.5 || y > view.height - 0.5) continue;
    f(p.z, value);
  }
}

// Holds `part` to what was found of `range`: nothing lies outside, and little of it is empty. `whole` is the cell's.
void expectRange(const Range& part, const Sampled& found, double whole) {
  const double lo = hn::GetLane(part.lo), hi = hn::GetLane(part.hi), slack = share_rounding * whole;
  EXPECT_GE(found.lo, lo - slack);
  EXPECT_LE(found.hi, hi + slack);
  EXPECT_LE(hi - lo, found.hi - found.lo + 0.15 * whole);
}

TEST(CompositeNativePart, RangesAreThoseOfThePointsInTheTile) {
  TileView view;
  view.width = 32;
  view.height = 23;
  view.z0 = static_cast<float>(z0);
  const auto batch = std::make_unique<CellBatch>();
  int seen = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const bool parallel = seed % 2 == 0;
    const Cell cell = randomCell(random);
    const TilePart part = partOfCell(cell, parallel, view, *batch);
    Sampled depth, value, all_depth, all_value;
    int points = 0;
    samplePart(cell, parallel, view, random, [&](double w, double s) {
      depth.take(w);
      value.take(s);
      ++points;
    });
    if (points < 500) continue;
    ++seen;
    for (std::size_t k = 0; k < 4; ++k) {
      all_depth.take(cell.place[k].z);
      all_value.take(cell.value[k]);
    }
    expectRange(part.depth, depth, all_depth.hi - all_depth.lo);
    expectRange(part.value, value, all_value.hi - all_value.lo);
  }
  EXPECT_GE(seen, 100);
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

namespace spillikin::tests {
namespace {

// Each cell covers many tiles, and each tile sees a part of its range: smooth looks, bends, jumps and bands.
TEST(CompositeNativePart, CellsOverManyTiles) {
  for (const char* look : {"viridis", "coolwarm", "bands", "steps", "comb"}) {
    SCOPED_TRACE(look);
    for (const double extinction : {0.3, 8.0}) {
      const Subject s(delaunayCube(9, 5), "", look, extinction);
      for (const double distance : {0.7, 2.5}) {
        SCOPED_TRACE(distance);
        View view = viewOf(s, {0.7, 0.4, 0.6}, 150, 110, distance);
        if (distance < 1.0) view.view_angle = 90.0;
        expectExact(s, view);
        view.parallel_scale = 0.6;
        expectExact(s, view);
      }
    }
  }
}

}  // namespace
}  // namespace spillikin::tests
