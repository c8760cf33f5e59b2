// The options that several commands share: one table for the view, the field, the look and the engine.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "spillikin/render/session.h"

namespace spillikin::cli {

struct ViewOptions {
  std::array<int, 2> size{1024, 768};
  std::optional<Vec3> eye, target, up;
  double view_angle = 30.0;
  std::optional<double> parallel_scale;
  double azimuth = 0.0, elevation = 0.0, zoom = 1.0;
  std::vector<ClipPlane> clips;
};

struct FieldOptions {
  std::string name;
  std::string component = "mag";
  std::optional<std::size_t> step;
  std::optional<double> time;
  std::string warp;  // NAME[,scale]
  bool list = false;
};

struct LookOptions {
  std::string tf;  // preset or file
  std::optional<std::array<double, 2>> range;
  double opacity = 1.0;
  std::string optics = "absorption-emission";
  std::array<double, 4> background{0.0, 0.0, 0.0, 1.0};
};

struct EngineOptions {
  std::string sort = "auto", walk = "auto", project = "auto", integrate = "exact", backend = "auto";
  int threads = 0;
};

// What every command that reads a mesh has besides.
struct CommonOptions {
  std::string mesh;
  bool strict = false;
  std::optional<std::array<int, 2>> pixel;
};

void addView(CLI::App& app, ViewOptions& options);
void addField(CLI::App& app, FieldOptions& options);
void addLook(CLI::App& app, LookOptions& options);
void addEngine(CLI::App& app, EngineOptions& options);
void addThreads(CLI::App& app, EngineOptions& options);
void addMesh(CLI::App& app, CommonOptions& options);
void addPixel(CLI::App& app, CommonOptions& options);

}  // namespace spillikin::cli
