// The defaults, and what is redone when something changes.
#include "spillikin/render/session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "spillikin/base/error.h"
#include "spillikin/mesh/refit.h"
#include "spillikin/project/camera.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/memory.h"
#include "support/meshes.h"

namespace spillikin {
namespace {

TEST(Defaults, TheWholeBoxIsInSight) {
  const render::Box box{{-1.0, 2.0, 5.0}, {3.0, 4.0, 11.0}};
  for (const auto& [width, height] : {std::pair{400, 300}, std::pair{300, 400}, std::pair{200, 200}}) {
    View view;
    view.width = width;
    view.height = height;
    render::placeEye(view, box, {33.0, -20.0, 1.0});
    const project::Camera camera(view);
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p((corner & 1) != 0 ? box.upper.x : box.lower.x, (corner & 2) != 0 ? box.upper.y : box.lower.y,
                   (corner & 4) != 0 ? box.upper.z : box.lower.z);
      const Vec3 s = camera.toScreen(p);
      EXPECT_GT(s.z, 0.0);
      EXPECT_TRUE(s.x >= 0.0 && s.x <= s.z * width) << s.x / s.z;
      EXPECT_TRUE(s.y >= 0.0 && s.y <= s.z * height) << s.y / s.z;
    }
  }
}

TEST(Defaults, ElevationRaisesTheEyeAndAzimuthTurnsItToTheRight) {
  View view;
  view.eye = {0.0, 0.0, 10.0};
  view.target = Vec3(0.0);
  View raised = view;
  render::turnView(raised, {0.0, 30.0, 1.0});
  EXPECT_NEAR(raised.eye.y, 5.0, 1e-12);
  View turned = view;
  render::turnView(turned, {90.0, 0.0, 2.0});
  EXPECT_NEAR(turned.eye.x, 10.0, 1e-12);
  EXPECT_DOUBLE_EQ(turned.view_angle, 15.0);
}

TEST(Defaults, ATypicalRayKeepsAThirdOfItsLight) {
  render::Session session(tests::tetrahedronGrid(12));
  session.setView(session.defaultView(96, 96));
  const Image image = session.draw();
  std::vector<float> alphas;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] > 0.0F) alphas.push_back(image.rgba[i]);
  }
  ASSERT_GT(alphas.size(), 1000U);
  std::nth_element(alphas.begin(), alphas.begin() + static_cast<std::ptrdiff_t>(alphas.size() / 2), alphas.end());
  EXPECT_NEAR(1.0F - alphas[alphas.size() / 2], 1.0F / 3.0F, 0.15F);
}

TEST(Session, AConstantFieldAndNoFieldGiveAPicture) {
  mesh::Source source = tests::tetrahedronGrid(3);
  for (const bool any : {true, false}) {
    source.arrays.clear();
    if (any) tests::addPointArray(source, "constant", [](const Vec3&) { return 4.0; });
    render::Session session(source);
    session.setView(session.defaultView(32, 32));
    const Image image = session.draw();
    EXPECT_GT(image.pixel(16, 16)[3], 0.2F);
    EXPECT_LT(image.pixel(16, 16)[3], 0.95F);
  }
}

TEST(Session, AnImageThatMemoryCannotHoldIsRefusedWithTheFigure) {
  View view;
  view.width = view.height = 16384;
  EXPECT_NO_THROW(render::requireImageMemory(view, std::size_t{16} << 28U));
  try {
    render::requireImageMemory(view, (std::size_t{16} << 28U) - 1);
    FAIL() << "nothing was refused";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("16384 x 16384 pixels takes 4.3 GB"), std::string::npos) << e.what();
  }
  EXPECT_GT(render::availableBytes(), std::size_t{1} << 20U);
}

TEST(Session, OnlyWhatChangedIsRedone) {
  render::Session session(tests::tetrahedronGrid(4));
  session.setView(session.defaultView(48, 48));
  const Image first = session.draw();
  const double sorted_in = session.stats().sort.seconds;
  session.setTransferFunction(session.transferFunction().scaled(2.0));
  const Image denser = session.draw();
  EXPECT_NE(first.rgba, denser.rgba);
  EXPECT_EQ(session.stats().sort.seconds, sorted_in) << "a new transfer function reuses the order";
  session.setTransferFunction(session.transferFunction().scaled(0.5));
  EXPECT_EQ(session.draw().rgba, first.rgba);
}

