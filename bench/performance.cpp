// The report of `make bench`: what the machine can do, and what Spillikin does on it, stage by stage and size by size.
//   spillikin_performance report OUTPUT.md [--bench FILE.json] [--peers FILE.md] [--data FOLDER] [--most CELLS]
//                                [--frames N] [--load LOAD]
//   spillikin_performance frame grid|delaunay N SIZE FRAMES       one mesh, as JSON: what the report runs as a child
// --bench is what spillikin_bench wrote, --peers what spillikin_peers wrote; both become sections of the report. --data
// is a folder of real meshes. --load is the machine's load before all of these were begun.
#include <fmt/format.h>
#include <tbb/info.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "bench/frame.h"
#include "bench/roads.h"
#include "bench/roofline.h"
#include "spillikin/base/error.h"
#include "spillikin/io/write_image.h"

namespace {

using namespace spillikin;
using Json = nlohmann::ordered_json;

constexpr double flops_per_fragment = 50.0;  // the design's estimate: set-up apart

struct Arguments {
  std::string output, bench, peers, data;
  std::size_t most = 10'500'000;
  int frames = 5;
  double load = -1.0;  // of the machine before any of this was begun; below 0: not told
};

std::string readAll(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw Error(fmt::format("{}: cannot be read", path));
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

// Least-squares slope of log y against log x: the power of growth.
double slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = std::log(x[i]);
    const double v = std::log(y[i]);
    sx += u;
    sy += v;
    sxx += u * u;
    sxy += u * v;
  }
  const auto n = static_cast<double>(x.size());
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

double slope(const std::vector<Json>& rows, const char* x, const char* y) {
  std::vector<double> xs, ys;
  for (const Json& r : rows) {
    xs.push_back(r[x]);
    ys.push_back(r[y]);
  }
  return rows.size() < 2 ? std::nan("") : slope(xs, ys);
}

std::string slopeText(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string("–");
}

double number(const Json& j, const char* key) {
  return j[key].get<double>();
}

const char* verdict(bool reached) {
  return reached ? "reached" : "**missed**";
}

// The load when the report begins, before its own work is in it.
double loadNow() {
  double load = 0.0;
  getloadavg(&load, 1);
  return load;
}

std::string machineSection(const bench::Roofline& r, double load) {
  const double pages = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  const int cores = tbb::info::default_concurrency();
  const char* shared = load <= 0.5 * cores
                           ? "the machine was this run's alone"
                           : "other programs ran beside it: times are longer, rates and peaks lower than alone, and "
                             "verdicts on absolute times have to be taken again on a quiet machine; processor seconds "
                             "and ratios are the figures to read";
  return fmt::format(
      "## The machine\n\n{}, {} cores, {:.0f} GB of memory, vectors of {} floats ({}). When the run began the load was "
      "{:.1f}: {}.\n\n"
      "| by a micro-benchmark in this run | one core | all cores |\n|---|---|---|\n"
      "| multiply-adds in single precision, Gflop/s | {:.1f} | {:.1f} |\n"
      "| memory moved by a[i] = b[i] + s c[i], GB/s | {:.1f} | {:.1f} |\n",
      processor(), cores, pages * 1e-9, r.lanes, r.instructions, load, shared, r.flops * 1e-9, r.all_flops * 1e-9,
      r.bytes * 1e-9, r.all_bytes * 1e-9);
}

std::string label(const Json& r) {
  return r["kind"] == "grid" ? "moved grid" : "Delaunay";
}

std::string sorterOf(const Json& r) {
  return r["walked"].get<bool>() ? "walked" : r["sorter"].get<std::string>();
}

std::string stageSection(const std::vector<Json>& rows, const bench::Roofline& roof) {
  std::string text =
      "\n## One frame, stage by stage\n\nA cube of tetrahedra, 1024² pixels, perspective, `native`, `--sort auto`, a "
      "new "
      "viewpoint each frame (azimuth +4°): medians in seconds. Meshes whose cells are small are walked through, which "
      "takes "
      "no order and no projection, and stand there once more as they are drawn in an order.\n\n"
      "| mesh | cells | frame | processor | sort | project | composite | sorter | pixels flagged / unresolved "
      "|\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Json& r : rows) {
    text += fmt::format("| {} | {} | {:.4f} | {:.4f} | {:.4f} | {:.4f} | {:.4f} | {}{} | {} / {} |\n", label(r),
                        r["cells"].get<std::size_t>(), number(r, "frame_seconds"), number(r, "frame_cpu_seconds"),
                        number(r, "sort_seconds"), number(r, "project_seconds"), number(r, "composite_seconds"),
                        sorterOf(r), r["exact"].get<bool>() ? "" : ", inexact", r["flagged"].get<std::size_t>(),
                        r["unresolved"].get<std::size_t>());
  }
  text += fmt::format(
      "\nAgainst what the machine can do: a fragment counted as {:.0f} flops; bytes are those of the arrays that a "
      "frame "
      "has to read or write once.\n\n| mesh | cells | fragments | million fragments/s | Gflop/s | of the peak of all "
      "cores "
      "| GB/s | of the bandwidth |\n|---|---|---|---|---|---|---|---|\n",
      flops_per_fragment);
  for (const Json& r : rows) {
    const double rate = number(r, "fragments") / (number(r, "project_seconds") + number(r, "composite_seconds"));
    const double bytes = number(r, "least_bytes") / number(r, "frame_seconds");
    text +=
        fmt::format("| {}{} | {} | {} | {:.1f} | {:.2f} | {:.1f} % | {:.2f} | {:.1f} % |\n", label(r),
                    r["walked"].get<bool>() ? ", walked" : "", r["cells"].get<std::size_t>(),
                    r["fragments"].get<std::size_t>(), rate * 1e-6, rate * flops_per_fragment * 1e-9,
                    100.0 * rate * flops_per_fragment / roof.all_flops, bytes * 1e-9, 100.0 * bytes / roof.all_bytes);
  }
  return text;
}

