#include "bench/peers/speed.h"

#include <fmt/format.h>

#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "bench/meter.h"
#include "bench/peers/vtk_peer.h"
#include "bench/suite.h"
#include "spillikin/base/error.h"
#include "spillikin/mesh/subdivide.h"
#include "spillikin/render/defaults.h"
#include "spillikin/sort/sort.h"

namespace spillikin::bench {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array mappers{Mapper::projected_tetrahedra, Mapper::bunyk_preintegrated, Mapper::zsweep};
constexpr std::array sorters{sort::Algorithm::automatic, sort::Algorithm::mpvo,        sort::Algorithm::mpvonc,
                             sort::Algorithm::power,     sort::Algorithm::convexified, sort::Algorithm::centroid};
constexpr double degrees_per_frame = 4.0;
// Views of a round: the first is drawn by all, so that their data are in the caches, and is not counted; of the others
// Spillikin draws each and a peer, whose frames take long, one.
constexpr std::size_t views_per_round = 4, view_of_peers = 2;
constexpr std::size_t own_frames_per_round = views_per_round - 1;
// What an order is to be faster than VTK's by, on a million tetrahedra.
constexpr double mpvo_target = 3.0, power_target = 8.0;

const char* key(Mapper mapper) {
  switch (mapper) {
    case Mapper::projected_tetrahedra:
      return "projected_tetrahedra";
    case Mapper::bunyk_preintegrated:
      return "bunyk";
    case Mapper::bunyk_linear:
      return "bunyk_linear";
    case Mapper::zsweep:
      return "zsweep";
  }
  return "?";
}

Json summary(const Frames& frames) {
  return {{"wall_seconds", median(frames.wall)}, {"cpu_seconds", median(frames.cpu)}, {"frames", frames.wall.size()}};
}

struct Contender {
  Mapper mapper;
  std::unique_ptr<VtkPeer> peer;
  Frames frames;
  bool given_up = false;

  // The first frame, which prepares the mapper for the mesh, is not counted; nor is one that was given up.
  void frame(const View& view, bool counted, double limit) {
    if (given_up) return;
    bool done = true;
    const Spent spent = spentOn([&] { done = peer->draw(view, limit); });
    given_up = !done || spent.wall > limit;
    if (counted && done) frames.add(spent);
  }
};

class Walk {
 public:
  explicit Walk(const View& first) : view_(first) {}
  const View& next() {
    render::turnView(view_, {degrees_per_frame, 0.0, 1.0});
    return view_;
  }
  const View& here() const { return view_; }

 private:
  View view_;
};

using Round = std::array<View, views_per_round>;

Round nextRound(Walk& walk) {
  Round views;
  for (View& view : views)
    view = walk.next();
  return views;
}

Frames ownFrames(render::Session& session, const Round& views, Image& image) {
  Frames frames;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Spent spent = spentOn([&] {
      session.setView(views[i]);
      session.draw(image);
    });
    if (i > 0) frames.add(spent);
  }
  return frames;
}

void append(Frames& to, const Frames& more) {
  to.wall.insert(to.wall.end(), more.wall.begin(), more.wall.end());
  to.cpu.insert(to.cpu.end(), more.cpu.begin(), more.cpu.end());
}

Json measureFrames(render::Session& session, const VtkMesh& grid, const Targets& targets, const SpeedOptions& options) {
  const auto look = lookOf(session, integrate::default_preset);
  session.setTransferFunction(look);
  Walk walk(session.defaultView(options.size, options.size));
  std::vector<Contender> contenders;
  for (const Mapper m : mappers) {
    if (m == Mapper::zsweep && targets.zsweep <= 0.0) continue;  // minutes a frame, and nothing to be measured against
    contenders.push_back({m, std::make_unique<VtkPeer>(m, grid, look, options.size, options.size), {}, false});
    contenders.back().frame(walk.here(), false, options.limit_seconds);
  }
  Image image;
  ownFrames(session, nextRound(walk), image);
  Frames own;
  for (int round = 0; round < options.rounds; ++round) {
    const Round views = nextRound(walk);
    append(own, ownFrames(session, views, image));
    for (Contender& c : contenders) {
      const bool slow = c.mapper == Mapper::zsweep;
      if (slow && c.frames.wall.size() == 1 && c.frames.wall[0] > 0.1 * options.limit_seconds) continue;
      if (!slow) c.frame(views.front(), false, options.limit_seconds);
      c.frame(views[view_of_peers], true, options.limit_seconds);
    }
  }
  Json j{{"spillikin", summary(own)}};
  for (const Contender& c : contenders) {
    j[key(c.mapper)] = summary(c.frames);
    if (c.given_up) j[key(c.mapper)]["given_up_after_seconds"] = options.limit_seconds;
  }
  return j;
}

