// Random pictures against the ground truth: any mesh, field, view, look, optics, order, projection and backend. The
// seed of each is printed where it fails; SPILLIKIN_FUZZ_SEED and SPILLIKIN_FUZZ_RUNS choose others and more.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/io/read.h"
#include "spillikin/mesh/build.h"
#include "spillikin/reference/compare.h"
#include "spillikin/reference/rays.h"
#include "spillikin/reference/reference.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/session.h"
#include "support/meshes.h"

namespace spillikin {
namespace {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  double between(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }
  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  bool chance(double p) { return between(0.0, 1.0) < p; }
  template <class T>
  const T& oneOf(const std::vector<T>& all) {
    return all[below(all.size())];
  }
  Vec3 vector() { return {between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)}; }

 private:
  std::mt19937_64 random_;
};

// Those that are read and drawn in moments. Where cells of one overlap, the pictures in which they do are left out.
std::vector<std::string> files() {
  std::vector<std::string> all;
  for (const char* name : {"bluntfin.vts", "post.vtk", "disk_out_ref.ex2"})
    all.push_back((std::filesystem::path(SPILLIKIN_EXAMPLES) / name).string());
  for (const char* name :
       {"CylinderQuadratic.vtk", "PentaHexa.vtk", "box_hybrid_mesh.vtu", "can_t0.vtu", "comb.vts", "dolfin_pulley.vtu",
        "elements.vtu", "fire_ug.vtu", "joint.vtk", "knot-hex.vtk", "mug.e", "notch_stress.vtk",
        "pebi3d_with_properties.vtu", "slac_pillbox.vtu", "syrthes_plates_T_0.vtu"}) {
    const auto path = std::filesystem::path(SPILLIKIN_DATA) / name;
    if (std::filesystem::exists(path)) all.push_back(path.string());
  }
  return all;
}

mesh::Source anyMesh(Dice& dice) {
  if (dice.chance(0.4)) return io::readMesh(dice.oneOf(files()));
  const std::uint64_t seed = dice.below(1000);
  switch (dice.below(8)) {
    case 0:
      return tests::delaunayCube(20 + dice.below(400), seed);
    case 1:
      return tests::tetrahedronGrid(2 + dice.below(5), dice.between(0.0, 0.25), seed);
    case 2:
      return tests::hexahedronGrid(2 + dice.below(5), dice.chance(0.3) ? 0.0 : dice.between(0.0, 0.25), seed);
    case 3:
      return tests::shell(3 + dice.below(5));
    case 4:
      return tests::interlockedTori(3 + dice.below(3));
    case 5:
      return tests::twistedRing(5 + dice.below(8), dice.between(0.2, 0.7));
    case 6:
      return tests::twistedBar(3 + dice.below(3), dice.between(0.5, 1.5));
    default:
      return tests::curvedBall(3 + dice.below(3));
  }
}

// Along axes too, where rays run in faces; but not between cells of other values, on which the ray's last bit decides.
View anyView(Dice& dice, const render::Session& session) {
  View view = session.defaultView(static_cast<int>(24 + dice.below(40)), static_cast<int>(24 + dice.below(40)));
  const render::Box box = render::boundingBox(session.mesh());
  if (dice.chance(0.2)) {
    view.eye = box.lower + (box.upper - box.lower) * (0.5 + 0.5 * dice.vector());
    view.target = view.eye + dice.vector();
    view.up = dice.vector();
    view.view_angle = dice.between(10.0, 120.0);
  } else {
    if (dice.chance(0.3)) view.parallel_scale = render::fittingParallelScale(box, view.width, view.height);
    const bool aligned = dice.chance(0.2) && session.field().association == mesh::Association::points;
    const double azimuth = aligned ? 45.0 * static_cast<double>(dice.below(8)) : dice.between(-180.0, 180.0);
    const double elevation = aligned && dice.chance(0.5) ? 0.0 : dice.between(-85.0, 85.0);
    render::turnView(view, {azimuth, elevation, dice.oneOf<double>({1.0, 1.0, 1.5, 4.0, 20.0})});
  }
  if (dice.chance(0.15))
    view.clips.push_back({box.lower + (box.upper - box.lower) * dice.between(0.2, 0.8), dice.vector()});
  return view;
}

