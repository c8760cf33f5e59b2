// Pictures whose every pixel is known in closed form: slab, box, sphere, cone, linear field, furnace.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <glm/geometric.hpp>

#include "reference_support.h"
#include "spillikin/base/error.h"
#include "spillikin/integrate/segment.h"
#include "spillikin/reference/quadrature.h"

namespace spillikin::tests {
namespace {

using reference::Options;
using reference::Report;

constexpr double float_error = 1.2e-7;  // of a value up to 1 stored as float

double opacity(double extinction, double length) {
  return -std::expm1(-extinction * length);
}

// A homogeneous medium: every pixel is 1 - exp(-extinction * chord), whatever the cells.
TEST(ReferenceTruth, HomogeneousBox) {
  const double extinction = 0.3, gray = 0.75;
  for (const mesh::Source& source : {tetrahedronGrid(5, 0.15), hexahedronGrid(5, 0.15), hexahedronGrid(1)}) {
    const Scene scene(source);
    const Vec3 hi(source.points.size() == 8 ? 1.0 : 5.0);
    for (const bool parallel : {false, true}) {
      View view = lookAt(Vec3(9, 7, 12), 0.5 * hi, 50, 40);
      view.parallel_scale = parallel ? 4.0 : 0.0;
      Report report;
      const Image image = scene.caster.render(view, constantMedium(extinction, gray), {}, &report);
      const reference::Rays rays(view);
      for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
          const double alpha = opacity(extinction, boxChord(rays(x + 0.5, y + 0.5), Vec3(0.0), hi, !parallel));
          ASSERT_NEAR(image.pixel(x, y)[3], alpha, float_error) << fmt::format("pixel {},{}", x, y);
          ASSERT_NEAR(image.pixel(x, y)[0], gray * alpha, float_error) << fmt::format("pixel {},{}", x, y);
        }
      }
      EXPECT_EQ(report.rays, 2000U);
      EXPECT_EQ(report.overlaps, 0U);
      EXPECT_EQ(report.gaps, 0U);
    }
  }
}

// A slab seen straight on: the same opacity at every pixel.
TEST(ReferenceTruth, Slab) {
  mesh::Source source = tetrahedronGrid(4);
  for (Vec3& p : source.points)
    p = Vec3(100.0 * (p.x - 2.0), 100.0 * (p.y - 2.0), 0.5 * p.z);
  const Scene scene(source);
  View view = lookAt({3, 4, 50}, {3, 4, 0}, 32, 32);
  view.parallel_scale = 20.0;
  const Image image = scene.caster.render(view, constantMedium(0.7), {});
  for (int n = 0; n < 32 * 32; ++n) {
    ASSERT_NEAR(image.rgba[static_cast<std::size_t>(4 * n + 3)], opacity(0.7, 2.0), float_error);
  }
}

// Emission equal to the background behind it: nothing shows, whatever the extinction does.
TEST(ReferenceTruth, Furnace) {
  const Scene scene(delaunayCube(800, 5));
  const integrate::TransferFunction tf({{0.5, {0.6, 0.6, 0.6}, 0.0},
                                        {1.5, {0.6, 0.6, 0.6}, 9.0},
                                        {1.5, {0.6, 0.6, 0.6}, 0.1},
                                        {3.0, {0.6, 0.6, 0.6}, 30.0}});
  const Image image = scene.caster.render(lookAt({2, 1.5, 3}, Vec3(0.5), 64, 64), tf, {});
  double most = 0.0;
  for (std::size_t n = 0; n < image.rgba.size(); n += 4) {
    const double alpha = image.rgba[n + 3];
    most = std::max(most, alpha);
    ASSERT_NEAR(image.rgba[n] + (1.0 - alpha) * 0.6, 0.6, 2 * float_error);
  }
  EXPECT_GT(most, 0.5);
}