std::string sortSection(const std::vector<Json>& rows) {
  std::string text =
      "\n## Orders\n\nMillion cells a second from a new viewpoint, and what the sorter keeps. Targets: mpvo 30 and "
      "power "
      "80 at a million, mpvo at most 64 bytes a tetrahedron.\n\n| mesh | cells | mpvo | power | centroid | bytes a "
      "cell: "
      "mpvo | power |\n|---|---|---|---|---|---|---|\n";
  for (const Json& r : rows) {
    const double cells = number(r, "cells");
    const auto rate = [&](const char* a) { return 1e-6 * cells / number(r["sorts"][a], "seconds"); };
    text += fmt::format("| {} | {:.0f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", label(r), cells, rate("mpvo"),
                        rate("power"), rate("centroid"), number(r["sorts"]["mpvo"], "bytes") / cells,
                        number(r["sorts"]["power"], "bytes") / cells);
  }
  return text;
}

std::string memorySection(const std::vector<Json>& rows) {
  std::string text =
      "\n## Memory\n\nThe peak is that of resident memory from the moment the mesh stands in memory as read until "
      "after "
      "the frames, everything counted: program, libraries, image. Beyond the mesh as read is the peak less the size of "
      "what a reader hands over. Targets: at most 150 bytes a tetrahedron beyond it, 10 million in under 4 GB.\n\n"
      "| mesh | cells | as read, bytes a cell | kept by mesh and sorter | peak, GB | beyond the mesh as read, bytes a "
      "cell "
      "|\n|---|---|---|---|---|---|\n";
  for (const Json& r : rows) {
    const double cells = number(r, "cells");
    text += fmt::format("| {} | {:.0f} | {:.0f} | {:.0f} | {:.3f} | {:.0f} |\n", label(r), cells,
                        number(r, "source_bytes") / cells, number(r, "kept_bytes_per_cell"),
                        number(r, "peak_bytes") * 1e-9, (number(r, "peak_bytes") - number(r, "source_bytes")) / cells);
  }
  const Json& last = rows.back();
  if (number(last, "cells") > 9e6) {
    const double beyond = (number(last, "peak_bytes") - number(last, "source_bytes")) / number(last, "cells");
    text += fmt::format("\nTen million in under 4 GB: {}. At most 150 bytes beyond the mesh as read: {}.\n",
                        verdict(number(last, "peak_bytes") < 4e9), verdict(beyond <= 150.0));
  }
  return text;
}

