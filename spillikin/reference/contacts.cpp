#include "spillikin/reference/contacts.h"

#include <algorithm>
#include <cmath>

namespace spillikin::reference {
namespace {

bool known(const Contacts& contacts, const std::array<mesh::Id, 2>& pair) {
  return std::find(contacts.pairs.begin(), contacts.pairs.end(), pair) != contacts.pairs.end();
}

// Whether `neighbour` enters where spans[n] leaves: looked for on both sides of it in the order of entry.
bool meets(std::span<const Span> spans, std::size_t n, mesh::Id neighbour, double tolerance) {
  const double place = spans[n].leave;
  const auto here = [&](const Span& s) { return s.cell == neighbour && std::abs(s.enter - place) <= tolerance; };
  for (std::size_t m = n + 1; m < spans.size() && spans[m].enter <= place + tolerance; ++m) {
    if (here(spans[m])) return true;
  }
  for (std::size_t m = n; m-- > 0 && spans[m].enter >= place - tolerance;) {
    if (here(spans[m])) return true;
  }
  return false;
}

}  // namespace

void checkContacts(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& hidden, std::span<const Span> spans,
                   double from, double tolerance, Contacts& out) {
  std::size_t last = 0;  // the span that leaves last so far
  for (std::size_t n = 0; n < spans.size(); ++n) {
    if (n > 0 && spans[n].enter < spans[last].leave - tolerance && spans[n].leave > spans[n].enter + tolerance) {
      ++out.overlaps;
      const std::array<mesh::Id, 2> pair{std::min(spans[last].cell, spans[n].cell),
                                         std::max(spans[last].cell, spans[n].cell)};
      if (out.pairs.size() < Contacts::most_pairs && !known(out, pair)) out.pairs.push_back(pair);
    }
    if (n == 0 || spans[n].leave > spans[last].leave) last = n;
    if (spans[n].leave_face == mesh::none || spans[n].leave < from) continue;
    const std::array<mesh::Id, 2> sides = mesh.cells(spans[n].leave_face);
    const mesh::Id neighbour = sides[0] == spans[n].cell ? sides[1] : sides[0];
    if (neighbour == mesh::none || (!hidden.empty() && hidden[neighbour] != 0)) continue;
    if (!meets(spans, n, neighbour, tolerance)) ++out.gaps;
  }
}

}  // namespace spillikin::reference
