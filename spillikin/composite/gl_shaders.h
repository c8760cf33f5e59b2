// The GLSL sources, assembled. Each program is one vertex and one fragment shader.
#pragma once

#include <string>

namespace spillikin::composite {

// Binding points that the shaders and the compositor agree on.
namespace gl_binding {
inline constexpr unsigned view = 0;   // uniform block
inline constexpr unsigned cells = 0;  // buffer textures from here on
inline constexpr unsigned vertices = 1;
inline constexpr unsigned triangles = 2;
inline constexpr unsigned planes = 3;
inline constexpr unsigned transfer = 4;
}  // namespace gl_binding

struct CellShader {
  bool tetrahedra = true;   // else any cell, as a loop over its boundary triangles
  bool cell_field = false;  // the scalar is constant in each cell: colour and extinction come with the cell
  bool operator==(const CellShader&) const = default;
};

std::string cellVertexShader(const CellShader& shader);
std::string cellFragmentShader(const CellShader& shader);

}  // namespace spillikin::composite
