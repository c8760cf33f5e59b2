// EnSight 6 and Gold, ASCII and binary, through their case file.
#include <fmt/format.h>
#include <vtkGenericEnSightReader.h>
#include <vtkNew.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <sstream>

#include "spillikin/base/error.h"
#include "spillikin/io/pipeline.h"

namespace spillikin::io {
namespace {

// The numbers in a text, up to the first word that is none.
std::size_t countNumbers(const std::string& text) {
  std::istringstream in(text);
  std::size_t count = 0;
  for (double number = 0.0; in >> number;)
    ++count;
  return count;
}

// The reader looks for the times and the file numbers of all steps without end where the case file has too few.
void checkSteps(const std::string& path) {
  std::ifstream in(path);
  std::size_t steps = 0;
  std::string list, numbers;  // the list that is open, and what it has so far
  const auto close = [&] {
    const std::size_t count = countNumbers(numbers);
    if (!list.empty() && count < steps) {
      throw Error(fmt::format("'{}' is truncated or damaged: it announces {} steps, but has {} {}; export it again",
                              path, steps, count, list));
    }
    list.clear();
    numbers.clear();
  };
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(':');
    const std::string key = line.substr(0, colon), rest = colon == std::string::npos ? "" : line.substr(colon + 1);
    if (colon == std::string::npos) {
      numbers += " " + line;
      continue;
    }
    close();
    if (key.find("number of steps") != std::string::npos) steps = std::strtoull(rest.c_str(), nullptr, 10);
    if (key.find("time values") != std::string::npos) list = "time values";
    if (key.find("filename numbers") != std::string::npos) list = "file numbers";
    if (!list.empty()) numbers = rest;
  }
  close();
}

bool startsWithOneOf(const std::string& line, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* word) { return line.starts_with(word); });
}

// The reader never gets past a line that it does not know in the first two sections.
void checkSections(const std::string& path) {
  std::ifstream in(path);
  std::string section;
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    line.erase(0, line.find_first_not_of(" \t\r"));
    if (line.empty() || line.front() == '#') continue;
    if (startsWithOneOf(line, {"FORMAT", "GEOMETRY", "VARIABLE", "TIME", "FILE"})) {
      section = line.substr(0, line.find_last_not_of(" \t\r") + 1);
      continue;
    }
    const bool known = section == "FORMAT" ? line.starts_with("type:")
                       : section == "GEOMETRY"
                           ? startsWithOneOf(line, {"model:", "measured:", "match:", "boundary:", "rigid_body:"})
                           : !section.empty();
    if (!known) {
      throw Error(fmt::format("line {} of '{}' is not known there; it is damaged, export it again", number, path));
    }
  }
}

}  // namespace

mesh::Source readEnsight(const Request& request) {
  checkSections(request.path);
  checkSteps(request.path);
  vtkNew<vtkGenericEnSightReader> reader;
  reader->SetCaseFileName(request.path.c_str());
  reader->ReadAllVariablesOn();
  return run(reader, request);
}

}  // namespace spillikin::io
