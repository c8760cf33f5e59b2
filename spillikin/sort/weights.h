// Weights that make a mesh of tetrahedra a regular triangulation. Nothing else in the house sees GLPK.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// Heights of the vertices whose lifting has a convex crease at every interior face, or a proof that there are none.
// With heights, power distances weighted by them order the mesh (regularity.h) as they do a Delaunay mesh.
struct Weights {
  enum class Verdict : std::uint8_t { exist, none, undecided };
  Verdict verdict = Verdict::undecided;
  std::vector<double> heights;          // by vertex, when they exist: every interior face is then regular, exactly
  std::vector<mesh::Id> contradiction;  // faces whose creases alone contradict each other, when there are none
};

// One linear inequality an interior face, in the heights of its five vertices. First relaxation (Agmon 1954; Motzkin
// and Schoenberg 1954): the heights of a violated face's vertices are moved onto the other side of it, sweep after
// sweep, from the squared lengths on. What it finds is checked exactly. Where it gets stuck, the faces that it still
// moves, in sets that share vertices, are tried by linear programming (GLPK) for a contradiction: multipliers, not
// negative, that add their inequalities to 0 > 0; those that it finds are solved for again in exact arithmetic (CGAL).
//
// The mesh is of tetrahedra. Cost: some 5 ns a face and sweep; `most_steps` faces are looked at, whatever the machine,
// so that the answer is always the same. Contradictions are looked for only where `prove`, which takes up to seconds
// more. Undecided beyond that, and where no contradiction of at most 60 faces is confirmed.
Weights findWeights(const mesh::Mesh& mesh, bool prove, std::size_t most_steps = 200'000'000);

}  // namespace spillikin::sort
