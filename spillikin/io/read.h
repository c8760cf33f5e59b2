// Reading meshes from files, through VTK's readers; nothing of VTK is seen outside this room.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "spillikin/mesh/source.h"

namespace spillikin::io {

struct ReadOptions {
  std::optional<std::size_t> step;  // default: the first
  std::optional<double> time;       // the step nearest to it; step and time exclude each other
  // Called now and then with the part done, 0 to 1; may be empty.
  std::function<void(double)> progress;
  // Read in a child process, so that a reader which crashes on a corrupt file ends with an Error, not with the program.
  bool isolate = true;
};

// Reads one step of a mesh file: .vtu .pvtu .vtk .vts .vtr .vti .pvd .ex2 .e .exo .g .case .cgns .foam, and PLOT3D as
// the geometry file NAMExyz.bin (or .xyz, .x, .p3d) with the solution NAMEq.bin (.q) beside it. Blocks become one
// source, one after the other; structured grids become hexahedra; ghost, blanked and hidden cells are marked left out.
// Throws Error: missing, empty, truncated, misnamed or corrupt file, unknown suffix (lists the known), no such step.
mesh::Source readMesh(const std::string& path, const ReadOptions& options = {});

// The times of all steps in the file, ascending as the file has them; empty when it has none. Reads no more of the file
// than its format demands. Same errors.
std::vector<double> readTimes(const std::string& path);

}  // namespace spillikin::io
