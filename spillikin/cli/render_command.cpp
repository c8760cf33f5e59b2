#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "spillikin/cli/commands.h"
#include "spillikin/cli/explain.h"
#include "spillikin/cli/scene.h"
#include "spillikin/io/write_image.h"

namespace spillikin::cli {

namespace {

struct RenderOptions : SceneOptions {
  std::string image, stats;
};

int run(const RenderOptions& o) {
  if (listedFields(o)) return 0;
  const render::ThreadLimit limit(o.engine.threads);
  const std::string target =
      o.image.empty() ? std::filesystem::path(o.common.mesh).filename().replace_extension(".png").string() : o.image;
  io::checkImagePath(target);
  render::Session session = openSession(o);
  const std::size_t printed = reportWarnings(session.warnings(), o.common.strict);
  const Image image = session.draw();
  reportWarnings(session.warnings(), o.common.strict, printed);
  io::writeImage(target, image, o.look.background);
  if (!o.stats.empty()) {
    const std::string json = render::toJson(session.stats());
    io::writeFile(o.stats, json.data(), json.size());
  }
  if (o.common.pixel)
    fmt::print("{}", explainPixel(session, o.common.pixel->at(0), o.common.pixel->at(1), true, &image));
  return 0;
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
  addLook(*sub, o->look);
  addEngine(*sub, o->engine);
  sub->footer(
      "Examples:\n"
      "  spillikin render mesh.vtu\n"
      "  spillikin render mesh.vtu --field velocity --component 0 --range 0,2 --tf plasma -o u.png\n"
      "  spillikin render run.ex2 --step 12 --azimuth 40 --elevation 20 --clip 0,0,0,1,0,0 --stats run.json\n");
  return [o] { return run(*o); };
}

}  // namespace spillikin::cli
