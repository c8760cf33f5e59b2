// Every mesh of a folder, from several views and under several transfer functions, by every backend, sort and
// integrator, against the reference: writes the tables of docs/accuracy.md and pictures of the largest differences.
//   spillikin_accuracy FOLDER OUTPUT.md [SIZE]
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/io/read.h"
#include "spillikin/io/write_image.h"
#include "spillikin/reference/compare.h"
#include "spillikin/reference/reference.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/session.h"

namespace {

using namespace spillikin;
namespace fs = std::filesystem;

struct Look {
  const char* label;
  const char* preset;
};
constexpr std::array<Look, 3> looks{{{"smooth", "viridis"}, {"jumping", "steps"}, {"comb", "comb"}}};

struct Way {
  std::string label;
  render::Engine engine;
};

// What is left out of a run, by rule and by name in the tables. The OpenGL ways cost cells times pixels on a software
// rasterizer: the one that has to be exact may cost more than the others. Newell's order compares pairs of cells.
constexpr double most_work_exact = 4e9;  // cells times pixels of a picture
constexpr double most_work_others = 1e9;
constexpr std::size_t most_newell_cells = 20'000;

std::string leftOut(const Way& way, std::size_t cells, int size) {
  const double work = static_cast<double>(cells) * size * size;
  const double most = way.label == "osmesa" ? most_work_exact : most_work_others;
  if (way.engine.backend != composite::Backend::native && work > most)
    return fmt::format("not run: cells × pixels {:.1e}, more than {:.0e}", work, most);
  if (way.engine.sort == sort::Algorithm::newell && cells > most_newell_cells)
    return fmt::format("not run: {} cells, more than {}", cells, most_newell_cells);
  return {};
}

std::vector<Way> ways() {
  using composite::Backend;
  using composite::Integration;
  using render::Projection;
  using sort::Algorithm;
  std::vector<Way> all;
  const auto add = [&](const std::string& label, Backend backend, Integration integration, Algorithm algorithm) {
    all.push_back({label, {algorithm, Projection::automatic, integration, backend}});
  };
  add("native", Backend::native, Integration::exact, Algorithm::automatic);
  add("osmesa", Backend::osmesa, Integration::exact, Algorithm::automatic);
  add("egl", Backend::egl, Integration::exact, Algorithm::automatic);
  add("osmesa, preintegrated", Backend::osmesa, Integration::preintegrated, Algorithm::automatic);
  add("osmesa, average", Backend::osmesa, Integration::average, Algorithm::automatic);
  add("osmesa, vertex", Backend::osmesa, Integration::vertex, Algorithm::automatic);
  for (const Algorithm a :
       {Algorithm::mpvo, Algorithm::mpvonc, Algorithm::xmpvo, Algorithm::bsp_xmpvo, Algorithm::power, Algorithm::newell,
        Algorithm::convexified, Algorithm::centroid, Algorithm::none}) {
    add(fmt::format("osmesa, sort {}", sort::name(a)), Backend::osmesa, Integration::exact, a);
  }
  return all;
}

// Three views: perspective from the front and from aslant, parallel from aslant.
std::vector<View> views(const render::Session& session, int size) {
  std::vector<View> all(3, session.defaultView(size, size));
  render::turnView(all[1], {37.0, 23.0, 1.2});
  const render::Box box = render::boundingBox(session.mesh());
  all[2].parallel_scale = render::fittingParallelScale(box, size, size);
  render::turnView(all[2], {-61.0, 41.0, 1.3});
  return all;
}

struct Outcome {
  double max = 0.0, mean = 0.0;
  std::size_t over = 0, pixels = 0, apart = 0;
  std::string refused;