// The same meshes, or images, drawn in an order and as `--walk auto` would.
std::string growthSection(const std::vector<Json>& grids, const std::vector<Json>& quick_grids,
                          const std::vector<Json>& pixels, const std::vector<Json>& quick_pixels) {
  const auto slopeOf = [](const std::vector<Json>& rows, const char* what) {
    return slopeText(slope(rows, "cells", what));
  };
  std::string text = fmt::format(
      "\n## Growth\n\nLog–log slopes by least squares; 1 is linear. A small mesh pays for its pixels, which all of "
      "them "
      "share.\n\nIn cells, {} to {} (moved grids, 1024²), in an order: build {}, frame {} (of processor time {}), sort "
      "{}, composite {}. With walking where it is quicker: frame {} (of processor time {}).\n",
      grids.front()["cells"].get<std::size_t>(), grids.back()["cells"].get<std::size_t>(),
      slopeOf(grids, "build_seconds"), slopeOf(grids, "frame_seconds"), slopeOf(grids, "frame_cpu_seconds"),
      slopeOf(grids, "sort_seconds"), slopeOf(grids, "composite_seconds"), slopeOf(quick_grids, "frame_seconds"),
      slopeOf(quick_grids, "frame_cpu_seconds"));
  text +=
      "\n| pixels each way | in an order: frame | sort | composite | fragments | million fragments/s | `--walk auto`: "
      "frame | walked |\n|---|---|---|---|---|---|---|---|\n";
  std::vector<double> area, frame, composite, quick;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Json &r = pixels[i], &q = quick_pixels[i];
    const double size = number(r, "size");
    area.push_back(size * size);
    frame.push_back(number(r, "frame_seconds"));
    composite.push_back(number(r, "composite_seconds"));
    quick.push_back(number(q, "frame_seconds"));
    text += fmt::format("| {:.0f} | {:.4f} | {:.4f} | {:.4f} | {} | {:.1f} | {:.4f} | {} |\n", size, frame.back(),
                        number(r, "sort_seconds"), composite.back(), r["fragments"].get<std::size_t>(),
                        1e-6 * number(r, "fragments") / composite.back(), quick.back(),
                        q["walked"].get<bool>() ? "yes" : "no");
  }
  text += fmt::format("\nIn pixels, {} cells: frame {}, composite {}; with walking, frame {}.\n",
                      pixels.front()["cells"].get<std::size_t>(), slopeText(slope(area, frame)),
                      slopeText(slope(area, composite)), slopeText(slope(area, quick)));
  return text;
}

std::string tierSection(const Json& r) {
  return fmt::format(
      "\n## What changes, what is redone\n\n{} cells, 1024², seconds.\n\n| change | time |\n|---|---|\n| topology: "
      "mesh "
      "built | {:.3f} |\n| geometry: sorter prepared | {:.3f} |\n| viewpoint, 4° on: frame | {:.4f} |\n| viewpoint, "
      "0.05° "
      "on: frame | {:.4f} |\n| viewpoint, 4° on: sort | {:.4f} |\n| viewpoint, 0.05° on: sort | {:.4f} |\n| scalar: "
      "frame | "
      "{:.4f} |\n| transfer function: frame | {:.4f} |\n",
      r["cells"].get<std::size_t>(), number(r, "build_seconds"), number(r, "prepare_seconds"),
      number(r, "frame_seconds"), number(r, "small_move_frame_seconds"), number(r, "sort_seconds"),
      number(r, "small_move_sort_seconds"), number(r, "scalar_seconds"), number(r, "look_seconds"));
}

