#include "spillikin/cli/series.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <regex>

#include "spillikin/base/error.h"
#include "spillikin/io/read.h"

namespace spillikin::cli {

namespace {

// Digits compare as numbers, everything else as characters.
bool naturallyBefore(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto number = [&](const std::string& s, std::size_t& at) {
      while (at < s.size() && s[at] == '0')
        ++at;
      const std::size_t begin = at;
      while (at < s.size() && digit(s[at]))
        ++at;
      return s.substr(begin, at - begin);
    };
    const std::string m = number(a, i);
    const std::string n = number(b, j);
    if (m.size() != n.size()) return m.size() < n.size();
    if (m != n) return m < n;
  }
  return a.size() - i < b.size() - j;
}

std::vector<std::string> filesOf(const std::string& pattern) {
  glob_t found{};
  const int status = glob(pattern.c_str(), GLOB_NOSORT, nullptr, &found);
  std::vector<std::string> paths;
  if (status == 0) paths.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  globfree(&found);
  if (paths.empty()) throw Error(fmt::format("{}: no file matches this pattern; check it and the folder", pattern));
  std::sort(paths.begin(), paths.end(), naturallyBefore);
  return paths;
}

}  // namespace

bool isPattern(const std::string& mesh) {
  return mesh.find_first_of("*?[") != std::string::npos && !std::filesystem::exists(mesh);
}

std::vector<SeriesStep> openSeries(const std::string& mesh) {
  std::vector<SeriesStep> series;
  const std::vector<std::string> files = isPattern(mesh) ? filesOf(mesh) : std::vector<std::string>{mesh};
  for (const std::string& path : files) {
    const std::vector<double> times = io::readTimes(path);
    if (times.empty()) series.push_back({path, 0, static_cast<double>(series.size())});
    for (std::size_t k = 0; k < times.size(); ++k)
      series.push_back({path, k, times[k]});
  }
  return series;
}

std::size_t chooseStep(const std::vector<SeriesStep>& series, const FieldOptions& field, const std::string& mesh) {
  if (field.time) {
    const auto nearest = std::min_element(series.begin(), series.end(), [&](const SeriesStep& a, const SeriesStep& b) {
      return std::abs(a.time - *field.time) < std::abs(b.time - *field.time);
    });
    return static_cast<std::size_t>(nearest - series.begin());
  }
  const std::size_t step = field.step.value_or(0);
  if (step >= series.size()) {
    throw Error(fmt::format("{}: there is no step {}: it has {} step{}, counted from 0", mesh, step, series.size(),
                            series.size() == 1 ? "" : "s"));
  }
  return step;
}

std::vector<std::size_t> chosenSteps(const std::string& text, std::size_t count) {
  static const std::regex form("(-?[0-9]{1,9})?(?::(-?[0-9]{1,9})?(?::([0-9]{1,9})?)?)?");
  std::smatch match;
  if (text.empty() || !std::regex_match(text, match, form)) {
    throw CLI::ValidationError(fmt::format("--steps: '{}' should be a:b:c, for example 0:20:2 or ::5", text));
  }
  const long n = static_cast<long>(count);
  const auto number = [&](std::size_t group, long otherwise) {
    if (!match[group].matched) return otherwise;
    const long value = std::stol(match[group].str());
    return value < 0 ? value + n : value;
  };
  const bool single = text.find(':') == std::string::npos;
  const long first = number(1, 0);
  const long last = single ? first : std::min(number(2, n - 1), n - 1);
  const long stride = match[3].matched ? std::stol(match[3].str()) : 1;
  if (stride < 1 || first < 0 || first >= n) {
    throw CLI::ValidationError(fmt::format("--steps: '{}' names no step of {}; they count from 0", text, count));
  }
  std::vector<std::size_t> steps;
  for (long k = first; k <= last; k += stride)
    steps.push_back(static_cast<std::size_t>(k));
  if (steps.empty()) throw CLI::ValidationError(fmt::format("--steps: '{}' names no step of {}", text, count));
  return steps;
}

std::string numberedPath(const std::string& pattern, std::size_t step) {
  static const std::regex number("%(0?[0-9]{0,2})d");
  std::smatch match;
  if (!std::regex_search(pattern, match, number) ||
      std::regex_search(match.suffix().first, match.suffix().second, number)) {
    throw CLI::ValidationError(
        fmt::format("-o: '{}' should have one %d for the number of the step, for example frame_%04d.png", pattern));
  }
  const std::string width = match[1].str();
  const std::string text = fmt::format(fmt::runtime("{:" + width + "}"), step);
  return match.prefix().str() + text + match.suffix().str();
}

}  // namespace spillikin::cli
