// The OpenGL compositors against a plain ray caster in double precision, and against chords known in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "spillikin/base/error.h"
#include "spillikin/composite/backends.h"
#include "spillikin/integrate/preintegrated.h"
#include "spillikin/project/camera.h"
#include "tests/composite_native_support.h"
#include "tests/support/meshes.h"

namespace spillikin::tests {
namespace {

constexpr double exact_bound = 2e-5;  // far below a step of 1/255
constexpr double mean_bound = 1e-5;

double meanDifference(const Image& a, const Image& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    sum += std::abs(double(a.rgba[i]) - double(b.rgba[i]));
  }
  return sum / static_cast<double>(a.rgba.size());
}

// One context for all tests: making one takes longer than drawing.
composite::Compositor& osmesa() {
  static const std::unique_ptr<composite::Compositor> compositor = composite::makeOsmesa();
  return *compositor;
}

Image drawOrdered(const Subject& s, const View& view, const sort::Order& order,
                  composite::Integration integration = composite::Integration::exact,
                  composite::Compositor& compositor = osmesa()) {
  Image image;
  const project::Camera camera(view);
  const composite::FrameStats stats = compositor.draw({s.mesh, s.field, s.tf, camera, order, integration}, image);
  EXPECT_GT(stats.fragments, 0U);
  EXPECT_GT(stats.polygons, 0U);
  EXPECT_FALSE(stats.certified);
  return image;
}

Image drawGl(const Subject& s, const View& view, composite::Integration integration = composite::Integration::exact) {
  return drawOrdered(s, view, orderOf(s, view), integration);
}

void expectExact(const Subject& s, const View& view) {
  const Image image = drawGl(s, view);
  const Image truth = castRays(s, project::Camera(view));
  EXPECT_LE(largestDifference(image, truth), exact_bound);
  EXPECT_LE(meanDifference(image, truth), mean_bound);
}

View parallel(View view, double scale) {
  view.parallel_scale = scale;
  return view;
}

TEST(CompositeGl, DelaunayCube) {
  for (const char* look : {"viridis", "bands", "comb", "steps"}) {
    SCOPED_TRACE(look);
    const Subject s(delaunayCube(60, 7), "", look, 6.0);
    const View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 31);
    expectExact(s, view);
    expectExact(s, parallel(viewOf(s, {-0.4, 0.6, 0.8}, 31, 40), 0.8));
  }
}

TEST(CompositeGl, OpaqueDepthsOfMillions) {
  const Subject s(delaunayCube(60, 8), "", "viridis", 1e6);
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 40, 31));
}

TEST(CompositeGl, EyeInside) {
  const Subject s(delaunayCube(60, 9), "", "coolwarm", 6.0);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
  view.eye = {0.41, 0.52, 0.47};
  view.target = {0.9, 0.1, 0.8};
  view.view_angle = 80.0;
  expectExact(s, view);
  const Subject hexahedra(hexahedronGrid(4, 0.1, 3), "", "viridis", 1.0);
  view.eye = {1.7, 2.2, 1.9};
  view.target = {4.0, 0.5, 3.0};
  expectExact(hexahedra, view);
}

TEST(CompositeGl, ClipPlanes) {
  const Subject s(delaunayCube(60, 10), "", "viridis", 6.0);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
  view.clips = {{{0.5, 0.5, 0.5}, {1.0, 0.3, -0.2}}, {{0.5, 0.7, 0.5}, {0.0, -1.0, 0.1}}};
  expectExact(s, view);
  expectExact(s, parallel(view, 0.8));
}

