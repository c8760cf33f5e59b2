// The meshes on which the peers are measured, and how much faster than each of them Spillikin set out to be.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "spillikin/mesh/source.h"

namespace spillikin::bench {

// Times faster; 0 where no target was set.
struct Targets {
  double projected_tetrahedra = 0.0, bunyk = 0.0, zsweep = 0.0;
};

struct Subject {
  std::string label;
  Targets targets;
  std::function<mesh::Source()> make;  // generated or read; throws Error
  std::size_t weight = 0;              // cells, roughly: what decides whether a limit on cells leaves the subject out
};

// The generated meshes, then those of the files that `folder` has.
std::vector<Subject> subjects(const std::string& folder);

}  // namespace spillikin::bench
