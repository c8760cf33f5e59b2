// The whole picture against the ground truth: every backend, every view, every kind of transfer function, within 1/255
// on every pixel and 1e-4 in the mean. Pixels whose centre lies within 1/256 pixel of an edge-on exterior face are
// counted apart, by that geometric rule alone.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "spillikin/io/read.h"
#include "spillikin/reference/compare.h"
#include "spillikin/reference/reference.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/session.h"
#include "support/meshes.h"

namespace spillikin {
namespace {

constexpr double full_step = 1.0 / 255.0;
constexpr double mean_bound = 1e-4;

const std::array<const char*, 3> looks{"viridis", "steps", "comb"};  // smooth, jumping, comb-like

// Perspective from the front, perspective aslant, parallel aslant.
std::vector<View> views(const render::Session& session, int size) {
  std::vector<View> all(3, session.defaultView(size, size));
  render::turnView(all[1], {37.0, 23.0, 1.2});
  all[2].parallel_scale = render::fittingParallelScale(render::boundingBox(session.mesh()), size, size);
  render::turnView(all[2], {-61.0, 41.0, 1.3});
  return all;
}

integrate::TransferFunction lookOf(const render::Session& session, const char* preset) {
  return render::typicalLook(session.mesh(), session.field(), preset);
}

struct Truth {
  View view;
  integrate::TransferFunction look;
  Image image;
  std::vector<std::uint8_t> edge_on;
  std::string label;
};

std::vector<Truth> truths(render::Session& session, const std::vector<View>& all_views) {
  std::vector<Truth> all;
  const reference::RayCaster caster(session.drawnMesh(), session.drawnField());
  for (std::size_t v = 0; v < all_views.size(); ++v) {
    const auto edge_on = caster.edgeOnMask(all_views[v]);
    for (const char* preset : looks) {
      const auto look = lookOf(session, preset);
      all.push_back({all_views[v], look, caster.render(all_views[v], look, {}), edge_on,
                     "view " + std::to_string(v) + ", " + preset});
    }
  }
  return all;
}

void expectEqual(render::Session& session, const Truth& truth, const char* backend) {
  session.setView(truth.view);
  session.setTransferFunction(truth.look);
  const Image image = session.draw();
  reference::CompareOptions options;
  options.apart = truth.edge_on;
  const auto c = reference::compare(image, truth.image, options);
  EXPECT_LE(c.worst.max, full_step) << backend << ", " << truth.label << ", pixel " << c.worst_x << "," << c.worst_y;
  EXPECT_LE(c.worst.mean, mean_bound) << backend << ", " << truth.label;
  EXPECT_GT(c.pixels, image.rgba.size() / 8) << "most pixels must be compared";
}

void compareBackends(const mesh::Source& source, int size, std::vector<View> only = {}) {
  render::Session native(source, {.backend = composite::Backend::native});
  const auto all = truths(native, only.empty() ? views(native, size) : only);
  render::Session osmesa(source, {.backend = composite::Backend::osmesa});
  for (const Truth& truth : all) {
    expectEqual(native, truth, "native");
    EXPECT_EQ(native.stats().certificate.unresolved, 0U) << truth.label;
    expectEqual(osmesa, truth, "osmesa");
  }
}

TEST(Picture, DelaunayTetrahedraInACube) {
  compareBackends(tests::delaunayCube(600, 11), 256);
}

TEST(Picture, JitteredGridOfTetrahedra) {
  compareBackends(tests::tetrahedronGrid(6, 0.3, 5), 256);
}

// A value of its own for each cell.
mesh::Source withValuesOfCells(mesh::Source source) {
  mesh::Array values{"of cells", mesh::Association::cells, 1, {}};
  for (std::size_t c = 0; c < source.types.size(); ++c)
    values.values.push_back(static_cast<double>(7 * c % 17));
  source.arrays = {values};
  return source;
}

// Rays of the middle row and column run exactly in faces, between cells of other values: all take the same side.
TEST(Picture, RaysAlongFaces) {
  for (const mesh::Source& source :
       {withValuesOfCells(tests::hexahedronGrid(4)), withValuesOfCells(tests::tetrahedronGrid(4))}) {
    const render::Session session(source);
    std::vector<View> front(2, session.defaultView(65, 65));
    front[1].parallel_scale = 0.75;
    compareBackends(source, 65, front);
  }
}

// The same with vertices that lie off the middle planes by less than doubles tell in a sum: which faces such a ray
// meets, and where, takes exact arithmetic, which shaders do not have.
TEST(Picture, RaysAlmostAlongFaces) {
  for (const bool whole : {true, false}) {
    mesh::Source source = whole ? tests::hexahedronGrid(4) : tests::tetrahedronGrid(4);
    const Vec3 middle = source.points[source.points.size() / 2];
    for (std::size_t i = 0; i < source.points.size(); ++i) {
      Vec3& p = source.points[i];
      p -= middle;
      if (p.y == 0.0) p.y = 1e-16 * (static_cast<double>(i % 3) - 1.0);
      if (p.x == 0.0) p.x = 1e-16 * (static_cast<double>(i % 5) - 2.0);
    }
    render::Session session(source, {.backend = composite::Backend::native});
    std::vector<View> front(2, session.defaultView(65, 65));
    for (View& view : front)
      view.eye.x = view.eye.y = view.target.x = view.target.y = 0.0;
    front[1].parallel_scale = 0.75;
    for (const Truth& truth : truths(session, front)) {
      expectEqual(session, truth, "native");
      EXPECT_EQ(session.stats().certificate.unresolved, 0U) << truth.label;
    }
  }
}

// Rays of the middle row run along edges of faces that bend away from them by next to nothing: such a ray leaves the
// cell below where it has come in, and comes back farther on to leave at once.
TEST(Picture, RaysAlongEdgesOfBentFaces) {
  mesh::Source source = tests::hexahedronGrid(4);
  const Vec3 middle = source.points[source.points.size() / 2];
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    Vec3& p = source.points[i];
    p -= middle;
    p.x += 0.05 * std::sin(5.0 * p.y + 3.0 * p.z);
    p.z += 0.05 * std::sin(4.0 * p.x + 2.0 * p.y);
    if (p.y == 0.0 && i % 3 == 0) p.y = -3e-6;
  }
  render::Session session(source, {.backend = composite::Backend::native});
  std::vector<View> aslant;
  for (const double azimuth : {0.0, 17.0, 31.0, 58.0, 90.0, 123.0, 201.0}) {
    View view = session.defaultView(65, 65);
    view.target.y = 0.0;
    view.eye.y = 0.0;
    render::turnView(view, {azimuth, 0.0, 1.0});
    view.eye.y = 0.0;
    aslant.push_back(view);
  }
  for (const Truth& truth : truths(session, aslant)) {
    expectEqual(session, truth, "native");
    EXPECT_EQ(session.stats().certificate.unresolved, 0U) << truth.label;
  }
}

// Over part of the mesh the scalar fades to where float has no numbers left, as what diffuses does.
TEST(Picture, FieldThatFadesToNothing) {
  mesh::Source source = tests::delaunayCube(300, 5);
  mesh::Array fading{"fading", mesh::Association::points, 1, {}};
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    const double x = source.points[i].x;
    fading.values.push_back(x > 0.8 ? x - 0.8 : 1e-43 * static_cast<double>(7 * i % 31));
  }
  source.arrays = {fading};
  render::Session native(source, {.backend = composite::Backend::native});
  render::Session osmesa(source, {.backend = composite::Backend::osmesa});
  const reference::RayCaster caster(native.mesh(), native.field());
  const View view = views(native, 96)[1];
  for (const double extinction : {0.3, 3.0, 30.0}) {
    const integrate::TransferFunction look({{0.1, {0.2, 0.5, 0.8}, extinction}, {0.2, {0.9, 0.4, 0.1}, extinction}});
    const Truth truth{view, look, caster.render(view, look, {}), caster.edgeOnMask(view),
                      "extinction " + std::to_string(extinction)};
    expectEqual(native, truth, "native");
    expectEqual(osmesa, truth, "osmesa");
  }
}

