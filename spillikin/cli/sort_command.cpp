#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "spillikin/cli/commands.h"
#include "spillikin/cli/explain.h"
#include "spillikin/cli/progress.h"
#include "spillikin/cli/scene.h"
#include "spillikin/cli/verify.h"
#include "spillikin/io/write_image.h"

namespace spillikin::cli {

namespace {

struct SortOptions : SceneOptions {
  std::string order, stats;
  bool verify = false;
};

// The file's cell ids, back to front: a cell that was cut, or drawn as tetrahedra, comes once per piece.
std::vector<std::int64_t> fileIds(render::Session& session) {
  const sort::Order& order = session.order();
  const mesh::Mesh& mesh = session.drawnMesh();
  std::vector<std::int64_t> ids(order.cells.size());
  for (std::size_t i = 0; i < ids.size(); ++i)
    ids[i] = mesh.cell_file_id[order.cells[i]];
  return ids;
}

// The file's id of a cell that is drawn.
std::uint64_t fileId(render::Session& session, mesh::Id cell) {
  return session.drawnMesh().cell_file_id[cell];
}

std::string statistics(render::Session& session, const sort::Tally* proof) {
  session.order();
  auto j = nlohmann::ordered_json::parse(render::toJson(session.stats()));
  j.erase("project");
  j.erase("composite");
  j.erase("certificate");
  if (proof != nullptr) {
    auto& v = j["verify"];
    v = {{"rays", proof->rays},
         {"pairs", proof->pairs},
         {"inversions", proof->inversions},
         {"contested", proof->contested},
         {"overlaps", proof->overlaps}};
    v["worst"] = nlohmann::ordered_json::array();
    for (const sort::Inversion& i : proof->worst) {
      v["worst"].push_back({{"pixel", {i.x, i.y}},
                            {"front_cell", fileId(session, i.front)},
                            {"back_cell", fileId(session, i.back)},
                            {"depth", i.depth}});
    }
  }
  return j.dump(2) + "\n";
}

void printProof(render::Session& session, const sort::Tally& proof) {
  fmt::print("verified {} rays, {} pairs: {} inversions\n", proof.rays, proof.pairs, proof.inversions);
  for (const sort::Inversion& i : proof.worst) {
    fmt::print("  pixel {},{}: cell {} is drawn over cell {}, which lies {:.6g} in front of it\n", i.x, i.y,
               fileId(session, i.back), fileId(session, i.front), i.depth);
  }
  if (proof.overlaps == 0) return;
  fmt::print(
      "  {} overlaps of cells on a ray, where no order is right; {} pairs that overlap are drawn the nearer first\n",
      proof.overlaps, proof.contested);
  for (const auto& o : proof.first_overlaps) {
    fmt::print("  pixel {},{}: cells {} and {} overlap\n", o.x, o.y, fileId(session, o.cells[0]),
               fileId(session, o.cells[1]));
  }
}

int run(const SortOptions& o) {
  const render::ThreadLimit limit(o.engine.threads);
  render::Session session = openSession(o);
  reportWarnings(session.warnings(), o.common.strict);
  const sort::Order& order = session.order();
  const render::Stats& stats = session.stats();
  fmt::print("{} entries by {} in {:.4f} s after {:.4f} s of preparation, {:.1f} million cells/s\n", order.cells.size(),
             stats.sort.algorithm, stats.sort.seconds, stats.sort.prepare_seconds, stats.sort.cells_per_second / 1e6);
  fmt::print("{}: {}\n", order.exact ? "exact" : "not proven exact", stats.sort.why);
  if (order.problems.cells > 0) {
    fmt::print("{} problem faces, through which a ray leaves a cell and enters it again; {} problem cells\n",
               order.problems.faces, order.problems.cells);
  }
  if (!order.cuts.empty()) fmt::print("{} cells are listed in pieces\n", stats.sort.subdivided_cells);
  for (std::size_t i = 0; i < order.cycles.size() && i < 5; ++i) {
    fmt::print("cycle of {} cells, among them {}\n", order.cycles[i].size(),
               session.drawnMesh().cell_file_id[order.cycles[i].front()]);
  }
  if (!o.order.empty()) io::writeNpy(o.order, fileIds(session));
  sort::Tally proof;
  if (o.verify) {
    Progress progress("verifying");
    proof = verify(session, progress.callback());
    printProof(session, proof);
  }
  if (!o.stats.empty()) {
    const std::string json = statistics(session, o.verify ? &proof : nullptr);
    io::writeFile(o.stats, json.data(), json.size());
  }
  if (o.common.pixel) fmt::print("{}", explainPixel(session, o.common.pixel->at(0), o.common.pixel->at(1), true));
  return 0;
}

}  // namespace

Command addSort(CLI::App& app) {
  auto* sub = app.add_subcommand("sort", "put the cells of a mesh in visibility order");
  auto o = std::make_shared<SortOptions>();
  addMesh(*sub, o->common);
  sub->add_flag("--verify", o->verify, "prove the order: on every pixel's ray the cells must come by distance");
  sub->add_option("--order", o->order, "write the file's cell ids, back to front, as int64")->type_name("FILE.npy");
  sub->add_option("--stats", o->stats, "write what was done and how long it took, as JSON")->type_name("FILE");
  addPixel(*sub, o->common);
  addView(*sub, o->view);
  addField(*sub, o->field);
  addEngine(*sub, o->engine);
  sub->footer("Example:\n  spillikin sort mesh.vtu --sort bsp-xmpvo --azimuth 30 --verify --order order.npy\n");
  return [o] { return run(*o); };
}

}  // namespace spillikin::cli
