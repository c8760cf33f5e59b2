// The approximate roads: what they get right exactly, and how far they are off elsewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/integrate/preintegrated.h"

namespace spillikin::integrate {
namespace {

double difference(const Radiance& a, const Radiance& b) {
  double most = std::abs(a.alpha - b.alpha);
  for (std::size_t k = 0; k < 3; ++k)
    most = std::max(most, std::abs(a.color[k] - b.color[k]));
  return most;
}

struct Deviation {
  double largest = 0.0, mean = 0.0;
};

// Over random segments in the range, of depth up to about 30.
template <class Approximate>
Deviation errorOf(const TransferFunction& tf, const Approximate& approximate) {
  constexpr int count = 20000;
  std::mt19937 random(41);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Deviation e;
  for (int i = 0; i < count; ++i) {
    const double front = unit(random);
    const double back = unit(random);
    const double length = std::pow(10.0, 4.5 * unit(random) - 3.0);
    const double d = difference(approximate(front, back, length), integrate(tf, front, back, length));
    e.largest = std::max(e.largest, d);
    e.mean += d / count;
  }
  return e;
}

TEST(Preintegrated, IsExactAtItsTexels) {
  const TransferFunction tf = preset("bands");
  const Preintegrated table(tf, 0.0, 1.0, 17, 5);
  for (int i = 0; i < 17; ++i) {
    for (int j = 0; j < 17; ++j) {
      const double mean = -std::log1p(-integrate(tf, i / 16.0, j / 16.0, 1.0).alpha);
      for (const double u : {0.25, 0.5, 0.75}) {
        const double length = u / (1.0 - u) / mean;
        EXPECT_LT(difference(table(i / 16.0, j / 16.0, length), integrate(tf, i / 16.0, j / 16.0, length)), 1e-6);
      }
    }
  }
}

TEST(Preintegrated, IsCloseOnASmoothLook) {
  const TransferFunction tf = preset("viridis");
  const Preintegrated table(tf, 0.0, 1.0);
  const Deviation e = errorOf(tf, [&](double f, double b, double l) { return table(f, b, l); });
  RecordProperty("largest", std::to_string(e.largest));
  RecordProperty("mean", std::to_string(e.mean));
  EXPECT_LT(e.largest, 0.01);
  EXPECT_LT(e.mean, 5e-4);
}

TEST(Preintegrated, GetsCloserWithItsResolution) {
  const TransferFunction tf = preset("comb");
  double before = 1.0;
  for (const std::size_t n : {16U, 48U, 144U}) {
    const Preintegrated table(tf, 0.0, 1.0, n, 16);
    const Deviation e = errorOf(tf, [&](double f, double b, double l) { return table(f, b, l); });
    EXPECT_LT(e.mean, 0.6 * before) << n;
    before = e.mean;
    RecordProperty("comb_" + std::to_string(n), std::to_string(e.largest) + " " + std::to_string(e.mean));
  }
}

TEST(Preintegrated, HoldsThinSegmentsToRelativeAccuracy) {
  const TransferFunction tf = preset("viridis");
  const Preintegrated table(tf, 0.0, 1.0);
  for (double length = 1e-9; length < 1e-2; length *= 10.0) {
    const Radiance truth = integrate(tf, 0.3, 0.7, length);
    EXPECT_LT(difference(table(0.3, 0.7, length), truth), 5e-3 * truth.alpha) << length;
  }
}

TEST(Preintegrated, AnswersOutsideItsRangeAndForNothing) {
  const TransferFunction tf = preset("viridis");
  const Preintegrated table(tf, 0.0, 1.0, 9, 4);
  EXPECT_LT(difference(table(-5.0, -5.0, 1.0), table(0.0, 0.0, 1.0)), 1e-12);
  EXPECT_EQ(table(0.5, 0.5, 0.0).alpha, 0.0);
  EXPECT_EQ(table(0.5, 0.6, std::numeric_limits<double>::max()).alpha, 1.0);
  const Preintegrated clear(tf.scaled(0.0), 0.0, 1.0, 9, 4);
  EXPECT_EQ(clear(0.5, 0.6, 1e9).alpha, 0.0);
  const Preintegrated constant(tf, 0.5, 0.5, 9, 4);
  EXPECT_NEAR(constant(0.5, 0.5, 1.0).alpha, integrate(tf, 0.5, 0.5, 1.0).alpha, 1e-6);
}

TEST(Preintegrated, RefusesWhatCannotBeATable) {
  const TransferFunction tf = preset("viridis");
  EXPECT_THROW(Preintegrated(tf, 1.0, 0.0), Error);
  EXPECT_THROW(Preintegrated(tf, 0.0, std::nan("")), Error);
  EXPECT_THROW(Preintegrated(tf, 0.0, 1.0, 1, 4), Error);
  EXPECT_THROW(Preintegrated(tf, 0.0, 1.0, 60000, 60000), Error);
}

TEST(Average, IsExactOnConstantsAndBlindBetweenItsEnds) {
  const TransferFunction constant({{0.0, {0.25, 0.5, 1.0}, 3.0}});
  EXPECT_LT(difference(average(constant, 0.1, 0.9, 0.7), integrate(constant, 0.1, 0.9, 0.7)), 1e-15);
  const TransferFunction hat({{0.4, {1.0, 1.0, 1.0}, 0.0}, {0.5, {1.0, 1.0, 1.0}, 10.0}, {0.6, {1.0, 1.0, 1.0}, 0.0}});
  EXPECT_EQ(average(hat, 0.0, 1.0, 1.0).alpha, 0.0);
  EXPECT_GT(integrate(hat, 0.0, 1.0, 1.0).alpha, 0.6);
}

TEST(VertexLook, CompositedAloneIsTheSegment) {
  const TransferFunction tf({{0.0, {0.0, 0.5, 1.0}, 1.0}, {1.0, {1.0, 0.5, 0.0}, 3.0}});
  const VertexLook v = vertexLook(tf, 0.2, 0.7, 1.5);
  const Radiance r = integrate(tf, 0.2, 0.7, 1.5);
  EXPECT_NEAR(-std::expm1(-1.5 * v.mean_extinction), r.alpha, 1e-15);
  EXPECT_NEAR(v.color[0] * r.alpha, r.color[0], 1e-15);
  EXPECT_EQ(vertexLook(tf, 0.2, 0.2, 0.0).color, tf(0.2).color);  // a profile vertex
}

TEST(OpacityTexture, IsReadWithinItsBound) {
  constexpr std::size_t size = 64;
  constexpr double largest = 3.0;
  const std::vector<float> texture = opacityTexture(size, largest);
  ASSERT_EQ(texture.size(), size * size);
  const double step = largest / (size - 1);
  const double bound = step * step * (2.0 * largest * largest + 1.0) / 8.0;
  double worst = 0.0;
  for (std::size_t j = 0; j + 1 < size; ++j) {
    for (std::size_t i = 0; i + 1 < size; ++i) {
      const double middle = (texture[j * size + i] + texture[j * size + i + 1] + texture[(j + 1) * size + i] +
                             texture[(j + 1) * size + i + 1]) /
                            4.0;
      const double u = step * (static_cast<double>(i) + 0.5);
      const double v = step * (static_cast<double>(j) + 0.5);
      worst = std::max(worst, std::abs(middle + std::expm1(-u * v)));
    }
  }
  EXPECT_LT(worst, bound);
  EXPECT_GT(worst, bound / 100.0);
}

}  // namespace
}  // namespace spillikin::integrate