// A linear field, a linear look: one segment of the closed form per ray, however many cells it is cut into.
TEST(ReferenceTruth, LinearFieldInABox) {
  const auto f = [](const Vec3& p) { return 0.3 * p.x - 0.5 * p.y + 0.2 * p.z; };
  const integrate::TransferFunction tf = ramp(-3.0, 3.0, 2.0);
  for (mesh::Source source : {tetrahedronGrid(5, 0.15), hexahedronGrid(5), hexahedronGrid(5, 0.1)}) {
    addPointArray(source, "linear", f);
    const Scene scene(source, "linear");
    for (const Vec3 eye : {Vec3(14, 9, 12), Vec3(2.5, 2.5, 14), Vec3(-8, -9, 7), Vec3(2.5, 14, 2.6)}) {
      for (const bool parallel : {false, true}) {
        View view = lookAt(eye, Vec3(2.5), 25, 25);  // no ray in the box's own faces
        if (eye.y == 14.0) view.up = {0, 0, 1};
        view.parallel_scale = parallel ? 4.0 : 0.0;
        for (const mesh::FieldModel model : {mesh::FieldModel::face, mesh::FieldModel::tets}) {
          Options options;
          options.model = model;
          const Image image = scene.caster.render(view, tf, options);
          options.quadrature = true;
          const Image other = scene.caster.render(view, tf, options);
          const reference::Rays rays(view);
          for (int y = 0; y < view.height; ++y) {
            for (int x = 0; x < view.width; ++x) {
              const reference::Ray ray = rays(x + 0.5, y + 0.5);
              const double chord = boxChord(ray, Vec3(0.0), Vec3(5.0), !parallel);
              const double length = std::sqrt(glm::dot(ray.direction, ray.direction));
              integrate::Radiance truth;
              if (chord > 0.0) {
                double enter = -1e30;
                for (int axis = 0; axis < 3; ++axis) {
                  if (ray.direction[axis] == 0.0) continue;
                  enter =
                      std::max(enter, ((ray.direction[axis] > 0 ? 0.0 : 5.0) - ray.origin[axis]) / ray.direction[axis]);
                }
                const Vec3 a = ray.origin + enter * ray.direction, b = a + chord / length * ray.direction;
                truth = reference::quadrature(tf, f(a), f(b), chord);
              }
              for (std::size_t c = 0; c < 3; ++c) {
                ASSERT_NEAR(image.pixel(x, y)[c], truth.color[c], float_error) << fmt::format("pixel {},{}", x, y);
                ASSERT_NEAR(other.pixel(x, y)[c], truth.color[c], float_error) << fmt::format("pixel {},{}", x, y);
              }
              ASSERT_NEAR(image.pixel(x, y)[3], truth.alpha, float_error);
            }
          }
        }
      }
    }
  }
}

// Moves the grid of n^3 cells to the unit ball, or to a cone of height 1 over the unit disc.
mesh::Source ball(std::size_t n) {
  mesh::Source source = tetrahedronGrid(n);
  for (Vec3& p : source.points) {
    const Vec3 q = p * (2.0 / static_cast<double>(n)) - Vec3(1.0);
    const double radius = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)});
    const double length = std::sqrt(glm::dot(q, q));
    p = length > 0.0 ? q * (radius / length) : q;
  }
  return source;
}

mesh::Source cone(std::size_t n) {
  mesh::Source source = tetrahedronGrid(n);
  for (Vec3& p : source.points) {
    const Vec3 q = p * (1.0 / static_cast<double>(n));
    const double x = 2.0 * q.x - 1.0, y = 2.0 * q.y - 1.0;
    const double radius = std::max(std::abs(x), std::abs(y)), length = std::hypot(x, y);
    const double part = length > 0.0 ? radius / length * (1.0 - 0.9 * q.z) : 0.0;  // cut off at a tenth of its radius
    p = Vec3(x * part, y * part, 0.9 * q.z);
  }
  return source;
}