// A gas that only glows, smoke, radiographs and the largest scalar: on gaps, cycles, curved cells and constant ones.
TEST(Picture, UnderAnyOptics) {
  const mesh::Source cells = withValuesOfCells(tests::interlockedTori(5));
  for (const mesh::Source& source :
       {tests::interlockedTori(5), cells, tests::twistedRing(9, 0.5), tests::hexahedronGrid(5, 0.25, 3)}) {
    render::Session native(source, {.backend = composite::Backend::native});
    render::Session osmesa(source, {.backend = composite::Backend::osmesa});
    const reference::RayCaster caster(native.mesh(), native.field());
    const View view = views(native, 96)[1];
    const auto look = lookOf(native, "steps");
    for (const auto optics : {integrate::Optics::emission, integrate::Optics::absorption, integrate::Optics::mip,
                              integrate::Optics::xray, integrate::Optics::absorption_emission}) {
      reference::Options options;
      options.optics = optics;
      const Truth truth{view, look, caster.render(view, look, options), caster.edgeOnMask(view),
                        source.name + ", " + integrate::name(optics)};
      for (render::Session* session : {&native, &osmesa}) {
        session->setOptics(optics);
        expectEqual(*session, truth, session == &native ? "native" : "osmesa");
        if (session->stats().sort.road == "walk") continue;
        EXPECT_EQ(session->stats().sort.algorithm == "none", !integrate::orderMatters(optics)) << truth.label;
      }
    }
  }
}

