#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "spillikin/base/error.h"
#include "spillikin/cli/commands.h"
#include "spillikin/cli/explain.h"
#include "spillikin/cli/progress.h"
#include "spillikin/cli/scene.h"
#include "spillikin/io/write_image.h"
#include "spillikin/reference/flat_face_cost.h"
#include "spillikin/reference/reference.h"

namespace spillikin::cli {

namespace {

struct ReferenceOptions : SceneOptions {
  std::string image, stats, model = "face", cell_costs;
  int samples = 1;
  bool quadrature = false;
};

mesh::FieldModel modelNamed(const std::string& text) {
  if (text == "tets") return mesh::FieldModel::tets;
  return text == "isoparametric" ? mesh::FieldModel::isoparametric : mesh::FieldModel::face;
}

void reportRays(const reference::Report& report, const mesh::Mesh& mesh, bool strict) {
  std::vector<std::string> warnings;
  if (report.overlaps > 0) {
    std::string line =
        fmt::format("{}: cells overlap on {} of the ray intervals, for example", mesh.name, report.overlaps);
    for (std::size_t i = 0; i < report.overlapping.size() && i < 3; ++i) {
      const auto& at = report.overlapping_at[i];
      line += fmt::format("{} cells {} and {} at pixel {:.0f},{:.0f}", i == 0 ? "" : ",",
                          mesh.cell_file_id[report.overlapping[i][0]], mesh.cell_file_id[report.overlapping[i][1]],
                          std::floor(at[0]), std::floor(at[1]));
    }
    warnings.push_back(line);
  }
  if (report.gaps > 0) {
    warnings.push_back(fmt::format("{}: {} gaps at faces that two cells share", mesh.name, report.gaps));
  }
  reportWarnings(warnings, strict);
}

// A line for each cell that the view's rays meet.
void writeCellCosts(const std::string& path, const reference::RayCaster& caster, const render::Session& session) {
  const mesh::Mesh& mesh = session.mesh();
  std::string text = "cell,type,rays,length_face,length_isoparametric,worst_length,worst_scalar\n";
  const auto costs = reference::flatFaceCost(caster, session.view(), mesh.cell_count());
  for (std::size_t cell = 0; cell < costs.size(); ++cell) {
    const auto& c = costs[cell];
    if (c.rays == 0) continue;
    text += fmt::format("{},{},{},{},{},{},{}\n", mesh.cell_file_id[cell], mesh::name(mesh.cell_type[cell]), c.rays,
                        c.length_face, c.length_curved, c.worst_length, c.worst_scalar);
  }
  io::writeFile(path, text.data(), text.size());
}

int run(const ReferenceOptions& o) {
  if (listedFields(o)) return 0;
  const render::ThreadLimit limit(o.engine.threads);
  const std::string target =
      o.image.empty() ? std::filesystem::path(o.common.mesh).filename().replace_extension(".png").string() : o.image;
  checkTarget(target);
  render::Session session = openSession(o);
  reportWarnings(session.warnings(), o.common.strict);

  Progress progress("casting rays");
  reference::Options options;
  options.model = modelNamed(o.model);
  options.samples = o.samples;
  options.optics = session.optics();
  options.quadrature = o.quadrature;
  options.progress = progress.callback();
  reference::Report report;
  const reference::RayCaster caster(session.mesh(), session.field());
  const Image image = caster.render(session.view(), session.transferFunction(), options, &report);
  reportRays(report, session.mesh(), o.common.strict);
  io::writeImage(target, image, o.look.background);
  if (!o.cell_costs.empty()) writeCellCosts(o.cell_costs, caster, session);
  if (o.common.pixel)
    fmt::print("{}", explainPixel(session, o.common.pixel->at(0), o.common.pixel->at(1), false, &image, options.model));
  return 0;
}

}  // namespace

Command addReference(CLI::App& app) {
  auto* sub = app.add_subcommand("reference", "draw a mesh by casting rays in double precision: the ground truth");
  auto o = std::make_shared<ReferenceOptions>();
  addMesh(*sub, o->common);
  sub->add_option("-o,--output", o->image,
                  "image to write: .png, .exr or .npy (default: the mesh's name with .png, here)")
      ->type_name("IMAGE");
  sub->add_option("--model", o->model, "the function inside a cell (default face)")
      ->check(CLI::IsMember({"tets", "face", "isoparametric"}));
  sub->add_option("--samples", o->samples, "rays per pixel, stratified (default 1, at the centre)")
      ->type_name("N")
      ->check(CLI::Range(1, 65536));
  sub->add_flag("--quadrature", o->quadrature, "adaptive quadrature instead of the closed form");
  sub->add_option("--cell-costs", o->cell_costs,
                  "write what flat faces cost, cell by cell: lengths and scalars on the view's rays, face against "
                  "isoparametric")
      ->type_name("FILE.csv")
      ->check([](const std::string& path) { return path.ends_with(".csv") ? "" : "name a .csv file"; });
  addPixel(*sub, o->common);
  addView(*sub, o->view);
  addField(*sub, o->field);
  addLook(*sub, o->look);
  addThreads(*sub, o->engine);
  sub->footer("Example:\n  spillikin reference mesh.vtu --size 256x256 -o truth.exr\n");
  return [o] { return run(*o); };
}

}  // namespace spillikin::cli
