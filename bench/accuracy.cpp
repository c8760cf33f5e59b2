// Every mesh of a folder, from several views and under several transfer functions, by every backend, sort and
// integrator, against the reference: writes the tables of docs/accuracy.md and pictures of the largest differences.
//   spillikin_accuracy FOLDER OUTPUT.md [SIZE]
// Fails where an exact way is off by more than 1/255 on a mesh whose cells do not overlap.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/suite.h"
#include "spillikin/base/error.h"
#include "spillikin/io/write_image.h"
#include "spillikin/reference/compare.h"
#include "spillikin/reference/flat_face_cost.h"
#include "spillikin/reference/reference.h"
#include "spillikin/render/session.h"

namespace {

using namespace spillikin;
namespace fs = std::filesystem;

struct Way {
  std::string label;
  render::Engine engine;
};

// One step of an 8-bit picture: what the exact ways are held to.
constexpr double bound = 1.0 / 255.0;

// Newell's order compares pairs of cells, some 10 us a cell: on more cells than this it is left out, by name in the
// tables.
constexpr std::size_t most_newell_cells = 300'000;

std::string leftOut(const Way& way, const mesh::Mesh& mesh) {
  if (way.engine.sort == sort::Algorithm::newell && mesh.cell_count() > most_newell_cells)
    return fmt::format("not run: {} cells, more than {}", mesh.cell_count(), most_newell_cells);
  if (way.engine.walking == composite::Walking::always && !mesh.tetrahedral()) return "not run: not all tetrahedra";
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
  all.back().engine.walking = composite::Walking::never;
  add("native, walked", Backend::native, Integration::exact, Algorithm::automatic);
  all.back().engine.walking = composite::Walking::always;
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
  std::string_view label;  // of the look
  integrate::TransferFunction look;
  Image image;
  std::vector<std::uint8_t> edge_on;
  std::size_t overlaps = 0;  // of ray intervals: no order is right there
};

// One picture for each view and each of the looks named, or all of them.
std::vector<Truth> truths(const render::Session& session, const reference::RayCaster& caster, int size,
                          mesh::FieldModel model, std::string_view only = {}) {
  std::vector<Truth> all;
  reference::Options options;
  options.model = model;
  for (const View& view : bench::views(session, size)) {
    const auto edge_on = caster.edgeOnMask(view);
    for (const bench::Look& look : bench::looks) {
      if (!only.empty() && only != look.label) continue;
      auto tf = bench::lookOf(session, look.preset);
      reference::Report report;
      Image image = caster.render(view, tf, options, &report);
      all.push_back({view, look.label, std::move(tf), std::move(image), edge_on, report.overlaps});
    }
  }
  return all;
}

Outcome judge(const mesh::Source& source, const Way& way, const std::vector<Truth>& all, Image* worst_picture) {
  Outcome outcome;
  try {
    render::Session session(source, way.engine);
    for (const Truth& truth : all) {
      // An order's errors show most where the look jumps.
      if (way.engine.sort != sort::Algorithm::automatic && truth.label != "jumping") continue;
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

bool hasShapeFunctions(const mesh::Mesh& mesh) {
  return std::any_of(mesh.cell_type.begin(), mesh.cell_type.end(), [](mesh::CellType type) {
    return type == mesh::CellType::hexahedron || type == mesh::CellType::wedge || type == mesh::CellType::pyramid;
  });
}

double quantile(std::vector<double>& sorted, double part) {
  return sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))];
}

// Flat faces against true ones on the rays of the view from aslant, as a sentence.
std::string cellCosts(const render::Session& session, const reference::RayCaster& caster, int size) {
  const auto costs = reference::flatFaceCost(caster, bench::views(session, size)[1], session.mesh().cell_count());
  std::vector<double> lengths, scalars;
  const double range = session.field().hi - session.field().lo;
  for (const auto& cost : costs) {
    if (cost.rays == 0) continue;
    lengths.push_back(cost.relative());
    scalars.push_back(range > 0.0 ? cost.worst_scalar / range : 0.0);
  }
  if (lengths.empty()) return {};
  const auto over = std::count_if(lengths.begin(), lengths.end(), [](double part) { return part > 0.01; });
  std::sort(lengths.begin(), lengths.end());
  std::sort(scalars.begin(), scalars.end());
  return fmt::format(
      "Cell by cell, seen from aslant: of {} cells that rays meet, flat faces change the length inside by {:.1e} "
      "(median), "
      "{:.1e} (99 %), {:.1e} (worst), by more than 1 % in {}; the mean scalar on a ray by {:.1e}, {:.1e} and {:.1e} of "
      "its "
      "range.\n\n",
      lengths.size(), quantile(lengths, 0.5), quantile(lengths, 0.99), lengths.back(), over, quantile(scalars, 0.5),
      quantile(scalars, 0.99), scalars.back());
}

// What it costs that cells are drawn with flat faces: whole, and as the tetrahedra of the subdivision.
std::string againstCurved(const mesh::Source& source, const render::Session& session,
                          const reference::RayCaster& caster, int size) {
  if (!hasShapeFunctions(session.mesh())) return {};
  std::string text = "\nAgainst the elements' own curved shapes and shape functions, smooth and comb:\n\n";
  text += cellCosts(session, caster, size);
  text += "| way | smooth, max | mean | over 1/255 | comb, max | mean | over 1/255 |\n|---|---|---|---|---|---|---|\n";
  const auto smooth = truths(session, caster, size, mesh::FieldModel::isoparametric, "smooth");
  const auto comb = truths(session, caster, size, mesh::FieldModel::isoparametric, "comb");
  for (const auto projection : {render::Projection::zoo, render::Projection::tets}) {
    Way way{projection == render::Projection::zoo ? "native, whole cells" : "native, fully subdivided", {}};
    way.engine.projection = projection;
    way.engine.backend = composite::Backend::native;
    const Outcome s = judge(source, way, smooth, nullptr), c = judge(source, way, comb, nullptr);
    text += fmt::format("| {} | {:.2e} | {:.2e} | {} | {:.2e} | {:.2e} | {} |\n", way.label, s.max, s.mean, s.over,
                        c.max, c.mean, c.over);
  }
  return text;
}

struct Judged {
  std::string summary, text;  // a row of the table in front; the mesh's own section
  bool missed = false;        // an exact way is over the bound without an excuse
};

std::string shortText(const Outcome& o) {
  return o.refused.empty() ? fmt::format("{:.1e} / {:.1e} / {}", o.max, o.mean, o.over) : "refused";
}

Judged judgeMesh(const fs::path& path, const fs::path& pictures, int size) {
  const std::string name = path.filename().string();
  Judged out;
  out.text = fmt::format("\n## {}\n\n", name);
  mesh::Source source;
  std::optional<render::Session> session;
  try {
    source = bench::read(path);
    session.emplace(source);
  } catch (const Error& e) {
    out.summary = fmt::format("| {} | not rendered | | | |\n", name);
    out.text += "Not rendered: " + bench::withoutFolder(e.what(), path) + "\n";
    return out;
  }
  const reference::RayCaster caster(session->mesh(), session->field());
  const auto all = truths(*session, caster, size, mesh::FieldModel::face);
  const std::string algorithm = (session->order(), session->stats().sort.algorithm);
  out.text += fmt::format("{} cells, field `{}`. `auto` sorts by {}.\n\n", session->mesh().cell_count(),
                          session->field().name, algorithm);
  std::size_t overlaps = 0;
  for (const Truth& truth : all)
    overlaps += truth.overlaps;
  if (overlaps > 0)
    out.text +=
        fmt::format("Cells overlap in space on {} of the ray intervals, where no order is right.\n\n", overlaps);
  out.text += "| way | max | mean | pixels over 1/255 | edge-on, apart |\n|---|---|---|---|---|\n";
  out.summary = fmt::format("| {} | {} | {} |", name, session->mesh().cell_count(), algorithm);
  for (const Way& way : ways()) {
    Image picture;
    const bool first = way.label == "native";
    Outcome outcome;
    outcome.refused = leftOut(way, session->mesh());
    if (outcome.refused.empty()) outcome = judge(source, way, all, first ? &picture : nullptr);
    outcome.refused = bench::withoutFolder(outcome.refused, path);
    out.text += row(way.label, outcome);
    const bool exact =
        way.engine.sort == sort::Algorithm::automatic && way.engine.integration == composite::Integration::exact;
    out.missed |= exact && overlaps == 0 && outcome.max > bound;
    if (first || way.label == "osmesa") out.summary += fmt::format(" {} |", shortText(outcome));
    if (first && outcome.refused.empty())
      io::writeImage((pictures / (path.stem().string() + "_difference.png")).string(), picture);
  }
  out.summary += "\n";
  out.text += againstCurved(source, *session, caster, size);
  return out;
}

std::string heading(int size) {
  return fmt::format(
      "# Accuracy\n\n"
      "Made by `make accuracy`. Every mesh, three views ({0}×{0} pixels; perspective from the front and aslant, "
      "parallel "
      "aslant), three transfer functions (smooth, jumping, comb), against the reference under the same field model. "
      "Errors are absolute, full scale is 1, the largest of the four channels, the worst of the pictures; pixels over "
      "1/255 are the sum over them. Pixels whose centre lies within 1/256 pixel of an edge-on exterior face are "
      "counted "
      "apart. Ways named by a sort are drawn under the jumping transfer function alone, and as the order comes, "
      "without "
      "the native backend's repair, to show what each order is worth; the sort newell on at most {1} cells. Native "
      "pictures are drawn in an order, and of tetrahedra walked through as well. "
      "Difference "
      "pictures of the native backend, where it differs most: `accuracy/`.\n\n"
      "| mesh | cells | sort | native: max / mean / pixels over 1/255 | osmesa |\n|---|---|---|---|---|\n",
      size, most_newell_cells);
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
  fs::create_directories(pictures);  // and the report's own folder
  std::string summary = heading(size), details, missed;
  for (const fs::path& path : bench::meshes(argv[1])) {
    fmt::print("{}\n", path.filename().string());
    std::fflush(stdout);
    const Judged judged = judgeMesh(path, pictures, size);
    summary += judged.summary;
    details += judged.text;
    if (judged.missed) missed += fmt::format(" {}", path.filename().string());
    // After every mesh, so that a run that is cut short leaves what it has.
    const std::string text = summary + details;
    io::writeFile(output.string(), text.data(), text.size());
  }
  if (!missed.empty()) throw Error(fmt::format("over 1/255 by an exact way:{}", missed));
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "spillikin_accuracy: error: {}\n", e.what());
  return 1;
}
