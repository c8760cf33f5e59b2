#include "spillikin/cli/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <string_view>

#include "spillikin/integrate/transfer_function.h"

namespace spillikin::cli {

namespace {

// Numbers between separators, all of them finite; anything else is an error in the arguments.
std::vector<double> numbers(const std::string& text, char separator, const std::string& what) {
  std::vector<double> values;
  std::string_view rest = text;
  while (true) {
    const std::size_t end = std::min(rest.find(separator), rest.size());
    double value = 0.0;
    const char* last = rest.data() + end;
    const auto [stop, error] = std::from_chars(rest.data(), last, value);
    if (error != std::errc() || stop != last || !std::isfinite(value)) {
      throw CLI::ValidationError(fmt::format("{}: '{}' is not a list of numbers", what, text));
    }
    values.push_back(value);
    if (end == rest.size()) return values;
    rest.remove_prefix(end + 1);
  }
}

std::vector<double> numbers(const std::string& text, std::size_t count, const std::string& what, const char* form) {
  auto values = numbers(text, ',', what);
  if (values.size() != count) throw CLI::ValidationError(fmt::format("{}: '{}' should be {}", what, text, form));
  return values;
}

void addVector(CLI::App& app, const char* flag, std::optional<Vec3>& target, const char* help) {
  app.add_option_function<std::string>(
         flag,
         [flag, &target](const std::string& text) {
           const auto v = numbers(text, 3, flag, "x,y,z");
           target = Vec3(v[0], v[1], v[2]);
         },
         help)
      ->type_name("x,y,z")
      ->group("View");
}

std::array<int, 2> twoInts(const std::string& text, char separator, const char* flag, const char* form) {
  const auto v = numbers(text, separator, flag);
  if (v.size() != 2 || v[0] != std::floor(v[0]) || v[1] != std::floor(v[1]) || std::abs(v[0]) > 1e9 ||
      std::abs(v[1]) > 1e9) {
    throw CLI::ValidationError(fmt::format("{}: '{}' should be {}", flag, text, form));
  }
  return {static_cast<int>(v[0]), static_cast<int>(v[1])};
}

}  // namespace

void addView(CLI::App& app, ViewOptions& o) {
  const char* group = "View";
  app.add_option_function<std::string>(
         "--size",
         [&o](const std::string& text) { o.size = twoInts(text, 'x', "--size", "WxH, for example 1024x768"); },
         "image size in pixels (default 1024x768)")
      ->type_name("WxH")
      ->group(group);
  addVector(app, "--eye", o.eye, "where the viewer is");
  addVector(app, "--target", o.target, "what the viewer looks at");
  addVector(app, "--up", o.up, "the direction towards the top of the image");
  app.add_option("--view-angle", o.view_angle, "full vertical angle in degrees (default 30)")
      ->type_name("DEG")
      ->group(group);
  app.add_option("--parallel-scale", o.parallel_scale, "parallel projection: half the view's height in world units")
      ->type_name("H")
      ->group(group);
  app.add_option("--azimuth", o.azimuth, "turn about the up direction")->type_name("DEG")->group(group);
  app.add_option("--elevation", o.elevation, "turn about the horizontal axis")->type_name("DEG")->group(group);
  app.add_option("--zoom", o.zoom, "enlarge by this factor")->type_name("F")->group(group)->check(CLI::PositiveNumber);
  app.add_option_function<std::vector<std::string>>(
         "--clip",
         [&o](const std::vector<std::string>& texts) {
           for (const std::string& text : texts) {
             const auto v = numbers(text, 6, "--clip", "x,y,z,nx,ny,nz");
             o.clips.push_back({Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5])});
           }
         },
         "keep the side of the plane that the normal points to; repeatable")
      ->type_name("x,y,z,nx,ny,nz")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(group);
}

void addField(CLI::App& app, FieldOptions& o) {
  const char* group = "Field";
  app.add_option("--field", o.name, "point or cell array (default: the first point scalar, else the first cell scalar)")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--component", o.component, "of a vector array: mag, 0, 1, 2, ... (default mag)")
      ->type_name("C")
      ->group(group);
  auto* step = app.add_option("--step", o.step, "time step, from 0")->type_name("K")->group(group);
  app.add_option("--time", o.time, "time; the nearest step is read")->type_name("T")->group(group)->excludes(step);
  app.add_option("--warp", o.warp, "move the points by a vector array, times a scale (default 1)")
      ->type_name("NAME[,scale]")
      ->group(group);
  app.add_flag("--list-fields", o.list, "list the arrays of the file and stop")->group(group);
}