double ballChord(const reference::Ray& ray) {
  const double dd = glm::dot(ray.direction, ray.direction);
  const double along = -glm::dot(ray.origin, ray.direction) / dd;
  const Vec3 closest = ray.origin + along * ray.direction;
  return 2.0 * std::sqrt(std::max(0.0, 1.0 - glm::dot(closest, closest)));
}

// The part of the ray in x^2 + y^2 <= (1 - z)^2, 0 <= z <= 0.9.
double coneChord(const reference::Ray& ray) {
  // (o + t d) in the quadratic x^2 + y^2 - (1 - z)^2 = 0.
  const Vec3 &o = ray.origin, &d = ray.direction;
  const double h = 1.0 - o.z;
  const double a = d.x * d.x + d.y * d.y - d.z * d.z, b = o.x * d.x + o.y * d.y + h * d.z,
               c = o.x * o.x + o.y * o.y - h * h;
  double lo = -o.z / d.z, hi = (0.9 - o.z) / d.z;
  if (lo > hi) std::swap(lo, hi);
  // Inside is where the quadratic is not positive: between its roots, or, for a ray steeper than the cone's side,
  // outside of them.
  const double root = b * b - a * c;
  if (root < 0.0) return a < 0.0 ? (hi - lo) * std::sqrt(glm::dot(d, d)) : 0.0;
  double t0 = (-b - std::sqrt(root)) / a, t1 = (-b + std::sqrt(root)) / a;
  if (t0 > t1) std::swap(t0, t1);
  if (a > 0.0) return std::max(0.0, std::min(hi, t1) - std::max(lo, t0)) * std::sqrt(glm::dot(d, d));
  const double before = std::max(0.0, std::min(hi, t0) - lo), after = std::max(0.0, hi - std::max(lo, t1));
  return (before + after) * std::sqrt(glm::dot(d, d));
}

template <class Make, class Chord>
double meanError(const Make& make, const Chord& chord, std::size_t n, const View& view) {
  const Scene scene(make(n));
  const Image image = scene.caster.render(view, constantMedium(1.0), {});
  const reference::Rays rays(view);
  double sum = 0.0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      sum += std::abs(image.pixel(x, y)[3] - opacity(1.0, chord(rays(x + 0.5, y + 0.5))));
    }
  }
  return sum / (view.width * view.height);
}

// Flat faces inscribed in a curved body miss its volume, and so its mean chord, by O(h^2).
template <class Make, class Chord>
void expectSecondOrder(const Make& make, const Chord& chord, const View& view) {
  double last = 0.0;
  for (const std::size_t n : {4U, 8U, 16U}) {
    const double error = meanError(make, chord, n, view);
    if (last > 0.0) {
      const double order = std::log2(last / error);
      EXPECT_GT(order, 1.8) << "from " << last << " to " << error;
      EXPECT_LT(order, 2.2) << "from " << last << " to " << error;
    }
    last = error;
  }
  EXPECT_LT(last, 5e-3);
}

TEST(ReferenceTruth, SphereToSecondOrder) {
  expectSecondOrder(ball, ballChord, lookAt({2.1, 2.4, 3.0}, Vec3(0.0), 80, 80));
  View view = lookAt({0.3, 0.4, 3.0}, Vec3(0.0), 80, 80);
  view.parallel_scale = 1.1;
  expectSecondOrder(ball, ballChord, view);
}

TEST(ReferenceTruth, ConeToSecondOrder) {
  expectSecondOrder(cone, coneChord, lookAt({2.6, 2.2, 2.0}, Vec3(0.0, 0.0, 0.4), 80, 80));
  expectSecondOrder(cone, coneChord, lookAt({0.6, 0.2, 4.0}, Vec3(0.0, 0.0, 0.4), 80, 80));
}