TEST(CompositeGl, WholeCells) {
  const Subject hexahedra(hexahedronGrid(4, 0.15, 3), "", "viridis", 1.5);
  expectExact(hexahedra, viewOf(hexahedra, {1.0, 0.6, 0.8}, 40, 30));
  expectExact(hexahedra, parallel(viewOf(hexahedra, {1.0, 0.6, 0.8}, 40, 30), 3.0));
  const std::vector<Vec3> wedge{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.1, 0, 1}, {1, 0.2, 1.1}, {0, 1, 0.8}};
  const std::vector<Vec3> pyramid{{0, 0, 0}, {1, 0, 0.1}, {1.1, 1, 0}, {0, 1, 0.1}, {0.4, 0.6, 1}};
  const std::vector<Vec3> polyhedron{{0, 0, 0},     {1, 0, 0},     {0, 1, 0},       {0, 0, 1},       {0.9, 0.8, 0.1},
                                     {0.8, 0.1, 1}, {0.1, 0.9, 1}, {0.7, 0.7, 0.9}, {0.5, -0.4, 0.5}};
  for (const auto& [type, points] : {std::pair{mesh::vtk_cell::wedge, wedge},
                                     {mesh::vtk_cell::pyramid, pyramid},
                                     {mesh::vtk_cell::polyhedron, polyhedron}}) {
    SCOPED_TRACE(int(type));
    const Subject s(oneCell(type, points), "", "viridis", 3.0);
    expectExact(s, viewOf(s, {0.3, 0.6, 0.8}, 40, 30));
  }
}

// A cell whose quadrilateral is folded inwards: rays cross it twice, in two intervals.
TEST(CompositeGl, NonconvexHexahedron) {
  const Subject s(
      oneCell(mesh::vtk_cell::hexahedron,
              {{0, 0, 0.9}, {1, 0, 0}, {1, 1, 0.9}, {0, 1, 0}, {0, 0, 1.8}, {1, 0, 1}, {1, 1, 1.8}, {0, 1, 1}}),
      "", "viridis", 3.0);
  for (const Vec3& from : {Vec3(1.0, 1.0, 0.02), Vec3(1.0, -1.0, 0.02), Vec3(0.3, 0.2, 1.0)}) {
    expectExact(s, viewOf(s, from, 60, 50));
  }
}

TEST(CompositeGl, CellFields) {
  for (const char* look : {"viridis", "steps"}) {
    for (mesh::Source source : {delaunayCube(60, 12), hexahedronGrid(4, 0.15, 3)}) {
      addCellArray(source, "cells", [](const Vec3& p) { return std::sin(7.0 * p.x) + p.y * p.z; });
      const Subject s(source, "cells", look, 3.0);
      expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 40, 30));
    }
  }
}

TEST(CompositeGl, HiddenCells) {
  Subject s(delaunayCube(60, 13), "", "viridis", 4.0);
  s.field.hidden.assign(s.mesh.cell_count(), 0);
  for (std::size_t c = 0; c < s.mesh.cell_count(); c += 3) {
    s.field.hidden[c] = 1;
  }
  expectExact(s, viewOf(s, {1.0, 0.6, 0.8}, 40, 30));
}

// A small variation on a large value, far from the origin, in tiny units, seen from very far away.
TEST(CompositeGl, AwkwardNumbers) {
  mesh::Source source = delaunayCube(60, 14);
  for (Vec3& p : source.points) {
    p = Vec3(3e-3, -2e-3, 5e-3) + 1e-6 * p;
  }
  addPointArray(source, "pressure", [](const Vec3& p) { return 101325.0 + 1e3 * p.x * std::sin(4e6 * p.y); });
  const Subject s(source, "pressure", "comb", 5e6);
  View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30, 1000.0);
  view.view_angle = 0.08;
  expectExact(s, view);
}

// The value of every vertex sits on a jump: the upper side holds everywhere.
TEST(CompositeGl, ConstantFieldOnAJump) {
  mesh::Source source = delaunayCube(60, 15);
  addPointArray(source, "constant", [](const Vec3&) { return 0.3; });
  Subject s(source, "constant", "viridis", 1.0);
  s.tf = integrate::TransferFunction(
      {{0.0, {1, 0, 0}, 5.0}, {0.3, {1, 0, 0}, 5.0}, {0.3, {0, 1, 0}, 2.0}, {1.0, {0, 1, 0}, 2.0}});
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
  const Image image = drawGl(s, view);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    EXPECT_EQ(image.rgba[i], 0.0F);
  }
  EXPECT_LE(largestDifference(image, castRays(s, project::Camera(view))), exact_bound);
}

