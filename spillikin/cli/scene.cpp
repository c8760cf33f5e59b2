#include "spillikin/cli/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <limits>
#include <string_view>

#include "spillikin/base/error.h"
#include "spillikin/cli/progress.h"
#include "spillikin/integrate/optics.h"
#include "spillikin/io/read.h"
#include "spillikin/io/read_colormap.h"
#include "spillikin/io/write_image.h"
#include "spillikin/mesh/refit.h"
#include "spillikin/project/camera.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/memory.h"

namespace spillikin::cli {

namespace {

bool isPreset(const std::string& text) {
  const auto names = integrate::presetNames();
  return std::find(names.begin(), names.end(), text) != names.end();
}

integrate::TransferFunction coloured(const LookOptions& o, const render::Session& session) {
  const mesh::Field& field = session.field();
  if (o.tf.empty() || isPreset(o.tf)) {
    const std::array<double, 2> range = o.range.value_or(std::array<double, 2>{field.lo, field.hi});
    const auto tf = integrate::preset(o.tf.empty() ? integrate::default_preset : o.tf).mapped(range[0], range[1]);
    return tf.scaled(o.opacity * render::extinctionFactor(session.mesh(), field, tf));
  }
  if (o.tf.find_first_of("./") == std::string::npos) (void)integrate::preset(o.tf);  // its message lists the presets
  const render::Box box = render::boundingBox(session.mesh());
  // ParaView's opacities are per unit distance, by default the box's diagonal over the cube root of the cell count.
  const double unit = glm::length(box.upper - box.lower) / std::cbrt(static_cast<double>(session.mesh().cell_count()));
  auto tf = io::readTransferFunction(o.tf, unit > 0.0 ? unit : 1.0);
  if (o.range) {
    auto points = tf.points();
    const double lo = points.front().value;
    const double hi = points.back().value;
    for (auto& p : points) {
      p.value =
          hi > lo ? o.range->at(0) + (p.value - lo) / (hi - lo) * (o.range->at(1) - o.range->at(0)) : o.range->at(0);
    }
    tf = integrate::TransferFunction(std::move(points));
  }
  return tf.scaled(o.opacity);
}

}  // namespace

int componentNumber(const std::string& text) {
  if (text == "mag") return mesh::magnitude;
  int number = -1;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || stop != text.data() + text.size() || number < 0) {
    throw CLI::ValidationError(fmt::format("--component: '{}' should be mag, 0, 1, 2, ...", text));
  }
  return number;
}

View makeView(const ViewOptions& o, const render::Box& box) {
  View view;
  view.width = o.size[0];
  view.height = o.size[1];
  view.view_angle = o.view_angle;
  if (o.parallel_scale) {
    if (!(*o.parallel_scale > 0.0)) {
      throw CLI::ValidationError(fmt::format("--parallel-scale: {} should be above 0", *o.parallel_scale));
    }
    view.parallel_scale = *o.parallel_scale;
  }
  if (view.width > 0 && view.height > 0 && view.view_angle > 0.0 && view.view_angle < 180.0) {
    render::placeEye(view, box, {});
  }
  if (o.target) {
    view.eye += *o.target - view.target;
    view.target = *o.target;
  }
  if (o.eye) view.eye = *o.eye;
  if (o.up) view.up = *o.up;
  render::turnView(view, {o.azimuth, o.elevation, o.zoom});
  view.clips = o.clips;
  return view;
}

namespace {

// "DISPL" or "DISPL,10".
void applyWarp(mesh::Source& source, const std::string& text) {
  if (text.empty()) return;
  const std::size_t comma = text.rfind(',');
  double scale = 1.0;
  std::string name = text;
  if (comma != std::string::npos) {
    const char* last = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + comma + 1, last, scale);
    if (error != std::errc() || stop != last || !std::isfinite(scale)) {
      throw CLI::ValidationError(fmt::format("--warp: '{}' should be NAME or NAME,scale", text));
    }
    name = text.substr(0, comma);
  }
  mesh::warp(source, name, scale);
}

// Reads with a progress bar, moves the points as --warp says, and tells how long it took.
mesh::Source timedRead(const std::string& path, io::ReadOptions options, const std::string& warp, double* seconds) {
  const auto start = std::chrono::steady_clock::now();
  Progress progress("reading");
  options.progress = progress.callback();
  mesh::Source source = io::readMesh(path, options);
  applyWarp(source, warp);
  if (seconds != nullptr) *seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return source;
}

}  // namespace

