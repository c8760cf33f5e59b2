#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "spillikin/cli/commands.h"
#include "spillikin/cli/scene.h"
#include "spillikin/io/write_image.h"
#include "spillikin/mesh/build.h"
#include "spillikin/sort/regularity.h"
#include "spillikin/sort/weights.h"

namespace spillikin::cli {

namespace {

using Json = nlohmann::ordered_json;

struct InfoOptions : SceneOptions {
  std::string json;
};

Json arraysOf(const mesh::Source& source, const mesh::Mesh& mesh) {
  Json arrays = Json::array();
  for (const mesh::Array& a : source.arrays) {
    Json entry{{"name", a.name},
               {"of", a.association == mesh::Association::points ? "points" : "cells"},
               {"components", a.components}};
    const mesh::Field field = mesh::selectField(source, mesh, a.name);
    entry["range"] = {field.lo, field.hi};
    entry["cells_without_value"] = field.hidden_count;
    arrays.push_back(std::move(entry));
  }
  return arrays;
}

// Whether power distances may order the cells, and with which weights.
Json regularityOf(const mesh::Mesh& mesh) {
  // Beyond so many cells the search for weights takes longer than all else, and memory as much as the mesh.
  constexpr std::size_t most_cells = 1'000'000;
  const sort::Regularity r = sort::regularity(mesh);
  Json j{{"regular_faces", r.regular}, {"tied_faces", r.tied}, {"irregular_faces", r.irregular}};
  if (r.ordered()) {
    j["verdict"] = "Delaunay";
  } else if (mesh.cell_count() > most_cells) {
    j["verdict"] = fmt::format("not Delaunay; weights not looked for in more than {} cells", most_cells);
  } else {
    const sort::Weights weights = sort::findWeights(mesh, true);
    switch (weights.verdict) {
      case sort::Weights::Verdict::exist:
        j["verdict"] = "regular with weights";
        break;
      case sort::Weights::Verdict::none:
        j["verdict"] = fmt::format("no weights exist: {} faces contradict each other", weights.contradiction.size());
        break;
      case sort::Weights::Verdict::undecided:
        j["verdict"] = "not Delaunay; whether weights exist is not decided";
        break;
    }
  }
  return j;
}

Json describe(const mesh::Source& source, const mesh::Mesh& mesh, const mesh::BuildReport& r,
              const sort::Sorter& sorter) {
  const mesh::Inspection i = mesh::inspect(mesh);
  Json j;
  j["file"] = source.name;
  j["cells"] = mesh.cell_count();
  Json types = Json::object();
  for (std::size_t t = 0; t < mesh::cell_type_count; ++t) {
    if (i.cells_by_type[t] > 0) types[mesh::name(static_cast<mesh::CellType>(t))] = i.cells_by_type[t];
  }
  j["cells_by_type"] = types;
  j["points"] = mesh.points.size();
  j["faces"] = mesh.face_count();
  j["exterior_faces"] = i.exterior_faces;
  j["components"] = i.components;
  j["nonplanar_faces"] = i.nonplanar_faces;
  j["fanned_faces"] = i.fanned_faces;
  j["nonplanar_fans"] = i.nonplanar_fans;
  j["nonconvex_cells"] = i.nonconvex_cells;
  j["nonconvex_polyhedra"] = i.nonconvex_polyhedra;
  j["folded_cells"] = i.folded_cells;
  j["nonmatching_faces"] = i.nonmatching_faces;
  j["inverted_cells"] = r.inverted;
  j["collapsed_cells"] = r.collapsed;
  j["degenerate_cells"] = r.degenerate;
  j["left_out_cells"] = r.left_out;
  j["lower_dimension_cells"] = r.lower_dimension;
  j["unsupported_cells"] = r.unsupported;
  j["quadratic_cells"] = r.quadratic;
  j["merged_points"] = r.merged_points;
  j["coincident_points"] = r.coincident_points;
  j["unused_points"] = r.unused_points;
  j["bounds"] = {{i.lower.x, i.lower.y, i.lower.z}, {i.upper.x, i.upper.y, i.upper.z}};
  j["volume"] = i.volume;
  j["arrays"] = arraysOf(source, mesh);
  j["times"] = source.times;
  j["step"] = source.step;
  j["sort"] = {{"auto", sort::name(sorter.algorithm())}, {"exact", sorter.exact()}, {"why", sorter.why()}};
  // Across gaps the native backend takes the quick order and puts it right (see render/session.h).
  const bool quick = sorter.algorithm() == sort::Algorithm::xmpvo;
  j["sort"]["native"] = quick ? sort::name(sort::Algorithm::mpvonc) : sort::name(sorter.algorithm());
  j["sort"]["road"] = quick ? "certificate" : "order";
  if (mesh.tetrahedral()) j["regularity"] = regularityOf(mesh);
  j["memory"] = {
      {"mesh_bytes", i.bytes},
      {"sorter_bytes", sorter.bytes()},
      {"bytes_per_cell", static_cast<double>(i.bytes + sorter.bytes()) / static_cast<double>(mesh.cell_count())},
      {"peak_rss_bytes", render::peakResidentBytes()}};
  return j;
}

void printLine(const char* label, const Json& value) {
  if (value.is_number_unsigned() && value == 0U) return;
  fmt::print("{:<20} {}\n", label, value.is_string() ? value.get<std::string>() : value.dump());
}

void print(const Json& j) {
  fmt::print("{}\n", j["file"].get<std::string>());
  std::string types;
  for (const auto& [type, count] : j["cells_by_type"].items()) {
    types += fmt::format("{}{} {}", types.empty() ? "" : ", ", count.get<std::size_t>(), type);
  }
  fmt::print("{:<20} {} ({})\n", "cells", j["cells"].get<std::size_t>(), types);
  printLine("points", j["points"]);
  fmt::print("{:<20} {}, {} exterior\n", "faces", j["faces"].get<std::size_t>(),
             j["exterior_faces"].get<std::size_t>());
  printLine("components", j["components"]);
  printLine("non-planar faces", j["nonplanar_faces"]);
  printLine("fanned polygons", j["fanned_faces"]);
  printLine("  not planar", j["nonplanar_fans"]);
  printLine("non-convex cells", j["nonconvex_cells"]);
  printLine("  polyhedra", j["nonconvex_polyhedra"]);
  printLine("folded cells", j["folded_cells"]);
  printLine("non-matching faces", j["nonmatching_faces"]);
  printLine("inverted cells", j["inverted_cells"]);
  printLine("collapsed cells", j["collapsed_cells"]);
  printLine("degenerate cells", j["degenerate_cells"]);
  printLine("left out (ghost)", j["left_out_cells"]);
  printLine("lower dimension", j["lower_dimension_cells"]);
  printLine("not supported", j["unsupported_cells"]);
  printLine("quadratic cells", j["quadratic_cells"]);
  printLine("merged points", j["merged_points"]);
  printLine("coincident points", j["coincident_points"]);
  printLine("unused points", j["unused_points"]);
  printLine("bounds", j["bounds"]);
  printLine("volume", j["volume"]);
  for (const Json& a : j["arrays"]) {
    fmt::print("{:<20} {} ({} component{}) {:.6g} .. {:.6g}{}\n", a["of"] == "points" ? "point array" : "cell array",
               a["name"].get<std::string>(), a["components"].get<int>(), a["components"] == 1 ? "" : "s, magnitude",
               a["range"][0].get<double>(), a["range"][1].get<double>(),
               a["cells_without_value"] == 0U
                   ? ""
                   : fmt::format(", {} cells without a value", a["cells_without_value"].get<std::size_t>()));
  }
  if (!j["times"].empty()) {
    fmt::print("{:<20} {}, from {} to {}; step {} is read\n", "time steps", j["times"].size(),
               j["times"].front().dump(), j["times"].back().dump(), j["step"].get<std::size_t>());
  }
  fmt::print("{:<20} {}{}: {}\n", "sort auto", j["sort"]["auto"].get<std::string>(),
             j["sort"]["exact"].get<bool>() ? ", exact" : "", j["sort"]["why"].get<std::string>());
  if (j["sort"]["road"] == "certificate") {
    fmt::print("{:<20} {}, wrong pixels found by the certificate and sorted again\n", "native backend",
               j["sort"]["native"].get<std::string>());
  }
  if (j.contains("regularity")) {
    const Json& r = j["regularity"];
    fmt::print("{:<20} {} (interior faces: {} locally regular, {} of one sphere, {} irregular)\n", "triangulation",
               r["verdict"].get<std::string>(), r["regular_faces"].get<std::size_t>(),
               r["tied_faces"].get<std::size_t>(), r["irregular_faces"].get<std::size_t>());
  }
  fmt::print("{:<20} {:.1f} MB, {:.0f} bytes per cell\n", "memory",
             (j["memory"]["mesh_bytes"].get<double>() + j["memory"]["sorter_bytes"].get<double>()) / 1e6,
             j["memory"]["bytes_per_cell"].get<double>());
}

int run(const InfoOptions& o) {
  const render::ThreadLimit limit(o.engine.threads);
  const mesh::Source source = readSource(o.common, o.field);
  mesh::BuildReport report;
  const mesh::Mesh mesh = mesh::build(source, &report);
  reportWarnings(report.warnings, o.common.strict);
  const auto sorter = sort::makeSorter(sort::Algorithm::automatic, mesh);
  const Json j = describe(source, mesh, report, *sorter);
  if (!o.json.empty()) {
    const std::string text = j.dump(2) + "\n";
    io::writeFile(o.json, text.data(), text.size());
  }
  print(j);
  return 0;
}

}  // namespace

Command addInfo(CLI::App& app) {
  auto* sub = app.add_subcommand("info", "tell what is in a mesh file");
  auto o = std::make_shared<InfoOptions>();
  addMesh(*sub, o->common);
  sub->add_option("--json", o->json, "write the same as JSON")->type_name("FILE");
  addThreads(*sub, o->engine);
  auto* step = sub->add_option("--step", o->field.step, "time step, from 0")->type_name("K");
  sub->add_option("--time", o->field.time, "time; the nearest step is read")->type_name("T")->excludes(step);
  sub->footer("Example:\n  spillikin info mesh.vtu --json mesh.json\n");
  return [o] { return run(*o); };
}

}  // namespace spillikin::cli
