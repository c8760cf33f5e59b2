// The GLSL sources, assembled. Each program is one vertex and one fragment shader.
#pragma once

#include <cstdint>
#include <string>

#include "spillikin/composite/gl_cells.h"

namespace spillikin::composite {

// Binding points that the shaders and the compositor agree on.
namespace gl_binding {
inline constexpr unsigned view = 0;   // uniform block
inline constexpr unsigned cells = 0;  // buffer textures from here on
inline constexpr unsigned vertices = 1;
inline constexpr unsigned triangles = 2;
inline constexpr unsigned planes = 3;
inline constexpr unsigned transfer = 4;
inline constexpr unsigned table = 5;  // pre-integrated, or opacity
}  // namespace gl_binding

// How a fragment integrates the scalar along its segment of the ray.
enum class SegmentShader : std::uint8_t {
  constant,       // the field is constant in each cell: colour and extinction come with the cell
  exact,          // cut at the transfer function's breakpoints, each piece by its exact weights
  average,        // mean of colour and extinction at the two ends
  preintegrated,  // from a table
  peak,           // not at all: the larger scalar of the two ends
  constant_peak,  // the same of a field that is constant in each cell: the scalar comes with the cell
};

struct CellShader {
  CellShape shape = CellShape::tetrahedra;
  bool thin = false;  // no segment's optical depth reaches thin_depth
  SegmentShader segment = SegmentShader::exact;
  bool operator==(const CellShader&) const = default;
};

inline constexpr double thin_depth = 1.49;  // where integrate's thin weights end, less rounding

std::string cellVertexShader(const CellShader& shader);
std::string cellFragmentShader(const CellShader& shader);

// Polygons with their look at the vertices (integration `vertex`). Attributes: image position from the centre, texture
// coordinates, colour.
std::string polygonVertexShader();
std::string polygonFragmentShader();

}  // namespace spillikin::composite