// Radiographs and smoke: whatever the order, cycles and gaps included, and no pixel is sorted again for it.
TEST(Session, OneColourNeedsNoOrder) {
  const integrate::TransferFunction white({{0.0, {1.0, 1.0, 1.0}, 0.2}, {1.0, {1.0, 1.0, 1.0}, 3.0}});
  ASSERT_TRUE(white.oneColor());
  for (const composite::Backend backend : {composite::Backend::native, composite::Backend::osmesa}) {
    for (const mesh::Source& source :
         {tests::twistedRing(7, 0.5), tests::interlockedTori(4), tests::hexahedronGrid(5, 0.2, 3)}) {
      Image images[2];
      for (const bool sorted : {false, true}) {
        const auto algorithm = sorted ? sort::Algorithm::xmpvo : sort::Algorithm::automatic;
        render::Session session(source, {.sort = algorithm, .backend = backend, .walking = composite::Walking::never});
        View view = session.defaultView(64, 48);
        render::turnView(view, {25.0, 35.0, 1.0});
        session.setView(view);
        session.setTransferFunction(white.mapped(session.field().lo, session.field().hi));
        images[sorted ? 1 : 0] = session.draw();
        EXPECT_TRUE(session.stats().sort.exact);
        EXPECT_EQ(session.stats().sort.algorithm, sorted ? "xmpvo" : "none");
        EXPECT_EQ(session.stats().certificate.flagged, 0U);
      }
      double worst = 0.0;
      for (std::size_t i = 0; i < images[0].rgba.size(); ++i)
        worst = std::max(worst, std::abs(double{images[0].rgba[i]} - double{images[1].rgba[i]}));
      EXPECT_LE(worst, 2e-5) << source.name;
      EXPECT_GT(*std::max_element(images[0].rgba.begin(), images[0].rgba.end()), 0.1F);
    }
  }
}

TEST(Session, ADeformedStepReusesTheAdjacencyAndDrawsTheSamePictureAsAFreshSession) {
  const mesh::Source before = tests::hexahedronGrid(4);
  mesh::Source after = before;
  // Affine, so that faces stay planar: the diagonal of a bent face depends on the numbering, which a fresh build makes
  // anew.
  for (Vec3& p : after.points)
    p += 0.2 * Vec3(p.y, p.z, 0.5 * p.x);
  render::Session moved(before);
  moved.setSource(after);
  moved.setField("");
  EXPECT_TRUE(moved.stats().adjacency_reused);
  render::Session fresh(after);
  const View view = fresh.defaultView(64, 64);
  moved.setView(view);
  fresh.setView(view);
  moved.setTransferFunction(fresh.transferFunction());
  const Image a = moved.draw();
  const Image b = fresh.draw();
  float worst = 0.0F;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    worst = std::max(worst, std::abs(a.rgba[i] - b.rgba[i]));
  EXPECT_LT(worst, 1e-5F);
}

TEST(Session, ADeformedStepIsWalkedOnTheLinksOfTheStepBefore) {
  const mesh::Source before = tests::shell(5);
  mesh::Source after = before;
  for (Vec3& p : after.points)
    p += 0.2 * Vec3(p.y, p.z, 0.5 * p.x);
  const render::Engine engine{.walking = composite::Walking::always};
  render::Session moved(before, engine), fresh(after, engine);
  View view = fresh.defaultView(64, 64);
  moved.setView(view);
  moved.draw();
  const double bytes = moved.stats().bytes_per_cell;
  moved.setSource(after);
  moved.setField("");
  EXPECT_TRUE(moved.stats().adjacency_reused);
  moved.setTransferFunction(fresh.transferFunction());
  fresh.setView(view);
  const Image a = moved.draw(), b = fresh.draw();
  EXPECT_EQ(moved.stats().sort.road, "walk");
  EXPECT_EQ(fresh.stats().sort.road, "walk");
  EXPECT_DOUBLE_EQ(moved.stats().bytes_per_cell, bytes);
  float worst = 0.0F;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    worst = std::max(worst, std::abs(a.rgba[i] - b.rgba[i]));
  EXPECT_LT(worst, 1e-5F);
}

