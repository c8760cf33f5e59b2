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

// How far the ray of the isoparametric model is moved aside, along the two axes across its largest component (along the
// second by the golden section of it), so that a ray in a face or an edge is in one cell only: as a part of the mesh's
// radius, and at least so many roundings of its coordinates. Curved elements have no exact decisions: a ray that then
// runs within rounding of a face may still be doubled or lost.
inline constexpr double curved_shift = 1e-10, curved_shift_roundings = 64.0;

// Whether a cell type has shape functions that are not linear: hexahedron, wedge, pyramid.
bool curved(mesh::CellType type);

// Appends the line's way through hexahedron, wedge or pyramid `cell`, bounded by its true bilinear faces, as spans on
// which the field is linear to within `tolerance` (scalar units); the field is that of the element's trilinear, wedge
// or pyramid shape functions at the parameters found by inverting them. Ends at faces are the same bits from both
// sides. Where a distorted element folds over itself, the parameters count at which the Jacobian has the sign that it
// has in the element's middle, the smallest first. `values` is per vertex of the mesh, or null for a field that is
// constant in the cell (0 comes out). `roots` is room that is reused.
void crossCurved(const Line& line, const mesh::Mesh& mesh, mesh::Id cell, const double* values, double tolerance,
                 std::vector<Vec3>& roots, std::vector<Span>& out);

}  // namespace spillikin::reference
