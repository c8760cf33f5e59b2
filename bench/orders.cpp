// Every visibility sort on every mesh given, from random viewpoints outside and inside: what it costs beside MPVO, and
// on how many rays of a grid over the image two cells come in the wrong order.
//   spillikin_orders [--sorts A,B,..] [--views N] [--rays N] [--seed N] [--repeat N] [--newell CELLS] [--strict]
//   MESH...
// A MESH is a file, a folder of files, or made: grid:N curved:N shell:N tori:N ring:N bar:N delaunay:N. With --strict
// the exit code is 1 when an order that calls itself exact is wrong on any ray where no cells overlap.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <glm/geometric.hpp>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "bench/meter.h"
#include "spillikin/base/error.h"
#include "spillikin/io/read.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/reference/rays.h"
#include "spillikin/reference/reference.h"
#include "spillikin/sort/bsp_xmpvo.h"
#include "spillikin/sort/checker.h"
#include "spillikin/sort/newell.h"
#include "spillikin/sort/sort.h"
#include "spillikin/sort/xmpvo.h"
#include "tests/support/meshes.h"

namespace {

using namespace spillikin;
namespace fs = std::filesystem;

struct Wish {
  std::vector<sort::Algorithm> sorts;
  std::vector<std::string> meshes;
  int views = 10, rays = 64, repeat = 3;
  std::uint64_t seed = 1;
  bool strict = false;
  int newell_cells = 300'000;  // at most, else it is left out, and said so: a view takes some 10 us a cell
};

mesh::Source made(const std::string& name) {
  const auto colon = name.find(':');
  std::size_t n = 0;
  std::from_chars(name.data() + colon + 1, name.data() + name.size(), n);
  const std::string kind = name.substr(0, colon);
  if (kind == "grid") return tests::tetrahedronGrid(n, 0.18, 1);
  if (kind == "curved") return tests::hexahedronGrid(n, 0.15, 1);
  if (kind == "shell") return tests::shell(n);
  if (kind == "tori") return tests::interlockedTori(n);
  if (kind == "ring") return tests::twistedRing(n, 0.5);
  if (kind == "bar") return tests::twistedBar(n, 1.5);
  if (kind == "delaunay") return tests::delaunayCube(n, 1);
  throw Error(fmt::format(
      "no mesh is called '{}'; the made ones are grid:N, curved:N, shell:N, tori:N, ring:N, bar:N, delaunay:N", name));
}

mesh::Source load(const std::string& name) {
  return fs::exists(name) ? io::readMesh(name) : made(name);
}

// A point of view every kind: three of four outside at one to four radii, looking at a point in the middle half; the
// others inside the bounding box; every fifth a parallel view, and the first six of these along the axes.
View randomView(const mesh::Mesh& mesh, std::mt19937_64& random, int index, int size) {
  Vec3 lower = mesh.points.front(), upper = lower;
  for (const Vec3& p : mesh.points) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::normal_distribution<double> normal;
  const Vec3 middle = 0.5 * (lower + upper), extent = upper - lower;
  const double radius = 0.5 * glm::length(extent);
  const auto inside = [&](double part) {
    return middle + part * extent * (Vec3(u(random), u(random), u(random)) - 0.5);
  };
  const Vec3 away = glm::normalize(Vec3(normal(random), normal(random), normal(random)));
  View view;
  view.width = view.height = size;
  view.target = inside(0.3);
  if (index % 5 == 4) {
    Vec3 direction = away;
    if (index / 5 < 6) {
      direction = Vec3(0.0);
      direction[(index / 5) % 3] = index / 5 < 3 ? 1.0 : -1.0;
    }
    view.eye = view.target + 3.0 * radius * direction;
    view.parallel_scale = radius;
  } else if (index % 4 == 3) {
    view.eye = inside(0.9);
    view.view_angle = 90.0;
  } else {
    view.eye = middle + radius * (1.1 + 3.0 * u(random)) * away;
    view.view_angle = 2.0 * 57.29577951308232 * std::atan2(radius, glm::length(view.eye - view.target));
  }
  const Vec3 sight = glm::normalize(view.target - view.eye);
  view.up = std::abs(sight.y) < 0.9 ? Vec3(0.0, 1.0, 0.0) : Vec3(1.0, 0.0, 0.0);
  return view;
}

// The crossings of every ray of a view, traced once for all sorts.
struct RayGrid {
  std::vector<Vec3> origin, direction;
  std::vector<std::vector<sort::Crossing>> crossings;
};

RayGrid trace(const reference::RayCaster& caster, const View& view) {
  const reference::Rays rays(view);
  const auto count = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
  RayGrid grid;
  grid.origin.resize(count);
  grid.direction.resize(count);
  grid.crossings.resize(count);
  tbb::enumerable_thread_specific<std::vector<reference::Interval>> local;
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const double x = static_cast<double>(i % static_cast<std::size_t>(view.width)) + 0.5;
    const double y = static_cast<double>(i / static_cast<std::size_t>(view.width)) + 0.5;
    auto& intervals = local.local();
    caster.intervals(view, x, y, {}, intervals);
    const reference::Ray ray = rays(x, y);
    grid.origin[i] = ray.origin;
    grid.direction[i] = glm::normalize(ray.direction);
    for (const auto& interval : intervals)
      grid.crossings[i].push_back({interval.cell, interval.enter, interval.leave});
  });
  return grid;
}