// Extinction of a constant field from the length of its rays: a box, by the slabs of its sides.
double boxChord(const project::Camera& camera, double x, double y, double n) {
  const Vec3 origin = camera.origin(x, y);
  const Vec3 direction = camera.direction(x, y);
  double near = camera.parallel() ? -1e300 : 0.0;
  double far = 1e300;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (0.0 - origin[axis]) / direction[axis];
    const double b = (n - origin[axis]) / direction[axis];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return std::max(0.0, far - near) * glm::length(direction);
}

constexpr double thin = 0.05;  // extinction of the aligned grids
constexpr double grid_size = 8.0;

// On a pixel centre that lies on a side of the box seen edge-on, the ray may go to either side of it.
double chordError(const project::Camera& camera, int i, int j, double alpha) {
  double error = 1.0;
  for (const double dx : {0.0, -1.0 / 256.0, 1.0 / 256.0}) {
    for (const double dy : {0.0, -1.0 / 256.0, 1.0 / 256.0}) {
      const double chord = boxChord(camera, i + 0.5 + dx, j + 0.5 + dy, grid_size);
      const bool sides_apart = std::abs(chord - boxChord(camera, i + 0.5, j + 0.5, grid_size)) > 1.0;
      if ((dx == 0.0 && dy == 0.0) || sides_apart) {
        error = std::min(error, std::abs(-std::expm1(-thin * chord) - alpha));
      }
    }
  }
  return error;
}

// Cells, edges and vertices exactly behind pixel centres: no ray slips between cells, none is counted twice.
TEST(CompositeGl, ChordsOfAlignedGrids) {
  for (const mesh::Source& source : {hexahedronGrid(8), tetrahedronGrid(8)}) {
    Subject s(source, "", "viridis", 1.0);
    s.tf = integrate::TransferFunction({{0.0, {1, 1, 1}, thin}});
    View view;
    view.target = {4.0, 4.0, 4.0};
    view.width = view.height = 45;  // a parallel view of ten cells: 4.5 pixels each, every second line on a centre
    for (const Vec3& from : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(1, 1, 1), Vec3(-1, 2, 1)}) {
      for (const double scale : {0.0, 5.0}) {
        view.eye = view.target + 20.0 * from;
        view.up = {0.0, 1.0, 0.0};
        view.parallel_scale = scale;
        const project::Camera camera(view);
        const Image image = drawGl(s, view);
        double worst = 0.0;
        for (int j = 0; j < view.height; ++j) {
          for (int i = 0; i < view.width; ++i) {
            worst = std::max(worst, chordError(camera, i, j, double(image.pixel(i, j)[3])));
          }
        }
        EXPECT_LE(worst, 1e-5);
      }
    }
  }
}

// A cell cut by a plane, each piece drawn in its own place of the order, gives what the whole cell gives.
TEST(CompositeGl, CutCells) {
  for (const mesh::Source& source : {delaunayCube(60, 16), hexahedronGrid(3, 0.1, 3)}) {
    const Subject s(source, "", "viridis", 4.0);
    const View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
    const sort::Order whole = orderOf(s, view);
    sort::Order cut;
    const Vec3 away = glm::normalize(view.target - view.eye);
    for (const mesh::Id cell : whole.cells) {
      Vec3 middle(0.0);
      for (const mesh::Id v : s.mesh.vertices(cell)) {
        middle += s.mesh.points[v] / static_cast<double>(s.mesh.vertices(cell).size());
      }
      const sort::HalfSpace behind{away, -glm::dot(away, middle)}, before{-behind.normal, -behind.offset};
      const auto entry = static_cast<std::uint32_t>(cut.cells.size());
      cut.cells.insert(cut.cells.end(), {cell, cell});
      cut.cuts.add(entry, {&behind, 1});
      cut.cuts.add(entry + 1, {&before, 1});
    }
    EXPECT_LE(largestDifference(drawOrdered(s, view, whole), drawOrdered(s, view, cut)), 1e-5);
    EXPECT_LE(largestDifference(drawOrdered(s, view, cut, composite::Integration::vertex),
                                drawOrdered(s, view, whole, composite::Integration::vertex)),
              0.1);
  }
}