  void add(const reference::Comparison& c) {
    max = std::max(max, c.worst.max);
    mean = std::max(mean, c.worst.mean);
    over += c.over;
    pixels += c.pixels;
    apart += c.apart;
  }
};

struct Truth {
  View view;
  bool jumping = false;  // the look under which an order's errors show most
  integrate::TransferFunction look;
  Image image;
  std::vector<std::uint8_t> edge_on;
};

std::vector<Truth> truths(const render::Session& session, int size) {
  std::vector<Truth> all;
  const reference::RayCaster caster(session.mesh(), session.field());
  for (const View& view : views(session, size)) {
    const auto edge_on = caster.edgeOnMask(view);
    for (const Look& look : looks) {
      const auto preset = integrate::preset(look.preset).mapped(session.field().lo, session.field().hi);
      auto tf = preset.scaled(render::extinctionFactor(session.mesh(), session.field(), preset));
      Image image = caster.render(view, tf, {});
      all.push_back({view, std::string_view(look.label) == "jumping", std::move(tf), std::move(image), edge_on});
    }
  }
  return all;
}

Outcome judge(const mesh::Source& source, const Way& way, const std::vector<Truth>& all, Image* worst_picture) {
  Outcome outcome;
  try {
    render::Session session(source, way.engine);
    for (const Truth& truth : all) {
      if (way.engine.sort != sort::Algorithm::automatic && !truth.jumping) continue;
      session.setView(truth.view);
      session.setTransferFunction(truth.look);
      const Image image = session.draw();
      reference::CompareOptions options;
      options.apart = truth.edge_on;
      const reference::Comparison c = reference::compare(image, truth.image, options);
      if (worst_picture != nullptr && c.worst.max >= outcome.max) {
        *worst_picture = reference::differencePicture(image, truth.image);
      }
      outcome.add(c);
    }
  } catch (const Error& e) {
    outcome.refused = fmt::format("refused: {}", e.what());
  }
  return outcome;
}

std::string row(const std::string& label, const Outcome& o) {
  if (!o.refused.empty()) return fmt::format("| {} | {} | | | |\n", label, o.refused);
  return fmt::format("| {} | {:.2e} | {:.2e} | {} | {} |\n", label, o.max, o.mean, o.over, o.apart);
}

// A message as it reads wherever the folder lies.
std::string withoutFolder(std::string message, const fs::path& path) {
  const std::string folder = path.parent_path().string() + "/";
  for (std::size_t at = message.find(folder); at != std::string::npos; at = message.find(folder))
    message.erase(at, folder.size());
  return message;
}

std::string judgeMesh(const fs::path& path, const fs::path& pictures, int size) {
  std::string text = fmt::format("\n## {}\n\n", path.filename().string());
  mesh::Source source;
  std::optional<render::Session> session;
  try {
    source = io::readMesh(path.string());
    session.emplace(source);
  } catch (const Error& e) {
    return text + "Not rendered: " + withoutFolder(e.what(), path) + "\n";
  }
  const auto all = truths(*session, size);
  text += fmt::format("{} cells, field `{}`. `auto` sorts by {}.\n\n", session->mesh().cell_count(),
                      session->field().name, (session->order(), session->stats().sort.algorithm));
  text += "| way | max | mean | pixels over 1/255 | edge-on, apart |\n|---|---|---|---|---|\n";
  for (const Way& way : ways()) {
    Image picture;
    const bool first = way.label == "native";
    Outcome outcome;
    outcome.refused = leftOut(way, session->mesh().cell_count(), size);
    if (outcome.refused.empty()) outcome = judge(source, way, all, first ? &picture : nullptr);
    outcome.refused = withoutFolder(outcome.refused, path);
    text += row(way.label, outcome);
    if (first && outcome.refused.empty()) {
      const std::string name = path.stem().string() + "_difference.png";
      io::writeImage((pictures / name).string(), picture);
    }
    std::fflush(stdout);
  }
  return text;
}

bool isMesh(const fs::path& path) {
  static const std::array<const char*, 15> suffixes{".vtu", ".pvtu", ".vtk",  ".vts",  ".vtr",
                                                    ".vti", ".pvd",  ".ex2",  ".e",    ".exo",
                                                    ".g",   ".case", ".cgns", ".foam", "xyz.bin"};
  const std::string name = path.filename().string();
  return std::any_of(suffixes.begin(), suffixes.end(), [&](const std::string& s) { return name.ends_with(s); });
}

std::vector<fs::path> meshes(const fs::path& folder) {
  std::vector<fs::path> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (isMesh(entry.path())) all.push_back(entry.path());
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) {
    fmt::print(stderr, "usage: spillikin_accuracy FOLDER OUTPUT.md [SIZE]\n");
    return 2;
  }
  const fs::path output = argv[2];
  const int size = argc > 3 ? std::stoi(argv[3]) : 128;
  const fs::path pictures = output.parent_path() / "accuracy";
  fs::create_directories(pictures);
  std::string text = fmt::format(
      "# Accuracy\n\nMade by `make accuracy`. Every mesh, three views ({0}x{0} pixels; perspective from the front and "
      "aslant, parallel aslant), three transfer functions (smooth, jumping, comb), against the reference under the "
      "same "
      "field model. Errors are absolute, full scale is 1, the largest of the four channels, the worst of the pictures; "
      "pixels over 1/255 are the sum over them. Pixels whose centre lies within 1/256 pixel of an edge-on exterior "
      "face "
      "are counted apart. Ways named by a sort are drawn under the jumping transfer function alone, and as the order "
      "comes, without the native backend's repair, to show what each order is worth. Not run: where cells × pixels "
      "pass "
      "{1:.0e}, OpenGL ways other than plain `osmesa`, and past {2:.0e} that one too; the sort newell on more than {3} "
      "cells. Difference pictures of the native backend, where it differs most: `accuracy/`.\n",
      size, most_work_others, most_work_exact, most_newell_cells);
  for (const fs::path& path : meshes(argv[1])) {
    fmt::print("{}\n", path.filename().string());
    std::fflush(stdout);
    text += judgeMesh(path, pictures, size);
    io::writeFile(output.string(), text.data(), text.size());
  }
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "spillikin_accuracy: error: {}\n", e.what());
  return 1;
}