integrate::TransferFunction anyLook(Dice& dice, const render::Session& session) {
  const mesh::Field& field = session.field();
  const render::Box box = render::boundingBox(session.mesh());
  const double size = glm::length(box.upper - box.lower);
  const double strength = std::pow(10.0, dice.between(-1.0, 2.5)) / size;
  if (dice.chance(0.3)) {
    return integrate::preset(dice.oneOf(integrate::presetNames())).mapped(field.lo, field.hi).scaled(strength);
  }
  const double range = field.hi > field.lo ? field.hi - field.lo : 1.0;
  std::vector<integrate::ControlPoint> points;
  double value = field.lo + range * dice.between(-0.2, 0.5);
  for (std::size_t n = 1 + dice.below(12); n > 0; --n) {
    const integrate::ControlPoint point{value,
                                        {dice.between(0.0, 1.0), dice.between(0.0, 1.0), dice.between(0.0, 1.0)},
                                        dice.chance(0.25) ? 0.0 : strength * dice.between(0.0, 1.0)};
    const bool jumped = points.size() > 1 && points[points.size() - 2].value == value;
    if (jumped) points.pop_back();
    points.push_back(point);
    if (!dice.chance(0.2)) value += range * dice.between(0.001, 0.3);
  }
  return integrate::TransferFunction(points);
}

render::Engine anyEngine(Dice& dice, const mesh::Source& source) {
  using sort::Algorithm;
  render::Engine engine;
  engine.backend = dice.chance(0.25) ? composite::Backend::osmesa : composite::Backend::native;
  const bool tetrahedra =
      std::all_of(source.types.begin(), source.types.end(), [](auto type) { return type == mesh::vtk_cell::tetra; });
  if (!tetrahedra && dice.chance(0.3)) engine.projection = render::Projection::tets;
  // Without a certificate an order has to be right by itself.
  engine.sort = engine.backend == composite::Backend::native
                    ? dice.oneOf<Algorithm>({Algorithm::automatic, Algorithm::automatic, Algorithm::xmpvo,
                                             Algorithm::bsp_xmpvo, Algorithm::mpvonc, Algorithm::centroid})
                    : dice.oneOf<Algorithm>({Algorithm::automatic, Algorithm::automatic, Algorithm::xmpvo});
  return engine;
}

// Marks the pixels nearer to whose centre than 1/16 of a pixel is a border of what the rays meet. A peak is as bright
// at the end of the shortest chord, and of flat cells no float says where that end is.
void markBorders(const reference::RayCaster& caster, const View& view, const reference::Options& options,
                 std::vector<std::uint8_t>& apart) {
  std::vector<reference::Interval> on_ray;
  const auto meets = [&](double x, double y) {
    caster.intervals(view, x, y, options, on_ray);
    return !on_ray.empty();
  };
  constexpr double step = 1.0 / 16.0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const double cx = x + 0.5, cy = y + 0.5;
      const bool here = meets(cx, cy);
      for (const auto& [dx, dy] : {std::pair(step, 0.0), {-step, 0.0}, {0.0, step}, {0.0, -step}}) {
        if (meets(cx + dx, cy + dy) != here) apart[static_cast<std::size_t>(y * view.width + x)] = 1;
      }
    }
  }
}

// Marks the pixels whose peak is the value of a jump to float's last digits: it may take the colour of either side.
void markJumps(const reference::RayCaster& caster, const View& view, const reference::Options& options,
               const integrate::TransferFunction& look, double range, std::vector<std::uint8_t>& apart) {
  const auto& points = look.points();
  std::vector<double> jumps;
  for (std::size_t k = 1; k < points.size(); ++k) {
    if (points[k].value == points[k - 1].value) jumps.push_back(points[k].value);
  }
  if (jumps.empty()) return;
  std::vector<reference::Interval> on_ray;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      caster.intervals(view, x + 0.5, y + 0.5, options, on_ray);
      double peak = -std::numeric_limits<double>::infinity();
      for (const reference::Interval& in : on_ray)
        peak = std::max({peak, in.front, in.back});
      for (const double jump : jumps) {
        if (std::abs(peak - jump) <= 4e-7 * range) apart[static_cast<std::size_t>(y * view.width + x)] = 1;
      }
    }
  }
}

// The view with its rays moved by (across, down) pixels.
View moved(const View& view, double across, double down) {
  const reference::Rays rays(view);
  const double x = view.width / 2.0, y = view.height / 2.0;
  const reference::Ray here = rays(x, y), there = rays(x + across, y + down);
  View out = view;
  if (view.parallel()) {
    out.eye += there.origin - here.origin;
    out.target += there.origin - here.origin;
  } else {
    out.target += glm::length(view.target - view.eye) * (there.direction - here.direction);
  }
  return out;
}

