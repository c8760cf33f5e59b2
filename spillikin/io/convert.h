// From VTK's data objects to a source, with every count and id checked on the way. Private to io.
#pragma once

#include "spillikin/mesh/source.h"

class vtkDataObject;

namespace spillikin::io {

// Appends the data set, or the leaves of the composite data set in their order, to `source`. Arrays that only some
// leaves have are NaN in the others. Linear. Throws Error: offsets, ids or array lengths that do not fit each other;
// more than 2^32 - 1 points.
void append(vtkDataObject* data, mesh::Source& source);

// Appends `part` behind `source`, as two blocks of one mesh. `source` may be empty.
void append(const mesh::Source& part, mesh::Source& source);

}  // namespace spillikin::io
