// What neighbouring intervals of a ray must satisfy, and where they do not.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::reference {

// One cell on one ray, before anything is trimmed; t in units of the ray's direction.
struct Span {
  mesh::Id cell = mesh::none;
  mesh::Id leave_face = mesh::none;  // face of the mesh; none where it is not known
  double enter = 0.0, leave = 0.0;
  double front = 0.0, back = 0.0;
};

// Cells reach into each other, or do not meet where they share a face.
struct Contacts {
  std::size_t overlaps = 0, gaps = 0;
  static constexpr std::size_t most_pairs = 16;  // remembered
  std::vector<std::array<mesh::Id, 2>> pairs;    // of the first overlaps
};

// What counts as touching, in t.
struct Tolerances {
  double contact = 0.0;  // rounding: where both cells of a face find the same place
  // Where one cell is bounded by curved faces and its neighbour by flat ones: they agree on planar faces up to the
  // conditioning of the crossing.
  double mixed = 0.0;
  bool curved_model = false;  // hexahedra, wedges and pyramids have their true faces
};

// `spans` sorted by enter. An overlap is a span that enters before all those in front of it have left; a gap, a span
// that leaves by a face of a drawn neighbour which does not enter there; at curved faces, where a ray past an edge may
// skip a neighbour thinner than rounding, only when no other span goes on there either. Both only beyond the tolerance.
// Gaps are looked for from `from` on: in front of it spans may be missing.
void checkContacts(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& hidden, std::span<const Span> spans,
                   double from, const Tolerances& tolerance, Contacts& out);

}  // namespace spillikin::reference
