// What is left of a mesh when the queue runs dry: the cells in cycles and those behind them.
#pragma once

#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/problem_faces.h"

namespace spillikin::sort {

// Appends the cells or nodes that the layered sort left, so that every cell is listed, names the strongly connected
// ones in order.cycles and cuts cells of each until it is none. Returns whether the order is right: it is unless the
// cutter gave up. Linear but for the cycles themselves; serial.
bool appendLeft(const mesh::Mesh& mesh, const FaceSigns& signs, const LayeredSort& layered, const Gaps* gaps,
                ProblemCells& problems, const Viewpoint& viewpoint, Order& order);

// The whole order by faces and by all edges across gaps (left in `edges`), with its layers; cycles are cut. Reads the
// signs of the viewpoint and overwrites the order. Sets order.exact.
void orderByEdges(const mesh::Mesh& mesh, const FaceSigns& signs, LayeredSort& layered, GapEdges& finder,
                  ProblemCells& problems, const PartedCells& parted, const Viewpoint& viewpoint, ExtraEdges& edges,
                  Order& order);

}  // namespace spillikin::sort
