// What VTK's mappers miss the truth by, on the views on which Spillikin is judged.
#pragma once

#include <string>

#include "bench/peers/subjects.h"

namespace spillikin::bench {

struct AccuracyOptions {
  int size = 128;
  double limit_seconds = 20.0;  // a frame; a mapper that takes longer is given up on this mesh
};

// The generated meshes on which speed is measured, and every mesh of the folder.
std::vector<Subject> judgedSubjects(const std::string& folder);

// Rows of a Markdown table for one subject: each mapper and Spillikin against the reference, by transfer function.
std::string accuracyRows(const Subject& subject, const AccuracyOptions& options);

// The heading, with the table's first lines.
std::string accuracyHeading(const AccuracyOptions& options);

}  // namespace spillikin::bench