void addLook(CLI::App& app, LookOptions& o) {
  const char* group = "Look";
  app.add_option("--tf", o.tf,
                 fmt::format("transfer function: a JSON file or one of {} (default {})",
                             fmt::join(integrate::presetNames(), ", "), integrate::default_preset))
      ->type_name("PRESET|FILE")
      ->group(group);
  app.add_option_function<std::string>(
         "--range",
         [&o](const std::string& text) {
           const auto v = numbers(text, 2, "--range", "lo,hi");
           if (!(v[0] < v[1])) throw CLI::ValidationError(fmt::format("--range: '{}' should ascend", text));
           o.range = {v[0], v[1]};
         },
         "scalar values that the transfer function spans (default: the field's; a file's: its own)")
      ->type_name("lo,hi")
      ->group(group);
  app.add_option("--opacity", o.opacity, "scales extinction (default 1)")
      ->type_name("F")
      ->group(group)
      ->check(CLI::NonNegativeNumber);
  app.add_option("--optics", o.optics, "what a ray gathers (default absorption-emission)")
      ->group(group)
      ->check(CLI::IsMember({"absorption-emission", "emission", "absorption", "mip", "xray"}));
  app.add_option_function<std::string>(
         "--background",
         [&o](const std::string& text) {
           auto v = numbers(text, ',', "--background");
           if (v.size() == 3) v.push_back(1.0);
           for (const double c : v) {
             if (v.size() != 4 || c < 0.0 || c > 1.0) {
               throw CLI::ValidationError(
                   fmt::format("--background: '{}' should be R,G,B[,A] with values from 0 to 1", text));
             }
           }
           o.background = {v[0], v[1], v[2], v[3]};
         },
         "colour behind the volume, in [0,1] (default 0,0,0,1)")
      ->type_name("R,G,B[,A]")
      ->group(group);
}

void addThreads(CLI::App& app, EngineOptions& o) {
  app.add_option("--threads", o.threads, "threads to use (default: all cores)")
      ->type_name("N")
      ->group("Engine")
      ->check(CLI::Range(0, 4096));
}

void addEngine(CLI::App& app, EngineOptions& o) {
  const char* group = "Engine";
  app.add_option("--sort", o.sort, "visibility order (default auto: the cheapest that is exact)")
      ->group(group)
      ->check(CLI::IsMember(
          {"auto", "mpvo", "mpvonc", "xmpvo", "bsp-xmpvo", "power", "newell", "convexified", "centroid", "none"}));
  app.add_option("--walk", o.walk, "rays walk through tetrahedra, without an order (default auto: where it is quicker)")
      ->group(group)
      ->check(CLI::IsMember({"auto", "never", "always"}));
  app.add_option("--project", o.project, "whole cells (zoo) or their tetrahedra (default auto)")
      ->group(group)
      ->check(CLI::IsMember({"auto", "zoo", "tets"}));
  app.add_option("--integrate", o.integrate, "the integral along a ray (default exact)")
      ->group(group)
      ->check(CLI::IsMember({"exact", "preintegrated", "average", "vertex"}));
  app.add_option("--backend", o.backend, "compositor (default auto)")
      ->group(group)
      ->check(CLI::IsMember({"auto", "native", "osmesa", "egl"}));
  addThreads(app, o);
}

void addMesh(CLI::App& app, CommonOptions& o) {
  app.add_option("MESH", o.mesh, "mesh file, or a pattern in quotes that names the files of a series")->required();
  app.add_flag("--strict", o.strict, "treat warnings as errors");
}

void addPixel(CLI::App& app, CommonOptions& o) {
  app.add_option_function<std::string>(
         "--pixel", [&o](const std::string& text) { o.pixel = twoInts(text, ',', "--pixel", "x,y"); },
         "explain one pixel: the cells on its ray, front to back")
      ->type_name("x,y");
}

}  // namespace spillikin::cli