TEST(Session, AStepThatTurnsACellInsideOutIsBuiltAgain) {
  const mesh::Source before = tests::tetrahedronGrid(2);
  mesh::Source mirrored = before;
  for (Vec3& p : mirrored.points)
    p.x = -p.x;
  render::Session session(before);
  session.setSource(mirrored);
  EXPECT_FALSE(session.stats().adjacency_reused);
  EXPECT_EQ(session.buildReport().inverted, session.mesh().cell_count());
}

float largestDifference(const Image& a, const Image& b) {
  float worst = a.rgba.size() == b.rgba.size() ? 0.0F : 1.0F;
  for (std::size_t i = 0; i < std::min(a.rgba.size(), b.rgba.size()); ++i)
    worst = std::max(worst, std::abs(a.rgba[i] - b.rgba[i]));
  return worst;
}

TEST(Session, AcrossGapsAQuickOrderBehindTheCertificateDrawsWhatAnExactOrderDraws) {
  for (const mesh::Source& source : {tests::shell(6), tests::interlockedTori(3)}) {
    render::Session automatic(source, {.walking = composite::Walking::never});
    render::Session exact(source, {.sort = sort::Algorithm::xmpvo});
    View view = automatic.defaultView(96, 96);
    for (int k = 0; k < 6; ++k) {
      render::turnView(view, {57.0, 11.0, 1.0});
      automatic.setView(view);
      exact.setView(view);
      EXPECT_LE(largestDifference(automatic.draw(), exact.draw()), 1e-5F);
      EXPECT_EQ(exact.stats().sort.road, "order");
      EXPECT_EQ(automatic.stats().certificate.unresolved, 0U);
    }
    EXPECT_EQ(automatic.stats().sort.road, "certificate");
    EXPECT_EQ(automatic.stats().sort.algorithm, "mpvonc");
    EXPECT_TRUE(automatic.order().exact) << "who asks for the order gets one that is proven";
  }
}

TEST(Session, SmallCellsAreWalkedThroughWithoutAnOrder) {
  render::Session automatic(tests::shell(6));
  render::Session ordered(tests::shell(6), {.walking = composite::Walking::never});
  for (const int size : {64, 1500}) {
    for (render::Session* session : {&automatic, &ordered})
      session->setView(session->defaultView(size, size));
    EXPECT_LE(largestDifference(automatic.draw(), ordered.draw()), 1e-4F);
    EXPECT_NE(ordered.stats().sort.road, "walk");
    EXPECT_EQ(automatic.stats().sort.road == "walk", size == 64);
    EXPECT_TRUE(automatic.stats().certificate.present);
    if (size != 64) continue;
    EXPECT_TRUE(automatic.stats().sort.exact);
    EXPECT_EQ(automatic.stats().sort.algorithm, "none");
    EXPECT_EQ(automatic.stats().sort.seconds, 0.0);
  }
  EXPECT_TRUE(automatic.order().exact) << "who asks for an order gets one";
  EXPECT_EQ(automatic.stats().sort.road, "order");
}

// Cells that overlap: rays find them out, and the picture is drawn as it was without them.
TEST(Session, WhereRaysLoseTheirWayThereIsAnOrder) {
  mesh::Source shifted = tests::tetrahedronGrid(3);
  for (Vec3& p : shifted.points)
    p += Vec3(0.5, 0.4, 0.3);
  const mesh::Source source = tests::join(tests::tetrahedronGrid(3), shifted);
  render::Session walks(source, {.walking = composite::Walking::always});
  render::Session ordered(source, {.walking = composite::Walking::never});
  for (int k = 0; k < 2; ++k) {
    for (render::Session* session : {&walks, &ordered}) {
      View view = session->defaultView(64, 48);
      render::turnView(view, {30.0 * k, 10.0, 1.0});
      session->setView(view);
    }
    EXPECT_EQ(walks.draw().rgba, ordered.draw().rgba);
    EXPECT_EQ(walks.stats().sort.road, ordered.stats().sort.road);
    EXPECT_EQ(walks.stats().certificate.unresolved, ordered.stats().certificate.unresolved);
  }
  EXPECT_EQ(walks.warnings(), ordered.warnings());
}

