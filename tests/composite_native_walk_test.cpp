// Rays that walk through the mesh, against a plain ray caster in double precision.
#include <gtest/gtest.h>

#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <memory>
#include <random>
#include <set>
#include <utility>

#include "spillikin/composite/backends.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_links.h"
#include "spillikin/project/camera.h"
#include "tests/composite_native_checks.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

const sort::Order no_order;

// Draws a frame by walking. False where that needs an order.
bool walk(composite::Compositor& native, composite::Frame& frame, composite::FrameStats& stats, Image& image) {
  frame.walking = composite::Walking::always;
  if (native.needsOrder(frame)) return false;
  frame.ordered = false;
  stats = native.draw(frame, image);
  return true;
}

// Frames of one mesh, drawn without an order. Its inputs must outlive it.
class Walked {
 public:
  explicit Walked(const Subject& subject) : s_(subject), native_(composite::makeNative()) {}

  // Whether rays may walk; stats and image are those of the picture if they did.
  bool draw(const View& view) {
    const project::Camera camera(view);
    composite::Frame frame{s_.mesh, s_.field, s_.tf, camera, no_order};
    frame.same_mesh = frame.same_field = frame.same_transfer_function = drew_;
    drew_ = walk(*native_, frame, stats, image);
    return drew_;
  }

  composite::FrameStats stats;
  Image image;

 private:
  const Subject& s_;
  std::unique_ptr<composite::Compositor> native_;
  bool drew_ = false;
};

void expectWalked(const Subject& s, const View& view, double bound = 0.1 * step) {
  Walked walked(s);
  ASSERT_TRUE(walked.draw(view));
  EXPECT_TRUE(walked.stats.certified);
  EXPECT_GT(walked.stats.fragments, 0U);
  EXPECT_EQ(walked.stats.flagged + walked.stats.unresolved, 0U);
  EXPECT_LE(largestDifference(walked.image, castRays(s, project::Camera(view))), bound);
}

TEST(CompositeNativeWalk, EveryLookInPerspectiveAndInParallel) {
  for (const char* look : {"viridis", "coolwarm", "bands", "comb", "steps"}) {
    for (const double extinction : {0.5, 6.0, 400.0}) {
      SCOPED_TRACE(testing::Message() << look << ", " << extinction);
      const Subject s(delaunayCube(150, 7), "", look, extinction);
      View view = viewOf(s, {1.0, 0.6, 0.8}, 45, 37);
      expectWalked(s, view);
      view.parallel_scale = 0.8;
      expectWalked(s, view);
    }
  }
}

TEST(CompositeNativeWalk, MorePiecesThanAVectorHolds) {
  std::mt19937 random(20);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same colours each time
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const int points : {2, 16, 17, 18, 60}) {
    for (const bool straight : {true, false}) {
      SCOPED_TRACE(testing::Message() << points << (straight ? " straight" : ""));
      Subject s(delaunayCube(150, 7), "", "viridis", 1.0);
      std::vector<integrate::ControlPoint> look;
      for (int k = 0; k < points; ++k) {
        const double v = static_cast<double>(k) / (points - 1);
        look.push_back({s.field.lo + v * (s.field.hi - s.field.lo),
                        {uniform(random), uniform(random), uniform(random)},
                        straight ? 0.5 + 3.0 * v : 6.0 * uniform(random)});
      }
      s.tf = integrate::TransferFunction(look);
      expectWalked(s, viewOf(s, {1.0, 0.6, 0.8}, 35, 26));
    }
  }
}

TEST(CompositeNativeWalk, AcrossGaps) {
  for (const mesh::Source& source : {shell(4), interlockedTori(2)}) {
    SCOPED_TRACE(source.name);
    const Subject s(source, "", "viridis", 5.0);
    expectWalked(s, viewOf(s, {0.3, 0.6, 0.8}, 60, 45));
    View view = viewOf(s, {-0.7, 0.2, 0.5}, 60, 45);
    view.parallel_scale = 1.4;
    expectWalked(s, view);
  }
}

// Parts that share no vertex: one after the other, each with its own walk.
TEST(CompositeNativeWalk, ManyPartsOnOneRay) {
  mesh::Source row = tetrahedronGrid(1);
  for (int k = 1; k < 40; ++k) {
    mesh::Source next = tetrahedronGrid(1);
    for (Vec3& p : next.points)
      p.z += 1.5 * k;
    row = join(row, next);
  }
  const Subject s(row, "", "viridis", 0.1);
  View view = viewOf(s, {0.02, 0.01, 1.0}, 48, 48, 1.5);
  view.view_angle = 3.0;
  expectWalked(s, view);
}

