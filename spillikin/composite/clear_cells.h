// Cells of which a look shows nothing: they need not be drawn.
#pragma once

#include <cstdint>
#include <vector>

#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::composite {

// Per cell, nonzero where extinction is 0 at every scalar between the least and the largest of the cell; empty where
// no cell is like that. Such a cell absorbs nothing and, extinction being what glows, emits nothing. Cost: linear in
// the cells, on all cores; in the points of `look` alone where it is clear nowhere in the field's range.
std::vector<std::uint8_t> clearCells(const mesh::Mesh& mesh, const mesh::Field& field,
                                     const integrate::TransferFunction& look);

}  // namespace spillikin::composite