struct Verdict {
  sort::Tally tally;
  std::size_t wrong_rays = 0, overlapping_rays = 0;  // with an inversion; of them, where cells overlap
};

Verdict check(const RayGrid& grid, const sort::Order& order, const mesh::Mesh& mesh, int width) {
  const sort::OrderChecker checker(order, mesh.cell_count());
  tbb::enumerable_thread_specific<Verdict> local;
  tbb::parallel_for(std::size_t{0}, grid.crossings.size(), [&](std::size_t i) {
    Verdict& verdict = local.local();
    const std::size_t before = verdict.tally.inversions, overlaps = verdict.tally.overlaps;
    const auto w = static_cast<std::size_t>(width);
    checker.add(static_cast<int>(i % w), static_cast<int>(i / w), grid.origin[i], grid.direction[i], grid.crossings[i],
                verdict.tally);
    if (verdict.tally.inversions == before) return;
    ++verdict.wrong_rays;
    if (verdict.tally.overlaps != overlaps) ++verdict.overlapping_rays;
  });
  Verdict all;
  for (const Verdict& v : local) {
    all.tally.merge(v.tally);
    all.wrong_rays += v.wrong_rays;
    all.overlapping_rays += v.overlapping_rays;
  }
  return all;
}

// One sort on one mesh, over all views.
struct Contender {
  sort::Algorithm algorithm;
  std::unique_ptr<sort::Sorter> sorter;
  std::string refused;
  double prepare = 0.0;
  bench::Frames frames;
  std::size_t exact = 0, wrong_exact = 0, rays = 0, inversions = 0, contested = 0, wrong = 0, overlapping = 0,
              cycles = 0, cut = 0;
  std::string worst;
};

void judge(Contender& c, const mesh::Mesh& mesh, const View& view, int index, const RayGrid& grid,
           const sort::Order& order) {
  const Verdict verdict = check(grid, order, mesh, view.width);
  c.rays += verdict.tally.rays;
  c.inversions += verdict.tally.inversions;
  c.contested += verdict.tally.contested;
  c.wrong += verdict.wrong_rays;
  c.overlapping += verdict.overlapping_rays;
  c.cycles += order.cycles.size();
  c.cut += order.cuts.size();
  c.exact += order.exact ? 1U : 0U;
  if (order.exact && verdict.wrong_rays > verdict.overlapping_rays) {
    ++c.wrong_exact;
    if (c.worst.empty() && !verdict.tally.worst.empty()) {
      const sort::Inversion& w = verdict.tally.worst.front();
      c.worst = fmt::format(
          "view {} (eye {:.17g} {:.17g} {:.17g}, target {:.17g} {:.17g} {:.17g}{}) pixel {},{}: cell "
          "{} in front of {} by {:.3g}",
          index, view.eye.x, view.eye.y, view.eye.z, view.target.x, view.target.y, view.target.z,
          view.parallel() ? ", parallel" : "", w.x, w.y, mesh.cell_file_id[w.front], mesh.cell_file_id[w.back],
          w.depth);
    }
  }
}

