#include "spillikin/reference/contacts.h"

#include <algorithm>
#include <cmath>

#include "spillikin/reference/isoparametric.h"

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

// Whether any span lies on both sides of `place`, or begins there.
bool goesOn(std::span<const Span> spans, double place, double tolerance) {
  return std::any_of(spans.begin(), spans.end(),
                     [&](const Span& s) { return s.enter <= place + tolerance && s.leave > place + tolerance; });
}

// The face by which spans[n] leaves joins two drawn cells and the ray is lost there.
bool gapBehind(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& hidden, std::span<const Span> spans,
               std::size_t n, const Tolerances& tolerance) {
  const Span& span = spans[n];
  const std::array<mesh::Id, 2> sides = mesh.cells(span.leave_face);
  const mesh::Id neighbour = sides[0] == span.cell ? sides[1] : sides[0];
  if (neighbour == mesh::none || (!hidden.empty() && hidden[neighbour] != 0)) return false;
  if (meets(spans, n, neighbour, tolerance.contact)) return false;
  const bool curved_here = tolerance.curved_model && curved(mesh.cell_type[span.cell]);
  const bool curved_there = tolerance.curved_model && curved(mesh.cell_type[neighbour]);
  if (!curved_here && !curved_there) return true;
  return !goesOn(spans, span.leave, curved_here == curved_there ? tolerance.contact : tolerance.mixed);
}

}  // namespace

void checkContacts(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& hidden, std::span<const Span> spans,
                   double from, const Tolerances& tolerance, Contacts& out) {
  std::size_t last = 0;  // the span that leaves last so far
  for (std::size_t n = 0; n < spans.size(); ++n) {
    const double t = tolerance.contact;
    if (n > 0 && spans[n].enter < spans[last].leave - t && spans[n].leave > spans[n].enter + t) {
      ++out.overlaps;
      const std::array<mesh::Id, 2> pair{std::min(spans[last].cell, spans[n].cell),
                                         std::max(spans[last].cell, spans[n].cell)};
      if (out.pairs.size() < Contacts::most_pairs && !known(out, pair)) out.pairs.push_back(pair);
    }
    if (n == 0 || spans[n].leave > spans[last].leave) last = n;
    if (spans[n].leave_face == mesh::none || spans[n].leave < from) continue;
    if (gapBehind(mesh, hidden, spans, n, tolerance)) ++out.gaps;
  }
}

}  // namespace spillikin::reference