Json measureSorts(const mesh::Mesh& tetrahedra, const VtkMesh& grid, const View& first, int rounds) {
  struct Own {
    std::unique_ptr<sort::Sorter> sorter;
    Frames frames;
  };
  Json j;
  std::vector<Own> all;
  for (const sort::Algorithm a : sorters) {
    try {
      all.push_back({sort::makeSorter(a, tetrahedra), {}});
    } catch (const Error& e) {
      j[sort::name(a)] = {{"refused", e.what()}};
    }
  }
  Walk walk(first);
  Frames vtk;
  sort::Order order;
  for (int round = -1; round < rounds; ++round) {
    const Spent theirs = spentOn([&] { grid.sortByDepth(walk.next()); });
    if (round >= 0) vtk.add(theirs);
    for (Own& own : all) {
      for (std::size_t i = 0; i < own_frames_per_round; ++i) {
        const Viewpoint at = viewpoint(walk.next());
        const Spent spent = spentOn([&] { (*own.sorter)(at, order); });
        if (round >= 0) own.frames.add(spent);
      }
    }
  }
  const auto cells = static_cast<double>(tetrahedra.cell_count());
  const auto rate = [&](const Frames& f) {
    return Json{{"cells_per_second", cells / median(f.wall)}, {"cpu_seconds", median(f.cpu)}};
  };
  j["vtk_cell_center_depth_sort"] = rate(vtk);
  for (std::size_t i = 0, k = 0; i < sorters.size() && k < all.size(); ++i) {
    if (j.contains(sort::name(sorters[i]))) continue;
    Json one = rate(all[k].frames);
    one["algorithm"] = sort::name(all[k].sorter->algorithm());
    one["exact"] = all[k].sorter->exact();
    j[sort::name(sorters[i])] = std::move(one);
    ++k;
  }
  return j;
}

// "12.3× (≥ 10)": plainly marked where the target is missed.
std::string ratioCell(const Json& frames, const char* peer, double target) {
  if (!frames.contains(peer)) return "not run | –";
  const Json& p = frames[peer];
  const std::string goal = target > 0.0 ? fmt::format("≥ {:.0f}", target) : std::string("–");
  const double own = frames["spillikin"]["wall_seconds"];
  if (p["frames"] == 0) {
    const double least = p["given_up_after_seconds"].get<double>() / own;
    return fmt::format("given up after {:.0f} s: > {:.0f} | {}{}", p["given_up_after_seconds"].get<double>(), least,
                       goal,
                       target <= 0.0     ? ""
                       : least >= target ? ", reached"
                                         : ", not known");
  }
  const double wall = p["wall_seconds"].get<double>() / own;
  const double cpu = p["cpu_seconds"].get<double>() / frames["spillikin"]["cpu_seconds"].get<double>();
  const char* verdict = target <= 0.0 ? "" : wall >= target ? ", reached" : ", **missed**";
  return fmt::format("{:.3g} s: {:.3g} ({:.3g}) | {}{}", p["wall_seconds"].get<double>(), wall, cpu, goal, verdict);
}

std::string frameTable(const Json& all) {
  std::string text =
      "| mesh | cells | Spillikin, s | projected tetrahedra: ratio (of processor time) | target | Bunyk, "
      "pre-integrated | "
      "target | ZSweep | target |\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Json& s : all["subjects"]) {
    if (s.contains("refused")) {
      text += fmt::format("| {} | {} | | | | | | | |\n", s["mesh"].get<std::string>(), s["refused"].get<std::string>());
      continue;
    }
    const Json& f = s["frames"];
    text += fmt::format("| {} | {} | {:.4f} | {} | {} | {} |\n", s["mesh"].get<std::string>(),
                        s["cells"].get<std::size_t>(), f["spillikin"]["wall_seconds"].get<double>(),
                        ratioCell(f, "projected_tetrahedra", s["targets"][0]), ratioCell(f, "bunyk", s["targets"][1]),
                        ratioCell(f, "zsweep", s["targets"][2]));
  }
  return text;
}

std::string sortTable(const Json& all) {
  std::string text = "| mesh | tetrahedra | VTK, million cells/s |";
  std::string rule = "|---|---|---|";
  for (const sort::Algorithm a : sorters) {
    text += fmt::format(" {} |", sort::name(a));
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const Json& s : all["subjects"]) {
    if (!s.contains("sorts")) continue;
    const double vtk = s["sorts"]["vtk_cell_center_depth_sort"]["cells_per_second"];
    text += fmt::format("| {} | {} | {:.1f} |", s["mesh"].get<std::string>(), s["tetrahedra"].get<std::size_t>(),
                        vtk * 1e-6);
    for (const sort::Algorithm a : sorters) {
      const Json& one = s["sorts"][sort::name(a)];
      if (one.contains("refused")) {
        text += " refused |";
        continue;
      }
      const double rate = one["cells_per_second"];
      const std::string chosen =
          a == sort::Algorithm::automatic ? fmt::format("{}, ", one["algorithm"].get<std::string>()) : std::string();
      text += fmt::format(" {}{:.1f}: {:.2g}× {}|", chosen, rate * 1e-6, rate / vtk,
                          one["exact"].get<bool>() ? "" : "(inexact) ");
    }
    text += "\n";
  }
  return text;
}

