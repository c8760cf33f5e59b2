#include "spillikin/composite/clear_cells.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace spillikin::composite {

namespace {

constexpr std::size_t grain = 1 << 14;
constexpr double infinity = std::numeric_limits<double>::infinity();

// Scalars from lo to hi, both included.
struct Span {
  double lo, hi;
};

// Where extinction is 0, ascending. Piece k of the look runs from point k - 1 to point k, the first and the last
// without end; at the value of a jump the look takes the upper side.
std::vector<Span> clearSpans(const std::vector<integrate::ControlPoint>& points) {
  std::vector<Span> spans;
  bool open = false;  // the last span goes on into the piece at hand
  for (std::size_t k = 0; k <= points.size(); ++k) {
    const double begin = k == 0 ? -infinity : points[k - 1].value;
    const double end = k == points.size() ? infinity : points[k].value;
    const bool clear =
        points[k == 0 ? 0 : k - 1].extinction == 0.0 && points[std::min(k, points.size() - 1)].extinction == 0.0;
    if (clear && open) {
      spans.back().hi = end;
    } else if (clear) {
      spans.push_back({begin, end});
    } else if (open && begin == end) {
      spans.back().hi = std::nextafter(begin, -infinity);
    }
    open = clear;
  }
  return spans;
}

bool inside(const std::vector<Span>& spans, double lo, double hi) {
  const auto next = std::upper_bound(spans.begin(), spans.end(), lo, [](double v, const Span& s) { return v < s.lo; });
  return next != spans.begin() && hi <= std::prev(next)->hi;
}

Span rangeOf(const mesh::Mesh& mesh, const mesh::Field& field, mesh::Id cell) {
  if (field.association == mesh::Association::cells) return {field.values[cell], field.values[cell]};
  Span range{infinity, -infinity};
  for (const mesh::Id v : mesh.vertices(cell))
    range = {std::min(range.lo, field.values[v]), std::max(range.hi, field.values[v])};
  return range;
}

}  // namespace

std::vector<std::uint8_t> clearCells(const mesh::Mesh& mesh, const mesh::Field& field,
                                     const integrate::TransferFunction& look) {
  if (look.points().empty()) return {};
  std::vector<Span> spans = clearSpans(look.points());
  std::erase_if(spans, [&](const Span& s) { return s.hi < field.lo || s.lo > field.hi; });
  if (spans.empty()) return {};
  std::vector<std::uint8_t> clear(mesh.cell_count());
  using Range = tbb::blocked_range<std::size_t>;
  const bool any = tbb::parallel_reduce(
      Range(0, clear.size(), grain), false,
      [&](const Range& cells, bool found) {
        for (std::size_t c = cells.begin(); c != cells.end(); ++c) {
          const Span range = rangeOf(mesh, field, static_cast<mesh::Id>(c));
          clear[c] = static_cast<std::uint8_t>(inside(spans, range.lo, range.hi));
          found = found || clear[c] != 0;
        }
        return found;
      },
      std::logical_or<>());
  if (!any) clear = {};
  return clear;
}

}  // namespace spillikin::composite