TEST(CompositeNativeWalk, ThicknessesAddUpToTheChord) {
  const Subject s = uniform(delaunayCube(3000, 21), 0.7);
  View view = viewOf(s, {1.0, 0.7, 0.4}, 211, 173, 1.6);
  for (const bool parallel : {false, true}) {
    view.parallel_scale = parallel ? 0.7 : 0.0;
    Walked walked(s);
    ASSERT_TRUE(walked.draw(view));
    ASSERT_TRUE(walked.stats.certified);
    const project::Camera camera(view);
    double worst = 0.0;
    for (int y = 0; y < view.height; ++y) {
      for (int x = 0; x < view.width; ++x) {
        const double drawn = -std::log1p(-double(walked.image.pixel(x, y)[3])) / 0.7;
        worst = std::max(worst, std::abs(drawn - chord(camera, Vec3(0.0), Vec3(1.0), x + 0.5, y + 0.5)));
      }
    }
    EXPECT_LE(worst, 4e-5);
  }
}

// Rays through vertices and along edges and faces: tried again beside them, and certified.
TEST(CompositeNativeWalk, CellsAlignedWithThePixels) {
  for (const double size : {1.0, 0.1}) {  // exact in binary, and not
    SCOPED_TRACE(size);
    mesh::Source source = tetrahedronGrid(8);
    for (Vec3& p : source.points)
      p *= size;
    const Subject s = uniform(source, 0.05 / size);
    View view;
    view.target = Vec3(4.0 * size);
    view.eye = view.target + Vec3(0.0, 0.0, 26.0 * size);
    view.width = view.height = 33;
    view.parallel_scale = 33.0 / 8.0 * size;  // four pixels to a cell
    Walked walked(s);
    ASSERT_TRUE(walked.draw(view));
    EXPECT_TRUE(walked.stats.certified);
    double worst = 0.0;
    for (int y = 2; y < 31; ++y) {
      for (int x = 2; x < 31; ++x)
        worst = std::max(worst, std::abs(double(walked.image.pixel(x, y)[3]) - (1.0 - std::exp(-0.05 * 8.0))));
    }
    EXPECT_LE(worst, 1e-5);
  }
}

// Values that differ from side to side: vertices at one place that are not the same.
TEST(CompositeNativeWalk, AcrossSeams) {
  mesh::Source left = tetrahedronGrid(3, 0.1, 2), right = left;
  for (Vec3& p : right.points)
    p.x = 6.0 - p.x;
  for (std::size_t c = 0; c + 3 < right.connectivity.size(); c += 4)
    std::swap(right.connectivity[c], right.connectivity[c + 1]);
  mesh::Source both = join(left, right);
  addPointArray(both, "side", [](const Vec3& p) { return p.y; });
  const std::size_t half = left.points.size();
  for (auto& array : both.arrays) {
    if (array.name != "side") continue;
    for (std::size_t i = half; i < both.points.size(); ++i)
      array.values[i] += 2.0;
  }
  const Subject s(both, "side", "viridis", 0.6);
  composite::native::Links links;
  ASSERT_TRUE(links.set(s.mesh));
  EXPECT_EQ(links.entrances().size(), 2U * (2U * 9U + 4U * 18U) + 2U * 18U);  // the outside, and both sides of 18 faces
  expectWalked(s, viewOf(s, {0.9, 0.3, 0.4}, 60, 45));
  expectWalked(s, viewOf(s, {-0.9, 0.4, 0.1}, 60, 45));
}

TEST(CompositeNativeWalk, ConstantAtAJump) {
  const Subject s = constantAtJumps();
  expectWalked(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48));
}