// On meshes of about a million tetrahedra, where the targets are.
std::string targetLines(const Json& all) {
  std::string text;
  for (const Json& s : all["subjects"]) {
    if (!s.contains("sorts") || s["tetrahedra"] < 900'000 || s["tetrahedra"] > 1'100'000) continue;
    const double vtk = s["sorts"]["vtk_cell_center_depth_sort"]["cells_per_second"];
    for (const auto& [a, target] :
         {std::pair{sort::Algorithm::mpvo, mpvo_target}, std::pair{sort::Algorithm::power, power_target}}) {
      const Json& one = s["sorts"][sort::name(a)];
      if (one.contains("refused")) continue;
      const double rate = one["cells_per_second"];
      text += fmt::format("{}: {} is {:.3g} times as fast as vtkCellCenterDepthSort (at least {:.0f}{}).\n\n",
                          s["mesh"].get<std::string>(), sort::name(a), rate / vtk, target,
                          rate >= target * vtk ? ", reached" : ", **missed**");
    }
  }
  return text;
}

}  // namespace

Json measureSpeed(const Subject& subject, const SpeedOptions& options) {
  Json j{{"mesh", subject.label},
         {"targets", {subject.targets.projected_tetrahedra, subject.targets.bunyk, subject.targets.zsweep}}};
  render::Session session(subject.make(), {});
  j["cells"] = session.mesh().cell_count();
  std::optional<mesh::Tetrahedralization> cut;
  if (!session.mesh().tetrahedral()) cut = mesh::tetrahedralize(session.mesh());
  const mesh::Mesh& tetrahedra = cut ? cut->mesh : session.mesh();
  j["tetrahedra"] = tetrahedra.cell_count();
  const VtkMesh grid(tetrahedra, session.field());
  j["frames"] = measureFrames(session, grid, subject.targets, options);
  const render::Stats& stats = session.stats();
  j["fragments"] = stats.composite.fragments;
  j["sort"] = stats.sort.algorithm;
  j["certificate"] = {stats.certificate.flagged, stats.certificate.resolved, stats.certificate.unresolved};
  j["sorts"] = measureSorts(tetrahedra, grid, session.defaultView(options.size, options.size), options.rounds);
  return j;
}

Json measureOrders(const Subject& subject, const SpeedOptions& options) {
  render::Session session(subject.make(), {});
  std::optional<mesh::Tetrahedralization> cut;
  if (!session.mesh().tetrahedral()) cut = mesh::tetrahedralize(session.mesh());
  const mesh::Mesh& tetrahedra = cut ? cut->mesh : session.mesh();
  const VtkMesh grid(tetrahedra, session.field());
  return {{"mesh", subject.label},
          {"tetrahedra", tetrahedra.cell_count()},
          {"sorts", measureSorts(tetrahedra, grid, session.defaultView(options.size, options.size), options.rounds)}};
}

std::string orderTables(const Json& all) {
  return fmt::format(
      "Visibility orders of the same meshes as tetrahedra, million cells/s and times vtkCellCenterDepthSort's, on the "
      "wall; targets on the cube of a million: mpvo at least 30 million cells/s and {:.0f}×, power 80 and "
      "{:.0f}×.\n\n{}\n{}",
      mpvo_target, power_target, sortTable(all), targetLines(all));
}

std::string speedTables(const Json& all) {
  return fmt::format(
      "## Beside VTK {0}\n\n{1}² pixels, perspective, a new viewpoint each frame (azimuth +{2:.0f}°), the default "
      "colour map; median of {3} frames of each peer and {4} of Spillikin (`native`, `--sort auto`), in turn and of "
      "the same "
      "views, in one run; the first frame of a turn, which finds another's data in the caches, is not counted. A "
      "ratio is the peer's time over Spillikin's on the wall; in brackets the same of the processor seconds of all "
      "cores, which other programs on the machine disturb less. VTK draws the hexahedra as tetrahedra. A peer whose "
      "frame takes longer than {5:.0f} s is given up; ZSweep is drawn once, cold, where a frame takes more than a "
      "tenth of "
      "that.\n\n{6}\n"
      "{7}",
      all["vtk"].get<std::string>(), all["size"].get<int>(), degrees_per_frame, all["rounds"].get<int>(),
      own_frames_per_round * all["rounds"].get<std::size_t>(), all["limit_seconds"].get<double>(), frameTable(all),
      orderTables(all));
}

}  // namespace spillikin::bench
