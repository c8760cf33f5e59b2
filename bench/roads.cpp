#include "bench/roads.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <utility>
#include <vector>

#include "bench/meter.h"
#include "bench/suite.h"
#include "spillikin/base/error.h"
#include "spillikin/io/read.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/session.h"
#include "tests/support/meshes.h"

namespace spillikin::bench {

namespace {

constexpr int image_size = 1024;
constexpr double degrees_between_views = 37.0;

struct Place {
  std::string label;
  std::function<mesh::Source()> make;
  std::size_t weight = 0;  // cells, roughly
};

std::vector<Place> places(const std::string& data) {
  std::vector<Place> all{
      {"thick shell with an opening", [] { return tests::shell(23); }, 84'000},
      {"interlocked tori", [] { return tests::interlockedTori(10); }, 96'000},
      {"50k hexahedra, faces not planar", [] { return tests::hexahedronGrid(37, 0.15); }, 51'000},
  };
  for (const auto& [name, weight] : {std::pair{"bf_tet5.vtu", 187'000UL},
                                     {"mug.e", 2'000UL},
                                     {"can_t0.vtu", 5'000UL},
                                     {"bracket_refined8.vtu", 1'650'000UL}}) {
    const auto path = std::filesystem::path(data) / name;
    if (data.empty() || !std::filesystem::exists(path)) continue;
    all.push_back({name, [path] { return io::readMesh(path.string()); }, weight});
  }
  return all;
}

struct Road {
  Frames frames;
  std::vector<double> sort, composite;
  std::size_t most_flagged = 0, unresolved = 0;
  std::string algorithm, road;
};

Road drive(const mesh::Source& source, sort::Algorithm sort, int frames,
           composite::Walking walking = composite::Walking::automatic) {
  render::Session session(source, {.sort = sort, .backend = composite::Backend::native, .walking = walking});
  View view = session.defaultView(image_size, image_size);
  render::turnView(view, {20.0, 15.0, 1.0});
  session.setView(view);
  session.draw();
  Road r;
  for (int i = 0; i < frames; ++i) {
    render::turnView(view, {degrees_between_views, 0.0, 1.0});
    r.frames.add(spentOn([&] {
      session.setView(view);
      session.draw();
    }));
    const render::Stats& s = session.stats();
    r.sort.push_back(s.sort.seconds);
    r.composite.push_back(s.project.seconds + s.composite.seconds);
    r.most_flagged = std::max(r.most_flagged, s.certificate.flagged);
    r.unresolved += s.certificate.unresolved;
  }
  r.algorithm = session.stats().sort.algorithm;
  r.road = session.stats().sort.road;
  return r;
}

std::string row(const Place& place, const std::string& sort, const Road& r) {
  return fmt::format("| {} | {} | {:.4f} | {:.4f} | {:.4f} | {:.4f} | {} | {} |\n", place.label, sort,
                     median(r.frames.wall), median(r.frames.cpu), median(r.sort), median(r.composite), r.most_flagged,
                     r.unresolved);
}

}  // namespace

std::string roadsSection(const std::string& data, std::size_t most, int frames) {
  std::string text = fmt::format(
      "\n## Roads\n\nEvery road ends in the same picture: the certificate finds the pixels on which an order is wrong "
      "and they are sorted again. Medians of {} viewpoints {:.0f}° apart, {}² pixels, seconds; pixels sorted again are "
      "those of the worst view. `auto` is what `--sort auto` took; rays that walk through tetrahedra take no "
      "order.\n\n| mesh | order | frame | processor | sort | "
      "composite | pixels sorted again | unresolved |\n|---|---|---|---|---|---|---|---|\n",
      frames, degrees_between_views, image_size);
  for (const Place& place : places(data)) {
    if (place.weight > most) continue;
    fmt::print(stderr, "roads: {}\n", place.label);
    const mesh::Source source = place.make();
    const Road automatic = drive(source, sort::Algorithm::automatic, frames);
    text += row(place, fmt::format("auto: {} ({})", automatic.algorithm, automatic.road), automatic);
    const bool walked = automatic.road == "walk";
    const Road other = drive(source, sort::Algorithm::automatic, frames,
                             walked ? composite::Walking::never : composite::Walking::always);
    if (other.road != automatic.road) text += row(place, walked ? "`--walk never`" : "`--walk always`", other);
    for (const sort::Algorithm a : {sort::Algorithm::xmpvo, sort::Algorithm::mpvo, sort::Algorithm::mpvonc,
                                    sort::Algorithm::power, sort::Algorithm::centroid}) {
      try {
        text += row(place, sort::name(a), drive(source, a, frames));
      } catch (const Error& e) {
        const std::string why = withoutFolder(e.what(), std::filesystem::path(data) / place.label);
        text += fmt::format("| {} | {} | refused: {} | | | | | |\n", place.label, sort::name(a), why);
      }
    }
  }
  return text;
}

}  // namespace spillikin::bench
