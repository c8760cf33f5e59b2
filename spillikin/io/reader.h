// What the readers of the file families have in common. Private to io.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "spillikin/mesh/source.h"

namespace spillikin::io {

struct Request {
  std::string path;
  std::optional<std::size_t> step;
  std::optional<double> time;
  std::function<void(double)> progress;  // may be empty
  bool times_only = false;               // fill Source::times and nothing else
};

// A reader gets a path to a file that exists; it throws Error. Called in the child process where reading is isolated.
using Reader = mesh::Source (*)(const Request&);

mesh::Source readXml(const Request& request);       // .vtu .vts .vtr .vti .vtm
mesh::Source readParallel(const Request& request);  // .pvtu .pvts .pvtr .pvti
mesh::Source readPvd(const Request& request);       // .pvd
mesh::Source readLegacy(const Request& request);    // .vtk
mesh::Source readExodus(const Request& request);    // .ex2 .e .exo .g
mesh::Source readEnsight(const Request& request);   // .case
mesh::Source readCgns(const Request& request);      // .cgns
mesh::Source readOpenFoam(const Request& request);  // .foam
mesh::Source readPlot3d(const Request& request);    // xyz.bin .xyz .x .p3d

// One family of files: the endings of its names, how its content begins, who reads it.
struct Format {
  std::vector<std::string> suffixes;
  std::string content;  // what sniff() calls it; several separated by '|'; empty: cannot be told from the first bytes
  Reader read;
  bool lists_files = false;    // what is read is in other files
  bool empty_allowed = false;  // the file only marks a folder
};

// Throws Error for a name without a known suffix; the message lists the known.
const Format& formatOf(const std::string& path);

// Checks that the file exists, is not empty and begins as its suffix says. Throws Error.
void checkFile(const std::string& path, const Format& format);

// Opens, checks and reads without isolation: for readers whose files name other files.
mesh::Source readPart(const Request& request);

// The index of the step wanted out of `count` steps (at least 1) with the given times (may be empty). Throws Error.
std::size_t chooseStep(const Request& request, const std::vector<double>& times, std::size_t count);

// Lower-case ending of a name, from its last dot on.
std::string suffixOf(const std::string& path);

}  // namespace spillikin::io