// A smooth field on finer and finer tetrahedra against its own finest sequence in closed form: along an axis, f is a
// parabola whose chords are the interpolant; the picture converges with O(h^2).
TEST(ReferenceTruth, SmoothFieldToSecondOrder) {
  const integrate::TransferFunction tf = ramp(0.0, 1.0, 3.0);
  const auto f = [](const Vec3& p) { return p.z * (1.0 - p.z) * 3.0 + 0.1; };
  // The truth: 4096 linear pieces of f along z, which is what every ray of the parallel view sees.
  integrate::Radiance truth;
  constexpr int pieces = 4096;
  for (int n = 0; n < pieces; ++n) {
    const double a = 1.0 - static_cast<double>(n) / pieces, b = 1.0 - static_cast<double>(n + 1) / pieces;
    truth = over(truth, integrate::integrate(tf, f({0, 0, a}), f({0, 0, b}), 1.0 / pieces));
  }
  double last = 0.0;
  for (const std::size_t n : {4U, 8U, 16U, 32U}) {
    mesh::Source source = tetrahedronGrid(n);
    for (Vec3& p : source.points)
      p = p * (1.0 / static_cast<double>(n));
    addPointArray(source, "f", f);
    const Scene scene(source, "f");
    View view = lookAt({0.5, 0.5, 3.0}, Vec3(0.5), 9, 9);
    view.parallel_scale = 0.45;
    const Image image = scene.caster.render(view, tf, {});
    double error = 0.0;
    for (int p = 0; p < 81; ++p) {
      error = std::max(error, std::abs(image.rgba[static_cast<std::size_t>(4 * p)] - truth.color[0]));
    }
    if (last > 0.0) {
      EXPECT_GT(std::log2(last / error), 1.9);
    }
    last = error;
  }
  EXPECT_LT(last, 1e-3);
}

TEST(ReferenceTruth, CellFieldIsConstantInEachCell) {
  mesh::Source source = hexahedronGrid(3, 0.1);
  addCellArray(source, "c", [](const Vec3& p) { return std::floor(p.x); });
  const Scene scene(source, "c");
  std::vector<reference::Interval> intervals;
  for (const mesh::FieldModel model :
       {mesh::FieldModel::face, mesh::FieldModel::tets, mesh::FieldModel::isoparametric}) {
    Options options;
    options.model = model;
    scene.caster.intervals(lookAt({9, 7, 8}, Vec3(1.5), 10, 10), 5.0, 5.0, options, intervals);
    ASSERT_FALSE(intervals.empty());
    for (const reference::Interval& i : intervals) {
      EXPECT_EQ(i.front, scene.field.values[i.cell]);
      EXPECT_EQ(i.back, scene.field.values[i.cell]);
    }
  }
}

TEST(ReferenceTruth, SameBitsWhateverTheThreads) {
  const Scene scene(delaunayCube(3000, 11));
  const View view = lookAt({1.5, 1.2, 2.0}, Vec3(0.5), 60, 50);
  Options options;
  options.samples = 3;
  const auto render = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return scene.caster.render(view, ramp(0.5, 3.5, 5.0), options);
  };
  const Image one = render(1);
  EXPECT_EQ(one.rgba, render(2).rgba);
  EXPECT_EQ(one.rgba, render(7).rgba);
}

TEST(ReferenceTruth, ClipPlanesTrimAndKeepTheField) {
  mesh::Source source = hexahedronGrid(1);
  addPointArray(source, "z", [](const Vec3& p) { return p.z; });
  const Scene scene(source, "z");
  View view = lookAt({0.5, 0.5, 4.0}, Vec3(0.5), 5, 5);
  view.parallel_scale = 0.4;
  view.clips = {{{0, 0, 0.75}, {0, 0, -2}}, {{0, 0, 0.25}, {0, 0, 3}}};
  std::vector<reference::Interval> intervals;
  scene.caster.intervals(view, 2.5, 2.5, {}, intervals);
  ASSERT_EQ(intervals.size(), 1U);
  EXPECT_DOUBLE_EQ(intervals[0].front, 0.75);
  EXPECT_DOUBLE_EQ(intervals[0].back, 0.25);
  EXPECT_DOUBLE_EQ(intervals[0].enter, 3.25);
  EXPECT_DOUBLE_EQ(intervals[0].leave, 3.75);
  view.clips = {{{0, 0, 2}, {0, 0, 1}}};
  scene.caster.intervals(view, 2.5, 2.5, {}, intervals);
  EXPECT_TRUE(intervals.empty());
}