std::string benchSection(const std::string& path) {
  const Json all = Json::parse(readAll(path), nullptr, false);
  if (all.is_discarded()) throw Error(fmt::format("{}: is not what spillikin_bench writes", path));
  std::string text =
      "\n## Each room's own benchmarks\n\n`spillikin_bench`, one line each.\n\n| benchmark | wall | processor | "
      "million "
      "items/s |\n|---|---|---|---|\n";
  for (const Json& b : all["benchmarks"]) {
    if (b.contains("error_occurred") && b["error_occurred"].get<bool>()) {
      text += fmt::format("| {} | {} | | |\n", b["name"].get<std::string>(), b["error_message"].get<std::string>());
      continue;
    }
    const std::string unit = b["time_unit"];
    const std::string items =
        b.contains("items_per_second") ? fmt::format("{:.2f}", 1e-6 * number(b, "items_per_second")) : std::string();
    text += fmt::format("| {} | {:.4g} {} | {:.4g} {} | {} |\n", b["name"].get<std::string>(), number(b, "real_time"),
                        unit, number(b, "cpu_time"), unit, items);
  }
  return text;
}

std::vector<Json> measure(const std::string& program, const std::vector<bench::FrameJob>& jobs) {
  std::vector<Json> rows;
  for (const bench::FrameJob& job : jobs) {
    fmt::print(stderr, "{} {}, {}² pixels\n", job.kind, job.n, job.size);
    rows.push_back(bench::measureFrameApart(program, job));
  }
  return rows;
}

// What the targets are about, from the rooms' own benchmarks: the name's beginning, and what it is.
struct Headline {
  const char* name;
  const char* what;
};
constexpr std::array headlines{
    Headline{"compositeNative/cube10k/1024/2", "11 thousand tetrahedra composited at 1024², two cores"},
    Headline{"compositeNative/cube100k/1024/2", "104 thousand"},
    Headline{"compositeNative/cube1M/1024/2", "a million; the sort is apart"},
    Headline{"compositeNative/shell100k/1024/2", "a nonconvex shell of 84 thousand"},
    Headline{"compositeNative/tori100k/1024/2", "interlocked tori of 96 thousand"},
    Headline{"compositeNative/hexahedra50k/1024/2", "51 thousand hexahedra drawn whole"},
    Headline{"sort/mpvo/55", "998 thousand tetrahedra ordered from a new viewpoint"},
    Headline{"sort/power/55", "the same by power distances"},
    Headline{"mesh/build/tetrahedra/55", "the same from the source to a finished mesh"},
    Headline{"referenceRender/n:55/pixels:512/quadrature:0", "the same, 512² rays in double precision"},
};

std::string headlineSection(const std::string& path) {
  const Json all = Json::parse(readAll(path), nullptr, false);
  if (all.is_discarded()) throw Error(fmt::format("{}: is not what spillikin_bench writes", path));
  std::string text = "\n## At a glance\n\n| benchmark | what | wall, ms |\n|---|---|---|\n";
  for (const Headline& h : headlines) {
    for (const Json& b : all["benchmarks"]) {
      if (!b["name"].get<std::string>().starts_with(h.name) || b.contains("error_occurred")) continue;
      const std::string unit = b["time_unit"];
      const double ms = number(b, "real_time") * (unit == "ns" ? 1e-6 : unit == "us" ? 1e-3 : unit == "s" ? 1e3 : 1.0);
      text += fmt::format("| `{}` | {} | {:.3g} |\n", h.name, h.what, ms);
      break;
    }
  }
  return text;
}

std::vector<bench::FrameJob> inAnOrder(std::vector<bench::FrameJob> jobs) {
  for (bench::FrameJob& job : jobs)
    job.walk = false;
  return jobs;
}

