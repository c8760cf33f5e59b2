// A line through an element's own curved shape and its own shape functions.
#pragma once

#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/reference/contacts.h"
#include "spillikin/reference/exact.h"

namespace spillikin::reference {

// How far a linear piece of the field along the ray may be from the field, as a part of the field's range.
inline constexpr double field_tolerance = 1e-6;

// How far the line is moved aside, in x and (by the golden section of it) in y of its shear, so that a line in a face
// or an edge is in one cell only: as a part of the mesh's radius, and at least so many roundings of its coordinates.
// Rays this near to another face may be doubled or lost; nothing exact is claimed for curved elements.
inline constexpr double curved_shift = 1e-10, curved_shift_roundings = 64.0;

// Whether a cell type has shape functions that are not linear: hexahedron, wedge, pyramid.
bool curved(mesh::CellType type);

// Appends the line's way through hexahedron, wedge or pyramid `cell`, bounded by its true bilinear faces, as spans on
// which the field is linear to within `tolerance` (scalar units); the field is that of the element's trilinear, wedge
// or pyramid shape functions at the parameters found by inverting them. Ends at faces are the same bits from both
// sides. Where a distorted element folds over itself, the parameters count at which the Jacobian has the sign that it
// has in the element's middle, the smallest first. `values` is per vertex of the mesh, or null for a field that is
// constant in the cell (0 comes out). `shift` in world units. `roots` is room that is reused.
void crossCurved(const Line& line, const mesh::Mesh& mesh, mesh::Id cell, const double* values, double tolerance,
                 double shift, std::vector<Vec3>& roots, std::vector<Span>& out);

}  // namespace spillikin::reference