// What is kept from frame to frame gives the picture that a fresh compositor gives.
TEST(CompositeGl, KeptState) {
  const Subject a(delaunayCube(60, 17), "", "viridis", 4.0);
  const Subject b(hexahedronGrid(3, 0.1, 3), "", "steps", 1.0);
  const View first = viewOf(a, {1.0, 0.6, 0.8}, 40, 30);
  const View second = viewOf(a, {-1.0, 0.3, 0.5}, 50, 20);
  const auto compositor = composite::makeOsmesa();
  const Image fresh = drawGl(a, second);
  drawOrdered(a, first, orderOf(a, first), composite::Integration::exact, *compositor);
  Image kept;
  const project::Camera camera(second);
  const sort::Order order = orderOf(a, second);
  compositor->draw({a.mesh, a.field, a.tf, camera, order, composite::Integration::exact, true, true, true}, kept);
  EXPECT_EQ(kept.rgba, fresh.rgba);
  const View other = viewOf(b, {1.0, 0.6, 0.8}, 40, 30);
  EXPECT_EQ(drawOrdered(b, other, orderOf(b, other), composite::Integration::exact, *compositor).rgba,
            drawGl(b, other).rgba);
  const auto recoloured = a.tf.scaled(2.0);
  compositor->draw({a.mesh, a.field, a.tf, camera, order}, kept);
  compositor->draw({a.mesh, a.field, recoloured, camera, order, composite::Integration::exact, true, true, false},
                   kept);
  Subject c = a;
  c.tf = recoloured;
  EXPECT_EQ(kept.rgba, drawGl(c, second).rgba);
}

// A frame in another mode between two of the same scene, and the first sight of a scene in another mode.
TEST(CompositeGl, KeptStateAcrossModes) {
  const Subject a(delaunayCube(60, 22), "", "viridis", 4.0);
  const Subject b(hexahedronGrid(3, 0.1, 3), "", "steps", 1.0);
  const auto compositor = composite::makeOsmesa();
  const auto draw = [&](const Subject& s, composite::Integration integration, bool same_mesh, bool same) {
    const View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
    const project::Camera camera(view);
    const sort::Order order = orderOf(s, view);
    Image image;
    compositor->draw({s.mesh, s.field, s.tf, camera, order, integration, same_mesh, same, same}, image);
    EXPECT_EQ(image.rgba, drawGl(s, view, integration).rgba);
  };
  draw(a, composite::Integration::exact, false, false);
  draw(a, composite::Integration::vertex, true, true);
  draw(a, composite::Integration::exact, true, true);
  draw(a, composite::Integration::preintegrated, true, true);
  draw(a, composite::Integration::average, true, true);
  draw(b, composite::Integration::vertex, false, false);
  draw(b, composite::Integration::exact, true, true);
  draw(b, composite::Integration::preintegrated, true, true);
}

// Wider than the framebuffer: drawn in tiles, without a seam.
TEST(CompositeGl, Tiles) {
  Subject s(hexahedronGrid(2), "", "viridis", 1.0);
  s.tf = integrate::TransferFunction({{0.0, {1, 1, 1}, 0.4}});
  View view = viewOf(s, {0.2, 0.3, 1.0}, 9001, 3, 1.0);
  view.view_angle = 0.02;
  const project::Camera camera(view);
  const Image image = drawGl(s, view);
  double worst = 0.0;
  for (int i = 0; i < view.width; ++i) {
    const double truth = -std::expm1(-0.4 * boxChord(camera, i + 0.5, 1.5, 2.0));
    worst = std::max(worst, std::abs(truth - double(image.pixel(i, 1)[3])));
  }
  EXPECT_LE(worst, 1e-5);
}