int report(const std::string& program, const Arguments& a) {
  const double load = a.load >= 0.0 ? a.load : loadNow();
  const bench::Roofline roof = bench::measureRoofline();
  std::vector<bench::FrameJob> grids, cubes, sizes;
  for (const std::size_t n : {12UL, 26UL, 55UL, 118UL}) {
    if (6 * n * n * n <= a.most) grids.push_back({"grid", n, 1024, n > 100 ? 2 : a.frames});
  }
  for (const std::size_t points : {1'600UL, 15'000UL, 149'000UL}) {
    if (7 * points <= a.most) cubes.push_back({"delaunay", points, 1024, a.frames});
  }
  for (const int size : {256, 512, 1024, 2048})
    sizes.push_back({"grid", a.most < 1'000'000 ? 26UL : 55UL, size, a.frames});
  std::vector<Json> rows = measure(program, cubes);
  const auto grid_rows = measure(program, grids), ordered_grid_rows = measure(program, inAnOrder(grids));
  const auto pixel_rows = measure(program, sizes), ordered_pixel_rows = measure(program, inAnOrder(sizes));
  std::string text =
      "# Performance\n\nMade by the programs that `make bench` runs. Times on the wall unless \"processor\" is said: "
      "that "
      "is the sum over all cores. Compare ratios within one table, not figures between machines.\n\n" +
      machineSection(roof, load);
  if (!a.bench.empty()) text += headlineSection(a.bench);
  if (!cubes.empty() && number(rows.back(), "cells") > 900'000) {
    text += fmt::format("\nA million random tetrahedra in at most 0.13 s at 1024²: {:.3f} s, {}.\n",
                        number(rows.back(), "frame_seconds"), verdict(number(rows.back(), "frame_seconds") <= 0.13));
  }
  if (rows.empty() || grid_rows.empty())
    throw Error("--most leaves no mesh to be measured: it should be at least 20000");
  const Json& tiers = rows.back();
  const std::string tier_text = tierSection(tiers);
  std::vector<Json> staged = rows;
  rows.insert(rows.end(), grid_rows.begin(), grid_rows.end());
  for (std::size_t i = 0; i < grid_rows.size(); ++i) {
    staged.push_back(grid_rows[i]);
    if (grid_rows[i]["walked"].get<bool>()) staged.push_back(ordered_grid_rows[i]);
  }
  text += stageSection(staged, roof) + sortSection(rows) + memorySection(rows) +
          growthSection(ordered_grid_rows, grid_rows, ordered_pixel_rows, pixel_rows) + tier_text +
          bench::roadsSection(a.data, a.most, 3);
  if (!a.peers.empty()) text += "\n" + readAll(a.peers);
  if (!a.bench.empty()) text += benchSection(a.bench);
  io::writeFile(a.output, text.data(), text.size());
  return 0;
}

Arguments parse(int argc, char** argv) {
  Arguments a;
  a.output = argv[2];
  for (int i = 3; i + 1 < argc; i += 2) {
    const std::string word = argv[i];
    const std::string value = argv[i + 1];
    if (word == "--bench") {
      a.bench = value;
    } else if (word == "--peers") {
      a.peers = value;
    } else if (word == "--data") {
      a.data = value;
    } else if (word == "--most") {
      a.most = std::stoul(value);
    } else if (word == "--load") {
      a.load = std::stod(value);
    } else if (word == "--frames") {
      a.frames = std::stoi(value);
    } else {
      throw Error(fmt::format("no option is called {}", word));
    }
  }
  return a;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (mode == "frame" && argc == 7) {
    const bench::FrameJob job{argv[2], std::stoul(argv[3]), std::stoi(argv[4]), std::stoi(argv[5]),
                              argv[6] == std::string("1")};
    fmt::print("{}\n", bench::measureFrame(job).dump());
    return 0;
  }
  if (mode == "report" && argc >= 3) return report(argv[0], parse(argc, argv));
  fmt::print(stderr,
             "usage: spillikin_performance report OUTPUT.md [--bench FILE.json] [--peers FILE.md] [--data FOLDER] "
             "[--most CELLS] [--frames N] [--load LOAD]\n");
  return 2;
} catch (const std::exception& e) {
  fmt::print(stderr, "spillikin_performance: error: {}\n", e.what());
  return 1;
}
