#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <memory>
#include <optional>

#include "spillikin/base/error.h"
#include "spillikin/cli/commands.h"
#include "spillikin/cli/explain.h"
#include "spillikin/cli/progress.h"
#include "spillikin/cli/scene.h"
#include "spillikin/cli/series.h"
#include "spillikin/io/write_image.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/refit.h"

namespace spillikin::cli {

namespace {

struct RenderOptions : SceneOptions {
  std::string image, stats, steps;
};

void writeStats(const std::string& path, const render::Stats& stats) {
  if (path.empty()) return;
  const std::string json = render::toJson(stats);
  io::writeFile(path, json.data(), json.size());
}

int renderOne(const RenderOptions& o) {
  const std::string target = o.image.empty() ? std::filesystem::path(o.common.mesh).stem().string() + ".png" : o.image;
  checkTarget(target);
  render::Session session = openSession(o);
  const std::size_t printed = reportWarnings(session.warnings(), o.common.strict);
  const Image image = session.draw();
  reportWarnings(session.warnings(), o.common.strict, printed);
  io::writeImage(target, image, o.look.background);
  writeStats(o.stats, session.stats());
  if (o.common.pixel)
    fmt::print("{}", explainPixel(session, o.common.pixel->at(0), o.common.pixel->at(1), true, &image));
  return 0;
}

// The range of the field over all steps that are drawn, one step in memory at a time.
std::array<double, 2> rangeOverSteps(const RenderOptions& o, const std::vector<SeriesStep>& steps) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::array<double, 2> range{infinity, -infinity};
  Progress progress("range over all steps");
  const auto report = progress.callback();
  mesh::Mesh mesh;
  std::uint64_t topology = 0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const mesh::Source source = readStep(steps[k], o.field);
    const std::uint64_t fingerprint = mesh::topologyFingerprint(source);
    if (mesh.cell_count() == 0 || fingerprint != topology) mesh = mesh::build(source);
    topology = fingerprint;
    const mesh::Field field = mesh::selectField(source, mesh, o.field.name, componentNumber(o.field.component));
    range = {std::min(range[0], field.lo), std::max(range[1], field.hi)};
    if (report) report(static_cast<double>(k + 1) / static_cast<double>(steps.size()));
  }
  return range;
}

int renderSeries(const RenderOptions& o) {
  checkArguments(o);
  const std::vector<SeriesStep> series = openSeries(o.common.mesh);
  const std::vector<std::size_t> chosen = chosenSteps(o.steps, series.size());
  const std::string pattern = o.image.empty() ? "frame_%04d.png" : o.image;
  checkTarget(numberedPath(pattern, 0));
  std::vector<SeriesStep> steps;
  steps.reserve(chosen.size());
  for (const std::size_t k : chosen)
    steps.push_back(series[k]);
  std::optional<std::array<double, 2>> range;
  const bool file_look = o.look.tf.find_first_of("./") != std::string::npos;
  if (!o.look.range && !file_look) range = rangeOverSteps(o, steps);

  Progress progress("rendering");
  const auto report = progress.callback();
  std::optional<render::Session> session;
  std::vector<std::string> said;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    double load_seconds = 0.0;
    mesh::Source source = readStep(steps[k], o.field, &load_seconds);
    try {
      if (!session) {
        session.emplace(openSession(o, std::move(source), load_seconds, range));
      } else {
        session->setSource(std::move(source));
        session->setLoadSeconds(load_seconds);
        session->setField(o.field.name, componentNumber(o.field.component));
      }
      const Image image = session->draw();
      io::writeImage(numberedPath(pattern, chosen[k]), image, o.look.background);
    } catch (const Error& e) {
      throw Error(fmt::format("{} (at step {})", e.what(), chosen[k]));
    }
    if (k == 0 || session->warnings() != said) reportWarnings(session->warnings(), o.common.strict);
    said = session->warnings();
    if (report) report(static_cast<double>(k + 1) / static_cast<double>(steps.size()));
  }
  writeStats(o.stats, session->stats());
  return 0;
}

int run(const RenderOptions& o) {
  if (listedFields(o)) return 0;
  const render::ThreadLimit limit(o.engine.threads);
  return o.steps.empty() ? renderOne(o) : renderSeries(o);
}

}  // namespace

Command addRender(CLI::App& app) {
  auto* sub = app.add_subcommand("render", "draw a mesh");
  auto o = std::make_shared<RenderOptions>();
  addMesh(*sub, o->common);
  sub->add_option("-o,--output", o->image,
                  "image to write: .png, .exr or .npy (default: the mesh's name with .png, here)")
      ->type_name("IMAGE");
  sub->add_option("--stats", o->stats, "write what was done and how long it took, as JSON")->type_name("FILE");
  addPixel(*sub, o->common);
  addView(*sub, o->view);
  addField(*sub, o->field);
  sub->add_option("--steps", o->steps,
                  "draw the steps from a to b, every c-th; -o names the frames with %04d for the step")
      ->type_name("a:b:c")
      ->group("Field");
  addLook(*sub, o->look);
  addEngine(*sub, o->engine);
  sub->footer(
      "Examples:\n"
      "  spillikin render mesh.vtu\n"
      "  spillikin render mesh.vtu --field velocity --component 0 --range 0,2 --tf plasma -o u.png\n"
      "  spillikin render run.ex2 --step 12 --azimuth 40 --elevation 20 --clip 0,0,0,1,0,0 --stats run.json\n"
      "  spillikin render crash.ex2 --warp DISPL,10 --steps 0:40:2 -o frame_%04d.png\n"
      "  spillikin render 'plate_*.vtu' --steps :: -o plate_%03d.png\n");
  return [o] { return run(*o); };
}

}  // namespace spillikin::cli
