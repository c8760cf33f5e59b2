#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "spillikin/cli/commands.h"
#include "spillikin/cli/scene.h"
#include "spillikin/io/write_image.h"
#include "spillikin/render/defaults.h"

namespace spillikin::cli {

namespace {

constexpr double degrees_per_frame = 4.0;

struct BenchOptions : SceneOptions {
  int frames = 10;
  std::string json;
};

struct Series {
  const char* label;
  std::vector<double> seconds;

  double median() const {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t n = sorted.size();
    return n % 2 == 1 ? sorted[n / 2] : 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]);
  }
  double min() const { return *std::min_element(seconds.begin(), seconds.end()); }
  double max() const { return *std::max_element(seconds.begin(), seconds.end()); }
};

double secondsOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int run(const BenchOptions& o) {
  if (listedFields(o)) return 0;
  const render::ThreadLimit limit(o.engine.threads);
  render::Session session = openSession(o);
  std::size_t printed = reportWarnings(session.warnings(), o.common.strict);
  const View first = session.view();
  Image image;
  session.draw(image);  // what is prepared once is not a frame
  printed = reportWarnings(session.warnings(), o.common.strict, printed);

  std::vector<Series> all{{"frame", {}}, {"sort", {}}, {"project", {}}, {"composite", {}}};
  for (int frame = 1; frame <= o.frames; ++frame) {
    View view = first;
    render::turnView(view, {degrees_per_frame * frame, 0.0, 1.0});
    all[0].seconds.push_back(secondsOf([&] {
      session.setView(view);
      session.draw(image);
    }));
    const render::Stats& stats = session.stats();
    all[1].seconds.push_back(stats.sort.seconds);
    all[2].seconds.push_back(stats.project.seconds);
    all[3].seconds.push_back(stats.composite.seconds);
  }
  reportWarnings(session.warnings(), o.common.strict, printed);

  // The tiers below the viewpoint, on the last one.
  const double scalar = secondsOf([&] {
    session.setField(o.field.name, componentNumber(o.field.component));
    session.draw(image);
  });
  const double look = secondsOf([&] {
    session.setTransferFunction(session.transferFunction().scaled(1.0));
    session.draw(image);
  });

  auto j = nlohmann::ordered_json::parse(render::toJson(session.stats()));
  j["frames"] = o.frames;
  for (const Series& s : all) {
    fmt::print("{:<10} median {:.4f} s, from {:.4f} to {:.4f}\n", s.label, s.median(), s.min(), s.max());
    j[fmt::format("{}_seconds_median", s.label)] = s.median();
    j[fmt::format("{}_seconds_min", s.label)] = s.min();
    j[fmt::format("{}_seconds_max", s.label)] = s.max();
  }
  fmt::print("{:<10} {:.4f} s a frame\n{:<10} {:.4f} s a frame\n", "new scalar", scalar, "new look", look);
  j["tiers"] = {{"topology_seconds", session.stats().build_seconds},
                {"geometry_seconds", session.stats().sort.prepare_seconds},
                {"viewpoint_seconds", all[0].median()},
                {"scalar_seconds", scalar},
                {"transfer_function_seconds", look}};
  if (!o.json.empty()) {
    const std::string text = j.dump(2) + "\n";
    io::writeFile(o.json, text.data(), text.size());
  }
  return 0;
}

}  // namespace

Command addBench(CLI::App& app) {
  auto* sub = app.add_subcommand("bench", "time frames, each from a new viewpoint");
  auto o = std::make_shared<BenchOptions>();
  addMesh(*sub, o->common);
  sub->add_option("--frames", o->frames, "frames, 4 degrees of azimuth apart (default 10)")
      ->type_name("N")
      ->check(CLI::Range(1, 100000));
  sub->add_option("--json", o->json, "write the times as JSON")->type_name("FILE");
  addView(*sub, o->view);
  addField(*sub, o->field);
  addLook(*sub, o->look);
  addEngine(*sub, o->engine);
  sub->footer("Example:\n  spillikin bench mesh.vtu --size 1024x1024 --frames 20 --json bench.json\n");
  return [o] { return run(*o); };
}

}  // namespace spillikin::cli
