// What is left of a mesh when the queue runs dry: the cells in cycles and those behind them.
#pragma once

#include <vector>

#include "spillikin/sort/gap_edges.h"
#include "spillikin/sort/layered_sort.h"
#include "spillikin/sort/problem_faces.h"

namespace spillikin::sort {

// Appends the cells or nodes that the layered sort left, so that every cell is listed, names the strongly connected
// ones in order.cycles and cuts cells of each until it is none. Returns whether the order is right: it is unless the
// cutter gave up. Linear but for the cycles themselves; serial.
bool appendLeft(const mesh::Mesh& mesh, const FaceSigns& signs, const LayeredSort& layered, const Gaps* gaps,
                ProblemCells& problems, const Viewpoint& viewpoint, Order& order);

// Cycles as one: their nodes share a turn.
struct Ties {
  std::vector<mesh::Id> of;                  // per node: its cycle, or none; empty where there is no cycle
  std::vector<std::vector<mesh::Id>> nodes;  // of each cycle
  std::vector<mesh::Id> left;                // in sequence; of a cycle one node stands for all
  std::vector<CellPiece> pieces;             // what was made of the cycles
  std::vector<mesh::Id> tie_of_piece;
  void clear() {
    of.clear();
    nodes.clear();
    left.clear();
    pieces.clear();
    tie_of_piece.clear();
  }
};

// What the layered sort left, one node after the other and each cycle as one: every node takes the latest turn of its
// own, of its cycle and of those before it, by faces and by the edges of `gaps`, which may be null. Linear; serial.
void tieLeft(const LayeredSort& layered, const Gaps* gaps, Turn* turn, Ties& ties);

// Once turns are settled: appends what was left, the pieces of cycles by ids after those of the nodes, and names the
// cycles in order.cycles. What is listed is right by faces, by the edges of `gaps` and inside cycles; returns whether
// it is: the cutter may give up.
bool cutTies(const mesh::Mesh& mesh, const FaceSigns& signs, const LayeredSort& layered, const Gaps* gaps,
             ProblemCells& problems, const Viewpoint& viewpoint, Order& order, Ties& ties);

// The cycles that the layered sort left: for every cell one of them that holds a part of it, or none. Cycles that hold
// parts of one cell count as one.
void groupCycles(const mesh::Mesh& mesh, const LayeredSort& layered, const Gaps* gaps, std::vector<mesh::Id>& group);

// The whole order by faces and by all edges across gaps (left in `edges`), with its layers; cycles are cut. Reads the
// signs of the viewpoint and overwrites the order. Sets order.exact.
void orderByEdges(const mesh::Mesh& mesh, const FaceSigns& signs, LayeredSort& layered, GapEdges& finder,
                  ProblemCells& problems, const PartedCells& parted, const Viewpoint& viewpoint, ExtraEdges& edges,
                  Order& order);

}  // namespace spillikin::sort
