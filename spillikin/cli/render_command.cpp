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

// Does the work of one step; an error of it says which step it was.
template <class Work>
auto atStep(std::size_t step, const Work& work) {
  try {
    return work();
  } catch (const Error& e) {
    throw Error(fmt::format("{} (at step {})", e.what(), step));
  }
}

// Without --field the first array is drawn, which must be the same one in every step.
void expectSameField(const std::string& first, const std::string& now) {
  if (first == now) return;
  throw Error(fmt::format("the first array is '{}', in the first step it is '{}'; say which with --field", now, first));
}

// The steps of a series that are drawn, one after the other. What was read for the range is kept for the picture while
// it is small, so that short series are read once; of long ones no more than a step is held.
class Steps {
 public:
  Steps(const RenderOptions& options, const std::vector<SeriesStep>& series, std::vector<std::size_t> chosen)
      : options_(options), series_(series), chosen_(std::move(chosen)), kept_(chosen_.size()) {}

  std::size_t size() const { return chosen_.size(); }
  std::size_t number(std::size_t k) const { return chosen_[k]; }

  struct Read {
    mesh::Source source;
    double seconds = 0.0;
  };
  Read take(std::size_t k) {
    if (kept_[k]) {
      Read read = std::move(*kept_[k]);
      kept_[k].reset();
      return read;
    }
    Read read;
    read.source = readStep(series_[chosen_[k]], options_.field, &read.seconds);
    return read;
  }

  // The range of the field over all steps.
  std::array<double, 2> range() {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::array<double, 2> range{infinity, -infinity};
    Progress progress("range over all steps");
    const auto report = progress.callback();
    for (std::size_t k = 0; k < size(); ++k) {
      atStep(number(k), [&] { widen(range, k); });
      if (report) report(static_cast<double>(k + 1) / static_cast<double>(size()));
    }
    mesh_ = {};
    return range[0] <= range[1] ? range : std::array<double, 2>{0.0, 0.0};
  }

 private:
  static constexpr std::size_t most_kept_bytes = std::size_t{256} << 20U;

  void widen(std::array<double, 2>& range, std::size_t k) {
    Read read = take(k);
    const std::uint64_t fingerprint = mesh::topologyFingerprint(read.source);
    const bool same = mesh_.cell_count() > 0 && fingerprint == topology_;
    if (!same || !mesh::refit(mesh_, report_, read.source)) mesh_ = mesh::build(read.source, &report_);
    topology_ = fingerprint;
    const mesh::Field field =
        mesh::selectField(read.source, mesh_, options_.field.name, componentNumber(options_.field.component));
    if (k == 0) field_ = field.name;
    if (options_.field.name.empty()) expectSameField(field_, field.name);
    if (field.hidden_count < mesh_.cell_count()) {
      range = {std::min(range[0], field.lo), std::max(range[1], field.hi)};
    }
    kept_bytes_ += bytes(read.source);
    if (kept_bytes_ <= most_kept_bytes) kept_[k] = std::move(read);
  }

  static std::size_t bytes(const mesh::Source& source) {
    std::size_t sum = source.points.size() * sizeof(Vec3) + source.types.size() * sizeof(std::uint8_t) +
                      source.offsets.size() * sizeof(std::uint64_t) +
                      source.connectivity.size() * sizeof(std::uint32_t);
    for (const mesh::Array& array : source.arrays)
      sum += array.values.size() * sizeof(double);
    return sum;
  }

  const RenderOptions& options_;
  const std::vector<SeriesStep>& series_;
  std::vector<std::size_t> chosen_;
  std::vector<std::optional<Read>> kept_;
  std::size_t kept_bytes_ = 0;
  mesh::Mesh mesh_;
  mesh::BuildReport report_;
  std::uint64_t topology_ = 0;
  std::string field_;
};

// Warnings of one step, with its number; those of the step before are not said again.
void reportStep(const render::Session& session, std::size_t step, bool strict, std::vector<std::string>& said) {
  if (session.warnings() == said) return;
  said = session.warnings();
  std::vector<std::string> lines;
  lines.reserve(said.size());
  for (const std::string& line : said)
    lines.push_back(fmt::format("{} (at step {})", line, step));
  reportWarnings(lines, strict);
}

int renderSeries(const RenderOptions& o) {
  checkArguments(o);
  const std::vector<SeriesStep> series = openSeries(o.common.mesh);
  Steps steps(o, series, chosenSteps(o.steps, series.size()));
  const std::string pattern = o.image.empty() ? "frame_%04d.png" : o.image;
  checkTarget(numberedPath(pattern, 0));
  std::optional<std::array<double, 2>> range;
  const bool file_look = o.look.tf.find_first_of("./") != std::string::npos;
  if (!o.look.range && !file_look && steps.size() > 1) range = steps.range();

  Progress progress("rendering");
  const auto report = progress.callback();
  std::optional<render::Session> session;
  std::string field;
  std::vector<std::string> said;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    atStep(steps.number(k), [&] {
      Steps::Read read = steps.take(k);
      if (!session) {
        session.emplace(openSession(o, std::move(read.source), read.seconds, range));
        field = session->field().name;
      } else {
        session->setSource(std::move(read.source));
        session->setLoadSeconds(read.seconds);
        session->setField(o.field.name, componentNumber(o.field.component));
      }
      if (o.field.name.empty()) expectSameField(field, session->field().name);
      const Image image = session->draw();
      io::writeImage(numberedPath(pattern, steps.number(k)), image, o.look.background);
    });
    reportStep(*session, steps.number(k), o.common.strict, said);
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
