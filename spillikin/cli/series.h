// Many steps of one simulation: one file with many steps, or many files named by a pattern.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "spillikin/cli/options.h"

namespace spillikin::cli {

// Where one step is found. `step` is the index in its file.
struct SeriesStep {
  std::string path;
  std::size_t step = 0;
  double time = 0.0;
};

// The steps of MESH: a path, or a pattern with *, ? or [...] in quotes, whose files are taken in natural order
// (plate_2 before plate_10). Throws Error when nothing matches.
std::vector<SeriesStep> openSeries(const std::string& mesh);
bool isPattern(const std::string& mesh);

// The step of a series that --step or --time names; default the first. Throws Error that gives the number of steps.
std::size_t chooseStep(const std::vector<SeriesStep>& series, const FieldOptions& field, const std::string& mesh);

// Which of `count` steps a:b:c names: from a up to, and with, b, every c-th; each part may be left out, negative ones
// count from the end. Throws CLI::ValidationError.
std::vector<std::size_t> chosenSteps(const std::string& text, std::size_t count);

// "frame_%04d.png" with the number of the step filled in. Throws CLI::ValidationError unless it has exactly one %d.
std::string numberedPath(const std::string& pattern, std::size_t step);

}  // namespace spillikin::cli