mesh::Source readStep(const SeriesStep& step, const FieldOptions& field, double* seconds) {
  io::ReadOptions options;
  options.step = step.step;
  return timedRead(step.path, options, field.warp, seconds);
}

mesh::Source readSource(const CommonOptions& common, const FieldOptions& field, double* seconds) {
  if (isPattern(common.mesh)) {
    const auto series = openSeries(common.mesh);
    return readStep(series[chooseStep(series, field, common.mesh)], field, seconds);
  }
  io::ReadOptions options;
  options.step = field.step;
  options.time = field.time;
  return timedRead(common.mesh, options, field.warp, seconds);
}

std::size_t reportWarnings(const std::vector<std::string>& warnings, bool strict, std::size_t printed) {
  for (std::size_t i = printed; i < warnings.size(); ++i) {
    if (strict) throw Error(warnings[i] + " (an error because of --strict)");
    fmt::print(stderr, "spillikin: warning: {}\n", warnings[i]);
  }
  return warnings.size();
}

View checkedView(const ViewOptions& o, const render::Box& box) {
  View view = makeView(o, box);
  try {
    const project::Camera camera(view);
  } catch (const Error& e) {
    throw CLI::ValidationError(e.what());
  }
  return view;
}

void checkTarget(const std::string& image) {
  if (!io::knownImageSuffix(image)) {
    throw CLI::ValidationError(fmt::format("-o: {}: images are written as .png, .exr or .npy", image));
  }
  io::checkImagePath(image);
}

void checkArguments(const SceneOptions& o) {
  componentNumber(o.field.component);
  // What is wrong with the view whatever the mesh is said before the mesh is read.
  if (!o.view.eye && !o.view.target) checkedView(o.view, {{-1, -1, -1}, {1, 1, 1}});
  View size;
  size.width = o.view.size[0];
  size.height = o.view.size[1];
  render::requireImageMemory(size, render::availableBytes());
}

render::Session openSession(const SceneOptions& o) {
  checkArguments(o);
  double load_seconds = 0.0;
  mesh::Source source = readSource(o.common, o.field, &load_seconds);
  return openSession(o, std::move(source), load_seconds);
}

render::Session openSession(const SceneOptions& o, mesh::Source source, double load_seconds,
                            const std::optional<std::array<double, 2>>& range) {
  render::Engine engine;
  engine.sort = sort::algorithm(o.engine.sort);
  engine.walking = composite::walking(o.engine.walk);
  engine.projection = render::projection(o.engine.project);
  engine.integration = composite::integration(o.engine.integrate);
  engine.backend = composite::backend(o.engine.backend);
  render::Session session(std::move(source), engine);
  session.setLoadSeconds(load_seconds);
  session.setField(o.field.name, componentNumber(o.field.component));
  session.setView(checkedView(o.view, render::boundingBox(session.mesh())));
  LookOptions chosen = o.look;
  if (!chosen.range && range && (chosen.tf.empty() || isPreset(chosen.tf))) chosen.range = range;
  session.setTransferFunction(coloured(chosen, session));
  session.setOptics(integrate::optics(o.look.optics));
  return session;
}

std::string listFields(const mesh::Source& source) {
  std::string text;
  for (const mesh::Array& a : source.arrays) {
    double lo = std::numeric_limits<double>::infinity();
    double hi = -lo;
    std::size_t bad = 0;
    for (const double v : a.values) {
      if (!std::isfinite(v)) {
        ++bad;
        continue;
      }
      lo = std::min(lo, v);
      hi = std::max(hi, v);
    }
    text += fmt::format("{:<24} {:<5} {} component{}  {}{}\n", a.name,
                        a.association == mesh::Association::points ? "point" : "cell", a.components,
                        a.components == 1 ? " " : "s",
                        lo <= hi ? fmt::format("{:.6g} .. {:.6g}", lo, hi) : "no finite value",
                        bad > 0 ? fmt::format("  ({} not finite)", bad) : "");
  }
  return text;
}

bool listedFields(const SceneOptions& o) {
  if (!o.field.list) return false;
  fmt::print("{}", listFields(readSource(o.common, o.field)));
  return true;
}

}  // namespace spillikin::cli
