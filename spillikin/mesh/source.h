// A mesh as it stands in a file, before anything is trusted: what io hands to mesh.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "spillikin/base/view.h"

namespace spillikin::mesh {

// What an array's tuples belong to.
enum class Association : std::uint8_t { points, cells };

// One data array in the file's order: `components` values for each point or cell.
struct Array {
  std::string name;
  Association association = Association::points;
  int components = 1;
  std::vector<double> values;  // tuples * components
  bool identifier = false;     // numbers points or cells (global ids and the like): never drawn unless asked for
};

// Cell types carry VTK's numbers, so that no table is needed between a file and here; any number is accepted in a
// source, and building the mesh decides what becomes of it (used, subdivided, left out with a count).
namespace vtk_cell {
inline constexpr std::uint8_t tetra = 10, voxel = 11, hexahedron = 12, wedge = 13, pyramid = 14, pentagonal_prism = 15,
                              hexagonal_prism = 16, quadratic_tetra = 24, quadratic_hexahedron = 25,
                              quadratic_wedge = 26, quadratic_pyramid = 27, triquadratic_hexahedron = 29,
                              quadratic_linear_wedge = 31, biquadratic_quadratic_wedge = 32,
                              biquadratic_quadratic_hexahedron = 33, triquadratic_pyramid = 37, convex_point_set = 41,
                              polyhedron = 42;
}

// Points are world coordinates. Cell c has the points connectivity[offsets[c] .. offsets[c + 1]) in VTK's order for its
// type. A polyhedron (type 42) has in connectivity its face stream instead: number of faces, then for each face its
// number of points and the points. Cell ids in messages and outputs are indices into `types`: the order of the file,
// blocks one after the other, cells of every dimension counted.
struct Source {
  std::string name;  // the file, for messages
  std::vector<Vec3> points;
  std::vector<std::uint8_t> types;
  std::vector<std::uint64_t> offsets;  // types.size() + 1
  std::vector<std::uint32_t> connectivity;
  std::vector<std::uint8_t> left_out;  // empty, or one per cell: nonzero where ghost, blanked or hidden
  std::vector<Array> arrays;
  std::vector<double> times;  // of all steps in the file or series; empty when it has none
  std::size_t step = 0;       // the one read
};

}  // namespace spillikin::mesh
