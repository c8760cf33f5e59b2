// From options to a session: reads the mesh, chooses field, look and view, and passes warnings on.
#pragma once

#include <string>

#include "spillikin/cli/options.h"
#include "spillikin/cli/series.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/session.h"

namespace spillikin::cli {

struct SceneOptions {
  CommonOptions common;
  ViewOptions view;
  FieldOptions field;
  LookOptions look;
  EngineOptions engine;
};

// Reads the step of the mesh that the options name, with a progress bar.
mesh::Source readSource(const CommonOptions& common, const FieldOptions& field, double* seconds = nullptr);

// The same for one step of a series, warped as the options say.
mesh::Source readStep(const SeriesStep& step, const FieldOptions& field, double* seconds = nullptr);

// A session with the field, view and look of the options, on the mesh that they name or on the source given. `range`:
// what the transfer function spans when the options leave it open, instead of the field's own.
render::Session openSession(const SceneOptions& options);
render::Session openSession(const SceneOptions& options, mesh::Source source, double load_seconds,
                            const std::optional<std::array<double, 2>>& range = {});

// An image that cannot be written is told before the work: an unknown suffix is a wrong argument, a folder that is not
// there or takes no files cannot be helped.
void checkTarget(const std::string& image);

// What the options say that holds for any mesh; throws CLI::ValidationError.
void checkArguments(const SceneOptions& options);

// The view of the options on a mesh with this box; checkedView throws CLI::ValidationError where no picture can be
// taken from it.
View makeView(const ViewOptions& options, const render::Box& box);
View checkedView(const ViewOptions& options, const render::Box& box);
int componentNumber(const std::string& text);

// Prints what has been warned of since `printed` lines, as `spillikin: warning: ...` on stderr; with --strict the first
// one is thrown as an Error instead. Returns the number of lines printed in all.
std::size_t reportWarnings(const std::vector<std::string>& warnings, bool strict, std::size_t printed = 0);

// The arrays of a source, a line each, for --list-fields.
std::string listFields(const mesh::Source& source);

// What `--list-fields` does instead of the command: true when it was asked for and done.
bool listedFields(const SceneOptions& options);

}  // namespace spillikin::cli