TEST(CompositeNativeWalk, SameBitsOnAnyNumberOfThreads) {
  const Subject s(shell(6), "", "bands", 8.0);
  const View view = viewOf(s, {0.3, 0.6, 0.8}, 333, 222);
  Image first;
  for (const std::size_t threads : {1U, 2U, 3U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Walked walked(s);
    ASSERT_TRUE(walked.draw(view));
    if (threads == 1) first = walked.image;
    EXPECT_EQ(first.rgba, walked.image.rgba) << threads;
  }
}

TEST(CompositeNativeWalk, EveryInstructionSetDrawsTheSame) {
  const Subject smooth(delaunayCube(2000, 6), "", "viridis", 8.0);
  const Subject rough(shell(5), "", "comb", 4.0);
  for (const Subject* s : {&smooth, &rough}) {
    const View view = viewOf(*s, {0.3, 0.6, 0.8}, 133, 122);
    Image best;
    const auto targets = composite::native::kernelTargets();
    ASSERT_FALSE(targets.empty());
    for (int k = 0; k < static_cast<int>(targets.size()); ++k) {
      composite::native::chooseKernelTarget(k);
      Walked walked(*s);
      ASSERT_TRUE(walked.draw(view));
      EXPECT_TRUE(walked.stats.certified);
      if (k == 0) best = walked.image;
      EXPECT_LE(largestDifference(best, walked.image), 0.1 * step) << targets[static_cast<std::size_t>(k)];
    }
    composite::native::chooseKernelTarget(-1);
  }
}

// Whatever the picture held before, of any size: less than a tile, and more than one part.
TEST(CompositeNativeWalk, EveryPixelIsWritten) {
  const Subject s(delaunayCube(60, 4), "", "viridis", 8.0);
  const std::pair<int, int> sizes[] = {{1, 1}, {97, 3}, {131, 109}, {2100, 33}};
  for (const auto& [width, height] : sizes) {
    SCOPED_TRACE(testing::Message() << width << " x " << height);
    View view = viewOf(s, {0.3, 0.6, 0.8}, width, height);
    Walked clean(s), used(s);
    ASSERT_TRUE(clean.draw(view));
    used.image = Image(width, height);
    std::fill(used.image.rgba.begin(), used.image.rgba.end(), 0.7F);
    ASSERT_TRUE(used.draw(view));
    EXPECT_EQ(clean.image.rgba, used.image.rgba);
    Image ordered;
    drawWith(*composite::makeNative(), s, view, orderOf(s, view), ordered);
    EXPECT_LE(largestDifference(clean.image, ordered), 0.1 * step);
  }
}

// What is found out of one mesh must not be taken for another.
TEST(CompositeNativeWalk, OneCompositorDrawsSeveralMeshes) {
  const Subject a(delaunayCube(80, 4), "", "viridis", 8.0), b(shell(4), "", "viridis", 5.0);
  const auto native = composite::makeNative();
  for (const Subject* s : {&a, &b, &a}) {
    const View view = viewOf(*s, {0.3, 0.6, 0.8}, 40, 30);
    const project::Camera camera(view);
    composite::Frame frame{s->mesh, s->field, s->tf, camera, no_order};
    composite::FrameStats stats;
    Image image;
    ASSERT_TRUE(walk(*native, frame, stats, image));
    EXPECT_TRUE(stats.certified);
    EXPECT_LE(largestDifference(image, castRays(*s, camera)), 0.1 * step);
  }
}

TEST(CompositeNativeWalk, WhatNeedsAnOrderIsToldBeforehand) {
  const Subject s(delaunayCube(150, 9), "", "coolwarm", 6.0);
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
  EXPECT_TRUE(Walked(s).draw(view));
  View inside = view;
  inside.eye = {0.41, 0.52, 0.47};
  EXPECT_FALSE(Walked(s).draw(inside));
  Subject dense = s;
  dense.tf = s.tf.scaled(1e6);
  EXPECT_FALSE(Walked(dense).draw(view));
  const Subject hexahedra(hexahedronGrid(3), "", "viridis", 1.0);
  EXPECT_FALSE(Walked(hexahedra).draw(viewOf(hexahedra, {1.0, 0.6, 0.8}, 64, 48)));
}

TEST(CompositeNativeWalk, ClipPlanes) {
  for (const char* look : {"viridis", "comb"}) {
    const Subject s(shell(4), "", look, 6.0);
    View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
    view.clips = {{{0.1, 0.1, 0.1}, {1.0, 0.3, -0.2}}, {{0.1, 0.4, 0.1}, {0.0, -1.0, 0.1}}};
    expectWalked(s, view);
    view.parallel_scale = 0.8;
    expectWalked(s, view);
    view.clips = {{{0.0, 0.0, 0.0}, view.eye - view.target}, {{0.2, 0.2, 0.2}, view.target - view.eye}};
    expectWalked(s, view);  // a slab across the line of sight
  }
}

TEST(CompositeNativeWalk, HiddenCells) {
  Subject s(shell(4), "", "viridis", 6.0);
  s.field.hidden.assign(s.mesh.cell_count(), 0);
  for (std::size_t c = 0; c < s.mesh.cell_count(); c += 3)
    s.field.hidden[c] = 1;
  expectWalked(s, viewOf(s, {1.0, 0.6, 0.8}, 64, 48));
}

TEST(CompositeNativeWalk, CellFields) {
  mesh::Source source = delaunayCube(150, 13);
  addCellArray(source, "material", [](const Vec3& p) { return p.x > 0.5 ? 2.0 : p.y > 0.5 ? 1.0 : 0.0; });
  addCellArray(source, "height", [](const Vec3& p) { return p.z; });
  for (const char* name : {"material", "height"}) {
    Subject s(source, name, name[0] == 'm' ? "steps" : "viridis", 3.0);
    View view = viewOf(s, {1.0, 0.6, 0.8}, 64, 48);
    expectWalked(s, view);
    view.clips = {{{0.5, 0.5, 0.5}, {1.0, 0.3, -0.2}}};
    expectWalked(s, view);
    s.field.hidden.assign(s.mesh.cell_count(), 0);
    for (std::size_t c = 1; c < s.mesh.cell_count(); c += 2)
      s.field.hidden[c] = 1;
    expectWalked(s, view);
  }
}

// A field's hidden cells must not be taken for another's.
TEST(CompositeNativeWalk, FieldsChange) {
  Subject all(delaunayCube(150, 13), "", "viridis", 3.0);
  Subject some = all;
  some.field.hidden.assign(some.mesh.cell_count(), 0);
  std::fill_n(some.field.hidden.begin(), some.mesh.cell_count() / 2, std::uint8_t{1});
  const View view = viewOf(all, {1.0, 0.6, 0.8}, 40, 30);
  const project::Camera camera(view);
  const auto native = composite::makeNative();
  bool drew = false;
  for (const Subject* s : {&all, &some, &some, &all}) {
    composite::Frame frame{all.mesh, s->field, all.tf, camera, no_order};
    frame.same_mesh = frame.same_transfer_function = drew;
    drew = true;
    composite::FrameStats stats;
    Image image;
    ASSERT_TRUE(walk(*native, frame, stats, image));
    EXPECT_TRUE(stats.certified);
    EXPECT_LE(largestDifference(image, castRays(*s, camera)), 0.1 * step);
  }
}

// Cells that overlap have no walk: no picture is passed off as right.
TEST(CompositeNativeWalk, OverlapIsNotCertified) {
  mesh::Source shifted = tetrahedronGrid(3);
  for (Vec3& p : shifted.points)
    p += Vec3(0.5, 0.4, 0.3);
  const Subject s(join(tetrahedronGrid(3), shifted), "", "viridis", 0.5);
  Walked walked(s);
  ASSERT_TRUE(walked.draw(viewOf(s, {1.0, 0.6, 0.8}, 64, 48)));
  EXPECT_FALSE(walked.stats.certified);
}

// From behind every link leads one back, through the corner that is opposite there.
TEST(NativeLinks, LeadThereAndBack) {
  for (const mesh::Source& source : {delaunayCube(300, 3), shell(4)}) {
    const mesh::Mesh mesh = mesh::build(source);
    composite::native::Links links;
    ASSERT_TRUE(links.set(mesh));
    std::size_t ends = 0;
    for (std::uint32_t w = 0; w < links.links().size(); ++w) {
      const composite::native::Link link = links.links()[w];
      if (link.way == composite::native::no_way) {
        ++ends;
        continue;
      }
      EXPECT_EQ(links.links()[link.way].way, w);
      std::vector<mesh::Id> corners(mesh.vertices(link.way / 4).begin(), mesh.vertices(link.way / 4).end());
      std::sort(corners.begin(), corners.end());
      EXPECT_EQ(link.corner, corners[link.way % 4]);
      std::set<mesh::Id> both(corners.begin(), corners.end());
      for (const mesh::Id v : mesh.vertices(w / 4))
        both.insert(v);
      EXPECT_EQ(both.size(), 5U);
    }
    EXPECT_EQ(ends, links.entrances().size());
    EXPECT_GT(ends, 0U);
  }
  composite::native::Links none;
  EXPECT_FALSE(none.set(mesh::build(hexahedronGrid(2))));
}

}  // namespace
}  // namespace spillikin::tests
