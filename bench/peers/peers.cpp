// Spillikin beside VTK's mappers, on the same meshes, cameras and transfer functions, in one run. Needs a display.
//   spillikin_peers speed FOLDER [OUTPUT.md [OUTPUT.json]] [--size N] [--rounds N] [--limit SECONDS] [--most CELLS]
//   spillikin_peers accuracy FOLDER [OUTPUT.md] [--size N] [--limit SECONDS] [--most CELLS]
// FOLDER holds the real meshes; those it has not are left out. Without OUTPUT the tables go to the terminal.
#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/peers/accuracy.h"
#include "bench/peers/speed.h"
#include "bench/peers/vtk_peer.h"
#include "bench/suite.h"
#include "spillikin/base/error.h"
#include "spillikin/io/write_image.h"

namespace {

using namespace spillikin;
using Json = nlohmann::ordered_json;

struct Arguments {
  std::vector<std::string> plain;
  int size = 0, rounds = 3;
  double limit = 0.0;
  std::size_t most = 0;
};

Arguments parse(int argc, char** argv) {
  Arguments a;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (!word.starts_with("--")) {
      a.plain.push_back(word);
      continue;
    }
    if (i + 1 == argc) throw Error(fmt::format("{} needs a value", word));
    const std::string value = argv[++i];
    if (word == "--size") {
      a.size = std::stoi(value);
    } else if (word == "--rounds") {
      a.rounds = std::stoi(value);
    } else if (word == "--limit") {
      a.limit = std::stod(value);
    } else if (word == "--most") {
      a.most = std::stoul(value);
    } else {
      throw Error(fmt::format("no option is called {}", word));
    }
  }
  if (a.plain.size() < 2 || a.plain.size() > 4 ||
      (a.plain[0] != "speed" && a.plain[0] != "orders" && a.plain[0] != "accuracy"))
    throw Error(
        "usage: spillikin_peers speed|orders|accuracy FOLDER [OUTPUT.md [OUTPUT.json]] [--size N] [--rounds N] "
        "[--limit SECONDS] [--most CELLS]");
  return a;
}

void write(const std::vector<std::string>& plain, std::size_t index, const std::string& text) {
  if (plain.size() > index) io::writeFile(plain[index], text.data(), text.size());
}

int speed(const Arguments& a, bool frames) {
  const auto measure = frames ? bench::measureSpeed : bench::measureOrders;
  const auto tables = frames ? bench::speedTables : bench::orderTables;
  bench::SpeedOptions options;
  if (a.size > 0) options.size = a.size;
  options.rounds = a.rounds;
  if (a.limit > 0.0) options.limit_seconds = a.limit;
  options.most_cells = a.most;
  Json all{{"vtk", bench::vtkVersion()},
           {"size", options.size},
           {"rounds", options.rounds},
           {"limit_seconds", options.limit_seconds},
           {"subjects", Json::array()}};
  for (const bench::Subject& subject : bench::subjects(a.plain[1])) {
    fmt::print(stderr, "{}\n", subject.label);
    try {
      if (a.most > 0 && subject.weight > a.most) throw Error("not run: left out by --most");
      all["subjects"].push_back(measure(subject, options));
    } catch (const Error& e) {
      all["subjects"].push_back({{"mesh", subject.label}, {"refused", e.what()}});
    }
    // After every mesh, so that a run that is cut short leaves what it has.
    write(a.plain, 2, tables(all));
    write(a.plain, 3, all.dump(2) + "\n");
  }
  if (a.plain.size() < 3) fmt::print("{}", tables(all));
  return 0;
}

int accuracy(const Arguments& a) {
  bench::AccuracyOptions options;
  if (a.size > 0) options.size = a.size;
  if (a.limit > 0.0) options.limit_seconds = a.limit;
  const std::filesystem::path folder = std::filesystem::path(a.plain[1]) / "";
  std::string text = bench::accuracyHeading(options);
  for (const bench::Subject& subject : bench::judgedSubjects(a.plain[1])) {
    fmt::print(stderr, "{}\n", subject.label);
    try {
      if (a.most > 0 && subject.weight > a.most) throw Error("left out by --most");
      text += bench::accuracyRows(subject, options);
    } catch (const Error& e) {
      text += fmt::format("| {} | not run: {} | | | |\n", subject.label, bench::withoutFolder(e.what(), folder));
    }
    write(a.plain, 2, text);
  }
  if (a.plain.size() < 3) fmt::print("{}", text);
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  const Arguments a = parse(argc, argv);
  return a.plain[0] == "accuracy" ? accuracy(a) : speed(a, a.plain[0] == "speed");
} catch (const std::exception& e) {
  fmt::print(stderr, "spillikin_peers: error: {}\n", e.what());
  return 1;
}
