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

// `spans` sorted by enter. An overlap is a span that enters before all those in front of it have left; a gap, a span
// that leaves by a face of a drawn neighbour which does not enter there. Both only beyond `tolerance`, in t. Gaps are
// looked for from `from` on: in front of it spans may be missing.
void checkContacts(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& hidden, std::span<const Span> spans,
                   double from, double tolerance, Contacts& out);

}  // namespace spillikin::reference