TEST(Picture, NonconvexShell) {
  compareBackends(tests::shell(8), 128);
}

TEST(Picture, InterlockedTori) {
  compareBackends(tests::interlockedTori(8), 128);
}

TEST(Picture, HexahedraDrawnWhole) {
  compareBackends(tests::hexahedronGrid(6), 128);
}

TEST(Picture, HexahedraWithFacesThatAreNotPlanar) {
  compareBackends(tests::hexahedronGrid(5, 0.25, 3), 128);
}

// Two interlocked rings of twisted prisms: each prism hides the next, the whole way round.
TEST(Picture, CyclicRings) {
  mesh::Source ring = tests::twistedRing(9, 0.5), other = ring;
  for (Vec3& p : other.points)
    p = Vec3(p.y + 0.75, p.z, p.x);
  const mesh::Source source = tests::join(ring, other);
  compareBackends(source, 128);
  // There is a cycle to be found: OpenGL draws what the sort has cut.
  render::Session session(source, {.sort = sort::Algorithm::xmpvo, .backend = composite::Backend::osmesa});
  session.setView(session.defaultView(16, 16));
  EXPECT_FALSE(session.order().cycles.empty());
  EXPECT_FALSE(session.order().cuts.empty());
}

// Strongly deformed hexahedra: problem faces, cells that rays cross twice, curved boundaries.
TEST(Picture, TwistedBar) {
  compareBackends(tests::twistedBar(4, 2.0), 96);
}

TEST(Picture, BallOfCurvedHexahedra) {
  compareBackends(tests::curvedBall(6), 96);
}

TEST(Picture, GridAroundABluntFin) {
  const mesh::Source source = io::readMesh(std::string(SPILLIKIN_EXAMPLES) + "/bluntfin.vts");
  const render::Session session(source);
  View view = session.defaultView(64, 64);
  render::turnView(view, {37.0, 23.0, 2.0});
  compareBackends(source, 64, {view});
}

// A field made from the coordinates, since the file has none.
TEST(Picture, KnotOfHexahedra) {
  const std::filesystem::path path = std::filesystem::path(SPILLIKIN_DATA) / "knot-hex.vtk";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  mesh::Source source = io::readMesh(path.string());
  source.arrays.clear();
  tests::addPointArray(source, "xyz", [](const Vec3& p) { return p.x + 0.5 * p.y - p.z; });
  const render::Session session(source);
  View view = session.defaultView(80, 80);
  render::turnView(view, {25.0, 35.0, 1.0});
  compareBackends(source, 80, {view});
}

// Whole cells and all their tetrahedra: cut into tetrahedra a nonconvex cell must still fill the same place.
TEST(Picture, TetrahedraOfDeformedHexahedra) {
  const mesh::Source source = tests::hexahedronGrid(5, 0.33, 13);
  for (const composite::Backend backend : {composite::Backend::native, composite::Backend::osmesa}) {
    render::Session session(source, {.projection = render::Projection::tets, .backend = backend});
    for (const Truth& truth : truths(session, {views(session, 96)[1]}))
      expectEqual(session, truth, composite::name(backend));
    // With one value everywhere only the thickness counts, which is the same.
    mesh::Source constant = source;
    constant.arrays.clear();
    tests::addPointArray(constant, "one", [](const Vec3&) { return 1.0; });
    const auto tf = integrate::preset("viridis").mapped(0.0, 2.0).scaled(0.3);
    const auto draw = [&](render::Projection projection) {
      render::Session drawn(constant, {.projection = projection, .backend = backend});
      drawn.setView(views(drawn, 96)[1]);
      drawn.setTransferFunction(tf);
      return drawn.draw();
    };
    const auto c = reference::compare(draw(render::Projection::zoo), draw(render::Projection::tets), {});
    EXPECT_LE(c.worst.max, full_step);
    EXPECT_LE(c.worst.mean, mean_bound);
  }
}