// The eye in the middle of a cell: the entry behind it fixes the field, the trim its value at the eye.
TEST(ReferenceTruth, EyeInsideACell) {
  mesh::Source source = hexahedronGrid(1);
  addPointArray(source, "z", [](const Vec3& p) { return p.z; });
  const Scene scene(source, "z");
  const View view = lookAt({0.5, 0.5, 0.625}, {0.5, 0.5, 0.0}, 5, 5);
  std::vector<reference::Interval> intervals;
  scene.caster.intervals(view, 2.5, 2.5, {}, intervals);
  ASSERT_EQ(intervals.size(), 1U);
  EXPECT_DOUBLE_EQ(intervals[0].enter, 0.0);
  EXPECT_DOUBLE_EQ(intervals[0].front, 0.625);
  EXPECT_DOUBLE_EQ(intervals[0].leave, 0.625);
  EXPECT_DOUBLE_EQ(intervals[0].back, 0.0);
}

TEST(ReferenceTruth, SamplesTendToTheMean) {
  const Scene scene(tetrahedronGrid(2, 0.1));
  const View view = lookAt({5, 4, 6}, Vec3(1.0), 12, 12);
  Options many, few;
  many.samples = 400;
  few.samples = 25;
  const Image truth = scene.caster.render(view, constantMedium(1.0), many);
  const Image some = scene.caster.render(view, constantMedium(1.0), few);
  const Image centre = scene.caster.render(view, constantMedium(1.0), {});
  double some_error = 0.0, centre_error = 0.0;
  for (std::size_t n = 3; n < truth.rgba.size(); n += 4) {
    some_error += std::abs(static_cast<double>(some.rgba[n]) - static_cast<double>(truth.rgba[n]));
    centre_error += std::abs(static_cast<double>(centre.rgba[n]) - static_cast<double>(truth.rgba[n]));
  }
  EXPECT_LT(some_error, 0.2 * centre_error);
  EXPECT_GT(some_error, 0.0);
}

TEST(ReferenceTruth, RefusesImpossibleViews) {
  const Scene scene(hexahedronGrid(1));
  const auto tf = constantMedium(1.0);
  EXPECT_THROW(scene.caster.render(lookAt({0, 0, 5}, {0, 0, 0}, 0, 4), tf, {}), Error);
  EXPECT_THROW(scene.caster.render(lookAt({0, 0, 5}, {0, 0, 5}, 4, 4), tf, {}), Error);
  EXPECT_THROW(scene.caster.render(lookAt({0, 5, 0}, {0, 0, 0}, 4, 4), tf, {}), Error);
  EXPECT_THROW(scene.caster.render(lookAt({0, 0, std::nan("")}, {0, 0, 0}, 4, 4), tf, {}), Error);
  EXPECT_THROW(scene.caster.render(lookAt({0, 0, 1e11}, {0, 0, 0}, 4, 4), tf, {}), Error);
  View wide = lookAt({0, 0, 5}, {0, 0, 0}, 4, 4);
  wide.view_angle = 180.0;
  EXPECT_THROW(scene.caster.render(wide, tf, {}), Error);
  wide = lookAt({0, 0, 5}, {0, 0, 0}, 4, 4);
  wide.clips = {{{0, 0, 0}, {0, 0, 0}}};
  EXPECT_THROW(scene.caster.render(wide, tf, {}), Error);
  Options options;
  options.samples = 0;
  EXPECT_THROW(scene.caster.render(lookAt({0, 0, 5}, {0, 0, 0}, 4, 4), tf, options), Error);
}

}  // namespace
}  // namespace spillikin::tests
