// The scalar that is drawn: one component or the magnitude of an array of the source, laid out by the mesh's ids.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

// Which function is being integrated inside a cell (the design's table of field models).
enum class FieldModel : std::uint8_t { cell, face, tets, isoparametric };

struct Field {
  std::string name;  // "pressure", "velocity (magnitude)", "velocity (1)"
  Association association = Association::points;
  std::vector<double> values;  // per vertex or per cell of the mesh
  std::vector<std::uint8_t>
      hidden;  // empty, or per cell: nonzero where a value is NaN or infinite; such cells are not drawn
  std::size_t hidden_count = 0;
  double lo = 0.0, hi = 0.0;  // range over the visible cells; lo == hi for a constant field
};

inline constexpr int magnitude = -1;

// `name` empty: the first point scalar, else the first cell scalar (vectors count by their magnitude when there is no
// scalar at all); a source without any array gives a constant field of 0 named "". `component`: 0, 1, ... or magnitude,
// which for a one-component array is the value itself. Throws Error for an unknown name (the message lists the arrays
// and the nearest name), a component out of range, an array of the wrong length.
Field selectField(const Source& source, const Mesh& mesh, const std::string& name = "", int component = magnitude);

}  // namespace spillikin::mesh