bool runMesh(const std::string& name, const Wish& wish) {
  const mesh::Source source = load(name);
  const mesh::Mesh mesh = mesh::build(source);
  std::vector<Contender> contenders;
  for (const sort::Algorithm a : wish.sorts) {
    Contender& c = contenders.emplace_back();
    c.algorithm = a;
    if (a == sort::Algorithm::newell && mesh.cell_count() > static_cast<std::size_t>(wish.newell_cells)) {
      c.refused = fmt::format("not run: more than {} cells", wish.newell_cells);
      continue;
    }
    try {
      c.prepare = bench::spentOn([&] { c.sorter = sort::makeSorter(a, mesh); }).wall;
    } catch (const Error& error) {
      c.refused = error.what();
    }
  }
  std::unique_ptr<reference::RayCaster> caster;
  mesh::Field field;
  if (wish.rays > 0) {
    field.association = mesh::Association::points;
    field.values.assign(mesh.points.size(), 0.0);
    caster = std::make_unique<reference::RayCaster>(mesh, field);
  }
  std::mt19937_64 random(wish.seed);
  sort::Order order;
  for (int v = 0; v < wish.views; ++v) {
    const View view = randomView(mesh, random, v, std::max(1, wish.rays));
    const Viewpoint from = viewpoint(view);
    const RayGrid grid = caster ? trace(*caster, view) : RayGrid{};
    for (Contender& c : contenders) {
      if (!c.sorter) continue;
      for (int r = 0; r < wish.repeat; ++r)
        c.frames.add(bench::spentOn([&] { (*c.sorter)(from, order); }));
      if (caster) judge(c, mesh, view, v, grid, order);
    }
  }
  fmt::print("{} ({} cells)\n", fs::path(name).filename().string(), mesh.cell_count());
  bool right = true;
  const double base = contenders.empty() ? 0.0 : bench::median(contenders.front().frames.cpu);
  for (const Contender& c : contenders) {
    if (!c.sorter) {
      fmt::print("  {:12} {}\n", sort::name(c.algorithm), c.refused);
      continue;
    }
    const double wall = bench::median(c.frames.wall), cpu = bench::median(c.frames.cpu);
    fmt::print("  {:12} prepare {:7.3f} s, view {:8.2f} ms, cpu {:8.2f} ms ({:5.2f} x), {:5.1f} B/cell, exact {}/{}",
               sort::name(c.algorithm), c.prepare, 1e3 * wall, 1e3 * cpu, cpu / base,
               static_cast<double>(c.sorter->bytes()) / static_cast<double>(mesh.cell_count()), c.exact, wish.views);
    if (caster) {
      fmt::print(
          ", {} rays, wrong {} ({:.4f}%), of them where cells overlap {}, inversions {}, of overlapping cells {}",
          c.rays, c.wrong, c.rays == 0 ? 0.0 : 100.0 * static_cast<double>(c.wrong) / static_cast<double>(c.rays),
          c.overlapping, c.inversions, c.contested);
    }
    fmt::print(", cycles {}, cuts {}", c.cycles, c.cut);
    if (const auto* x = dynamic_cast<const sort::Xmpvo*>(c.sorter.get()))
      fmt::print(", searched {}, put off {}", x->turns().searched(), x->turns().putOff());
    if (const auto* b = dynamic_cast<const sort::BspXmpvo*>(c.sorter.get()))
      fmt::print(", b {}, {} nodes, {} fragments, searched {}, put off {}", b->tree().triangles(), b->tree().nodes(),
                 b->tree().fragments(), b->turns().searched(), b->turns().putOff());
    if (const auto* n = dynamic_cast<const sort::Newell*>(c.sorter.get()))
      fmt::print(", {:.1f} pairs tested a cell",
                 static_cast<double>(n->pairsTested()) / static_cast<double>(mesh.cell_count()));
    fmt::print("\n");
    if (!c.worst.empty()) fmt::print("    EXACT BUT WRONG in {} views; {}\n", c.wrong_exact, c.worst);
    right = right && c.wrong_exact == 0;
  }
  std::fflush(stdout);
  return right;
}

Wish parse(int argc, char** argv) {
  Wish wish;
  const auto number = [&](int& i) {
    if (i + 1 >= argc) throw Error(fmt::format("{} needs a number", argv[i]));
    return std::stoi(argv[++i]);
  };
  for (int i = 1; i < argc; ++i) {
    const std::string_view arg = argv[i];
    if (arg == "--views") {
      wish.views = number(i);
    } else if (arg == "--rays") {
      wish.rays = number(i);
    } else if (arg == "--repeat") {
      wish.repeat = number(i);
    } else if (arg == "--newell") {
      wish.newell_cells = number(i);
    } else if (arg == "--seed") {
      wish.seed = static_cast<std::uint64_t>(number(i));
    } else if (arg == "--strict") {
      wish.strict = true;
    } else if (arg == "--sorts" && i + 1 < argc) {
      std::string_view list = argv[++i];
      while (!list.empty()) {
        const auto comma = std::min(list.find(','), list.size());
        wish.sorts.push_back(sort::algorithm(list.substr(0, comma)));
        list.remove_prefix(std::min(comma + 1, list.size()));
      }
    } else if (fs::is_directory(arg)) {
      std::vector<std::string> files;
      for (const auto& entry : fs::directory_iterator(arg)) {
        if (entry.is_regular_file()) files.push_back(entry.path().string());
      }
      std::sort(files.begin(), files.end());
      wish.meshes.insert(wish.meshes.end(), files.begin(), files.end());
    } else {
      wish.meshes.emplace_back(arg);
    }
  }
  using sort::Algorithm;
  if (wish.sorts.empty()) {
    wish.sorts = {Algorithm::mpvo,        Algorithm::mpvonc, Algorithm::xmpvo, Algorithm::bsp_xmpvo,
                  Algorithm::convexified, Algorithm::power,  Algorithm::newell};
  }
  return wish;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Wish wish = parse(argc, argv);
    fmt::print("{} views of each mesh, {}x{} rays, seed {}\n", wish.views, wish.rays, wish.rays, wish.seed);
    bool right = true;
    for (const std::string& name : wish.meshes) {
      try {
        right = runMesh(name, wish) && right;
      } catch (const Error& error) {
        fmt::print("{}: {}\n", name, error.what());
      }
    }
    return wish.strict && !right ? 1 : 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