// Each mode against the same sum of its own segments in double precision.
template <class Segment>
Image castSegments(const Subject& s, const View& view, const Segment& segment) {
  const project::Camera camera(view);
  Image image(camera.width(), camera.height());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double scale = glm::length(camera.direction(x + 0.5, y + 0.5));
      integrate::Radiance sum;
      for (const RaySpan& span : raySpans(s, camera, x + 0.5, y + 0.5)) {
        sum = integrate::over(sum, segment(span.front, span.back, (span.far - span.near) * scale));
      }
      for (std::size_t k = 0; k < 3; ++k) {
        image.pixel(x, y)[k] = static_cast<float>(sum.color[k]);
      }
      image.pixel(x, y)[3] = static_cast<float>(sum.alpha);
    }
  }
  return image;
}

TEST(CompositeGl, AverageIntegration) {
  const Subject s(delaunayCube(60, 18), "", "viridis", 6.0);
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
  const Image truth = castSegments(
      s, view, [&](double front, double back, double length) { return integrate::average(s.tf, front, back, length); });
  EXPECT_LE(largestDifference(drawGl(s, view, composite::Integration::average), truth), 1e-5);
}

TEST(CompositeGl, PreintegratedIntegration) {
  const Subject s(delaunayCube(60, 19), "", "bands", 6.0);
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
  const integrate::Preintegrated table(s.tf, s.field.lo, s.field.hi);
  const Image truth = castSegments(s, view, table);
  EXPECT_LE(largestDifference(drawGl(s, view, composite::Integration::preintegrated), truth), 1e-4);
}

// In a parallel view of constant cells thickness is linear on a polygon: the paper's mode has no error but its texture.
TEST(CompositeGl, VertexIntegrationOfConstantCells) {
  mesh::Source source = hexahedronGrid(3, 0.1, 4);
  addCellArray(source, "cells", [](const Vec3& p) { return std::sin(2.0 * p.x) + p.y * p.z; });
  for (const bool tetrahedra : {false, true}) {
    mesh::Source grid = tetrahedra ? tetrahedronGrid(3, 0.1, 4) : source;
    addCellArray(grid, "cells", [](const Vec3& p) { return std::sin(2.0 * p.x) + p.y * p.z; });
    const Subject s(grid, "cells", "viridis", 1.0);
    const View view = parallel(viewOf(s, {1.0, 0.6, 0.8}, 60, 45), 2.4);
    EXPECT_LE(meanDifference(drawGl(s, view, composite::Integration::vertex), castRays(s, project::Camera(view))),
              2e-4);
  }
}

TEST(CompositeGl, VertexIntegrationIsNearTheTruth) {
  const Subject s(delaunayCube(300, 20), "", "viridis", 3.0);
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 30, 24);
  const Image truth = castRays(s, project::Camera(view));
  const Image image = drawGl(s, view, composite::Integration::vertex);
  EXPECT_LE(largestDifference(image, truth), 0.1);
  EXPECT_LE(meanDifference(image, truth), 0.005);
}

TEST(CompositeGl, EglDrawsTheSame) {
  std::unique_ptr<composite::Compositor> egl;
  try {
    egl = composite::makeEgl();
  } catch (const Error& error) {
    GTEST_SKIP() << error.what();
  }
  const Subject s(delaunayCube(60, 21), "", "comb", 6.0);
  const View view = viewOf(s, {1.0, 0.6, 0.8}, 40, 30);
  const Image image = drawOrdered(s, view, orderOf(s, view), composite::Integration::exact, *egl);
  EXPECT_LE(largestDifference(image, castRays(s, project::Camera(view))), exact_bound);
  EXPECT_EQ(egl->backend(), composite::Backend::egl);
}

TEST(CompositeGl, Names) {
  for (const char* text : {"auto", "native", "osmesa", "egl"}) {
    EXPECT_STREQ(composite::name(composite::backend(text)), text);
  }
  for (const char* text : {"exact", "preintegrated", "average", "vertex"}) {
    EXPECT_STREQ(composite::name(composite::integration(text)), text);
  }
  try {
    composite::backend("vulkan");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("native, osmesa, egl"), std::string::npos);
  }
  EXPECT_THROW(composite::integration("riemann"), Error);
}

}  // namespace
}  // namespace spillikin::tests