TEST(Session, WhereTheCertificateIsTooCoarseTheOrderMustBeExact) {
  const render::Engine in_order{.walking = composite::Walking::never};
  render::Session session(tests::interlockedTori(3), in_order);
  session.setView(session.defaultView(48, 48));
  session.setTransferFunction(session.transferFunction().scaled(1e4));
  session.draw();
  EXPECT_EQ(session.stats().sort.road, "order");
  EXPECT_TRUE(session.stats().sort.exact);
  render::Session convex(tests::tetrahedronGrid(3), in_order);
  convex.setView(convex.defaultView(48, 48));
  convex.draw();
  EXPECT_EQ(convex.stats().sort.road, "order");
}

TEST(Session, ProblemCellsAreCounted) {
  render::Session session(tests::hexahedronGrid(6, 0.3, 3), {.sort = sort::Algorithm::mpvo});
  session.setView(session.defaultView(32, 32));
  session.order();
  const auto& sort = session.stats().sort;
  EXPECT_TRUE(sort.problems_known);
  EXPECT_GT(sort.problem_faces, 0U);
  EXPECT_GE(sort.problem_faces, sort.problem_cells);
  EXPECT_GT(sort.problem_cells, 0U);
  EXPECT_GT(sort.subdivided_cells, 0U);
  render::Session unknown(tests::hexahedronGrid(6, 0.3, 3), {.sort = sort::Algorithm::centroid});
  unknown.order();
  EXPECT_FALSE(unknown.stats().sort.problems_known);
  EXPECT_NE(render::toJson(unknown.stats()).find("\"problem_cells\": null"), std::string::npos);
}

TEST(Session, FoldedCellsAreWarnedOfByTheirFileIds) {
  mesh::Source source = tests::hexahedronGrid(2);
  source.points[26] = {1.9, 1.9, 0.7};  // the last corner, through the bottom of the last cell
  render::Session session(source);
  ASSERT_EQ(session.warnings().size(), 1U);
  EXPECT_NE(session.warnings()[0].find("1 folded cell"), std::string::npos) << session.warnings()[0];
  EXPECT_NE(session.warnings()[0].find("cell 7"), std::string::npos) << session.warnings()[0];
  session.setSource(tests::hexahedronGrid(2));
  EXPECT_TRUE(session.warnings().empty());
  session.setSource(source);
  EXPECT_TRUE(session.stats().adjacency_reused);
  EXPECT_EQ(session.warnings().size(), 1U) << "also where only the nodes have moved";
}

TEST(Session, AnotherTopologyIsBuiltAgain) {
  render::Session session(tests::tetrahedronGrid(2));
  session.setSource(tests::tetrahedronGrid(3));
  session.setField("");
  EXPECT_FALSE(session.stats().adjacency_reused);
  EXPECT_EQ(session.mesh().cell_count(), 27U * 6U);
}

TEST(Warp, AddsTheScaledArrayAndRefusesWhatIsNoVector) {
  mesh::Source source = tests::tetrahedronGrid(1);
  std::vector<double> values;
  for (const Vec3& p : source.points)
    values.insert(values.end(), {p.x, 0.0, 2.0});
  source.arrays.push_back({"shift", mesh::Association::points, 3, values});
  const Vec3 p = source.points.back();
  mesh::warp(source, "shift", 0.5);
  EXPECT_EQ(source.points.back(), p + Vec3(0.5 * p.x, 0.0, 1.0));
  EXPECT_THROW(mesh::warp(source, "value", 1.0), Error);
  EXPECT_THROW(mesh::warp(source, "nothing", 1.0), Error);
}

TEST(Render, OneCallFromAMeshToAnImage) {
  const mesh::Source source = tests::tetrahedronGrid(2);
  View view;
  view.eye = {0.5, 0.5, 5.0};
  view.target = {0.5, 0.5, 0.5};
  view.width = view.height = 16;
  const Image image = render::render(source, view, integrate::preset("viridis").mapped(0.0, 3.0));
  EXPECT_EQ(image.rgba.size(), 16U * 16U * 4U);
  EXPECT_GT(image.pixel(8, 8)[3], 0.0F);
}

}  // namespace
}  // namespace spillikin
