// What is left of a mesh when the queue runs dry: the cells in cycles and those behind them.
#pragma once

#include "spillikin/sort/layered_sort.h"

namespace spillikin::sort {

// Appends the cells that the layered sort left, so that every cell is listed, and names the strongly connected ones in
// order.cycles. Returns whether the order is right: no cycle was found.
bool appendLeft(const mesh::Mesh& mesh, const LayeredSort& layered, const ExtraEdges* extra, const Viewpoint& viewpoint,
                Order& order);

}  // namespace spillikin::sort