TEST(Picture, CellData) {
  mesh::Source source = tests::tetrahedronGrid(5, 0.2, 7);
  source.arrays.clear();
  tests::addCellArray(source, "material", [](const Vec3& p) { return std::floor(4.0 * p.x) + std::floor(3.0 * p.y); });
  compareBackends(source, 128);
}

TEST(Picture, EyeInsideTheMesh) {
  const mesh::Source source = tests::delaunayCube(400, 21);
  View view;
  view.eye = {0.45, 0.52, 0.55};
  view.target = {0.9, 0.1, 0.2};
  view.view_angle = 75.0;
  view.width = view.height = 128;
  compareBackends(source, 128, {view});
}

TEST(Picture, ClippedByTwoPlanes) {
  const mesh::Source source = tests::delaunayCube(400, 22);
  const render::Session session(source);
  View view = session.defaultView(128, 128);
  render::turnView(view, {25.0, 30.0, 1.0});
  view.clips = {{{0.5, 0.5, 0.5}, {1.0, 0.3, 0.2}}, {{0.5, 0.5, 0.4}, {0.0, -0.2, 1.0}}};
  compareBackends(source, 128, {view});
}

// One plate of 12 large tetrahedra between blocks of small ones, each part its own scalar and nearly opaque: small
// cells must not vanish beside a large one, and no depth of centroids may decide.
TEST(Picture, AssemblyOfPartsOfVeryDifferentSize) {
  const auto part = [](std::size_t n, const Vec3& scale, const Vec3& shift, double value) {
    mesh::Source source = tests::tetrahedronGrid(n, 0.0, 1);
    for (Vec3& p : source.points)
      p = p / static_cast<double>(n) * scale + shift;
    source.arrays.clear();
    tests::addPointArray(source, "part", [value](const Vec3&) { return value; });
    return source;
  };
  mesh::Source source = part(8, {0.08, 0.08, 0.08}, {0.45, 0.45, 0.6}, 0.0);
  source = tests::join(source, part(1, {1.0, 1.0, 0.05}, {0.0, 0.0, 0.5}, 1.0));
  source = tests::join(source, part(8, {0.08, 0.08, 0.08}, {0.2, 0.3, 0.3}, 2.0));
  source = tests::join(source, part(1, {1.0, 1.0, 0.05}, {0.0, 0.0, 0.2}, 3.0));

  render::Session native(source, {.backend = composite::Backend::native});
  render::Session osmesa(source, {.backend = composite::Backend::osmesa});
  const auto tf = integrate::preset("viridis").mapped(-1.0, 3.0).scaled(120.0);
  const reference::RayCaster caster(native.mesh(), native.field());
  for (const double azimuth : {0.0, 65.0, 160.0}) {
    View view = native.defaultView(128, 128);
    render::turnView(view, {azimuth, 20.0, 1.2});
    const Truth truth{view, tf, caster.render(view, tf, {}), caster.edgeOnMask(view),
                      "azimuth " + std::to_string(azimuth)};
    expectEqual(native, truth, "native");
    expectEqual(osmesa, truth, "osmesa");
  }
}

TEST(Picture, SameBitsWhateverTheThreadCount) {
  const mesh::Source source = tests::delaunayCube(2000, 31);
  std::vector<Image> images;
  for (const int threads : {1, 2, 3}) {
    const render::ThreadLimit limit(threads);
    render::Session session(source, {.backend = composite::Backend::native});
    session.setView(session.defaultView(200, 150));
    images.push_back(session.draw());
  }
  EXPECT_EQ(images[0].rgba, images[1].rgba);
  EXPECT_EQ(images[0].rgba, images[2].rgba);
}

// The real meshes that are shipped, and all others that are there.
TEST(Picture, ShippedMeshes) {
  for (const char* name : {"post.vtk", "disk_out_ref.ex2"}) {
    SCOPED_TRACE(name);
    compareBackends(io::readMesh(std::string(SPILLIKIN_EXAMPLES) + "/" + name), 96);
  }
}

}  // namespace
}  // namespace spillikin