// Where rays run in faces of whole cells, their last bits decide which cells they meet, and as a cell's field is linear
// between where a ray enters and leaves, the truth itself jumps there. The truth, but at each pixel the one of those
// around it that is nearest to the picture: as the picture must come near one of them, nothing is left out.
Image nearestTruth(const reference::RayCaster& caster, const View& view, const integrate::TransferFunction& look,
                   const reference::Options& options, const Image& truth, const Image& image) {
  constexpr double step = 1.0 / 4096.0;  // of a pixel
  const auto apart = [&](const Image& one, int x, int y) {
    double most = 0.0;
    for (std::size_t c = 0; c < 4; ++c)
      most = std::max(most, std::abs(static_cast<double>(one.pixel(x, y)[c]) - image.pixel(x, y)[c]));
    return most;
  };
  Image nearest = truth;
  for (int down = -1; down <= 1; ++down) {
    for (int across = -1; across <= 1; ++across) {
      if (down == 0 && across == 0) continue;
      const Image beside = caster.render(moved(view, across * step, down * step), look, options);
      for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
          if (apart(beside, x, y) < apart(nearest, x, y)) std::copy_n(beside.pixel(x, y), 4, nearest.pixel(x, y));
        }
      }
    }
  }
  return nearest;
}

// True where the picture could be judged.
bool expectRight(std::uint64_t seed) {
  Dice dice(seed);
  mesh::Source source = anyMesh(dice);
  render::Engine engine = anyEngine(dice, source);
  // Rays walk wherever they can, or where it is the quicker way.
  if (seed % 2 == 0) engine.walking = composite::Walking::always;
  const std::string name = source.name;
  std::vector<std::string> arrays;
  for (const mesh::Array& array : source.arrays)
    arrays.push_back(array.name);
  render::Session session(std::move(source), engine);
  if (!arrays.empty()) session.setField(dice.oneOf(arrays));
  const View view = anyView(dice, session);
  const integrate::TransferFunction look = anyLook(dice, session);
  reference::Options options;
  options.optics = dice.oneOf<integrate::Optics>(
      {integrate::Optics::absorption_emission, integrate::Optics::absorption_emission, integrate::Optics::emission,
       integrate::Optics::absorption, integrate::Optics::mip, integrate::Optics::xray});
  if (engine.projection == render::Projection::tets) options.model = mesh::FieldModel::tets;
  SCOPED_TRACE(fmt::format("SPILLIKIN_FUZZ_SEED={} SPILLIKIN_FUZZ_RUNS=1: {}, field {}, {}, {}, {}, {}", seed, name,
                           session.field().name, sort::name(engine.sort), render::name(engine.projection),
                           composite::name(engine.backend), integrate::name(options.optics)));
  const reference::RayCaster caster(session.mesh(), session.field());
  reference::Report report;
  const Image truth = caster.render(view, look, options, &report);
  session.setView(view);
  session.setTransferFunction(look);
  session.setOptics(options.optics);
  const Image image = session.draw();
  if (report.overlaps > 0 || mesh::inspect(session.mesh()).folded_cells > 0) return false;

  reference::CompareOptions compare;
  compare.apart = caster.edgeOnMask(view);
  if (options.optics == integrate::Optics::mip) {
    markBorders(caster, view, options, compare.apart);
    markJumps(caster, view, options, look, session.field().hi - session.field().lo, compare.apart);
  }
  // What only glows adds up beyond 1: the step is one of the brightest pixel's.
  const double brightest = *std::max_element(truth.rgba.begin(), truth.rgba.end());
  const double bound = std::max(1.0, brightest) / 255.0;
  auto c = reference::compare(image, truth, compare);
  if (c.worst.max > bound)
    c = reference::compare(image, nearestTruth(caster, view, look, options, truth, image), compare);
  EXPECT_LE(c.worst.max, bound) << "pixel " << c.worst_x << ',' << c.worst_y;
  return true;
}

TEST(PictureFuzz, AnyPictureIsRight) {
  const char* more = std::getenv("SPILLIKIN_FUZZ_RUNS");
  const int runs = more == nullptr ? 60 : std::atoi(more);
  const char* chosen = std::getenv("SPILLIKIN_FUZZ_SEED");
  const std::uint64_t first = chosen == nullptr ? 1 : std::strtoull(chosen, nullptr, 10);
  int judged = 0;
  for (int run = 0; run < runs; ++run)
    judged += expectRight(first + static_cast<std::uint64_t>(run)) ? 1 : 0;
  EXPECT_GE(2 * judged, runs) << "most pictures must be judged";
}

// A ray through a cell six millionths thick, over which the scalar changes by half of its range: float does not place
// the peak.
TEST(PictureFuzz, FlatCellsKeepTheirPeaks) {
  EXPECT_TRUE(expectRight(1795721577));
}

// A clip plane leaves nothing of some rays: the nearness of their ends has no end.
TEST(PictureFuzz, ClipPlanesMayLeaveNothing) {
  EXPECT_TRUE(expectRight(778305));
}

// A peak that is a jump's value to float's last digit.
TEST(PictureFuzz, PeaksMayLieAtJumps) {
  EXPECT_TRUE(expectRight(880507));
}

// An eye beside a cell twisted by much: rays come in by the second triangle of a face alone.
TEST(PictureFuzz, TwistedCellsMayBeNear) {
  EXPECT_TRUE(expectRight(777184));
}

}  // namespace
}  // namespace spillikin
