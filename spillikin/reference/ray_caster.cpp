// Casting: gather the cells of a ray, cross them exactly, sort, integrate front to back.
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "spillikin/base/error.h"
#include "spillikin/integrate/segment.h"
#include "spillikin/reference/candidates.h"
#include "spillikin/reference/contacts.h"
#include "spillikin/reference/crossing.h"
#include "spillikin/reference/edge_on.h"
#include "spillikin/reference/isoparametric.h"
#include "spillikin/reference/quadrature.h"
#include "spillikin/reference/rays.h"
#include "spillikin/reference/reference.h"
#include "spillikin/reference/samples.h"
#include "spillikin/reference/shapes.h"
#include "spillikin/reference/tetrahedra.h"

namespace spillikin::reference {
namespace {

using integrate::Radiance;
using integrate::TransferFunction;

// Made once per thread and reused from ray to ray.
struct Scratch {
  std::vector<mesh::Id> cells;
  CellScratch cell;
  std::vector<Span> spans;
  std::vector<Vec3> roots;
};

bool before(const Span& a, const Span& b) {
  if (a.enter != b.enter) return a.enter < b.enter;
  if (a.leave != b.leave) return a.leave < b.leave;
  return a.cell < b.cell;
}

// The part of a span inside `range`, with the scalars of the untrimmed span's linear function at its ends. False when
// nothing is left.
bool trim(const Range& range, Span& span) {
  const double lo = std::max(span.enter, range.lo), hi = std::min(span.leave, range.hi);
  if (!(lo < hi)) return false;
  const double length = span.leave - span.enter, slope = span.back - span.front;
  const double front = span.front + (lo - span.enter) / length * slope;
  if (hi < span.leave) span.back = span.front + (hi - span.enter) / length * slope;
  if (lo > span.enter) span.front = front;
  span.enter = lo;
  span.leave = hi;
  return true;
}

struct Row {
  std::size_t intervals = 0;
  Contacts contacts;
  std::vector<double> x, y;  // image positions of contacts.pairs
};

}  // namespace

struct RayCaster::Impl {
  Impl(const mesh::Mesh& m, const mesh::Field& f)
      : mesh(m), field(f), shapes(m), tetrahedron(tetrahedronPattern()), candidates(m, f.hidden) {}

  const mesh::Mesh& mesh;
  const mesh::Field& field;
  Shapes shapes;
  Pattern tetrahedron;
  Candidates candidates;
  mutable std::once_flag once;
  mutable std::unique_ptr<Tetrahedra> tetrahedra;
  mutable tbb::enumerable_thread_specific<Scratch> scratch;

  void prepare(const Options& options) const;
  Tolerances tolerances(const Line& line, mesh::FieldModel model) const;
  Line makeLine(const Ray& ray, mesh::FieldModel model) const;
  void collect(const Ray& ray, const Line& line, bool eye, mesh::FieldModel model, Scratch& s) const;
  void addCell(const Line& line, mesh::Id cell, Scratch& s) const;
  void addTetrahedra(const Line& line, mesh::Id cell, Scratch& s) const;
  void addCurved(const Line& line, mesh::Id cell, Scratch& s) const;
  void addCrossings(mesh::Id cell, bool faces, Scratch& s) const;
  Radiance integrate(const Line& line, const Range& range, const TransferFunction& tf, const Options& options,
                     Scratch& s) const;
  void castRow(const Rays& rays, int y, const TransferFunction& tf, const Options& options, Image& image,
               Row& row) const;
};

// What this call needs and an earlier one may not have.
void RayCaster::Impl::prepare(const Options& options) const {
  if (options.samples < 1) throw Error("samples per pixel must be at least 1");
  if (options.model == mesh::FieldModel::tets && !mesh.tetrahedral()) {
    std::call_once(once, [this] { tetrahedra = std::make_unique<Tetrahedra>(mesh, field); });
  }
}

// Two spans that touch are off by the rounding of coordinates relative to the ray's origin and by the barycentric
// tolerance times the size of a triangle, for which the mesh's is a bound. In t.
Tolerances RayCaster::Impl::tolerances(const Line& line, mesh::FieldModel model) const {
  constexpr double roundings = 32.0 * std::numeric_limits<double>::epsilon();
  constexpr double mixed = 1e-6;  // of the mesh's radius: far above rounding at any but grazing rays
  const double origin = std::max({std::abs(line.o.x), std::abs(line.o.y), std::abs(line.o.z)});
  const double contact =
      roundings * (candidates.magnitude() + origin) + 8.0 * barycentric_tolerance * candidates.radius();
  return {contact / line.length, std::max(contact, mixed * candidates.radius()) / line.length,
          model == mesh::FieldModel::isoparametric};
}

// The line that is crossed with the cells: the ray itself, a little aside of it where elements are curved.
Line RayCaster::Impl::makeLine(const Ray& ray, mesh::FieldModel model) const {
  // As the compositors break ties: to the right, and less downwards.
  const Line line(ray.origin, ray.direction, ray.right, ray.down);
  if (model != mesh::FieldModel::isoparametric) return line;
  constexpr double golden_section = 0.6180339887498949;
  constexpr double roundings = curved_shift_roundings * std::numeric_limits<double>::epsilon();
  const double shift = std::max(curved_shift * candidates.radius(), roundings * candidates.magnitude());
  Vec3 origin = ray.origin;
  origin[line.i] += shift;
  origin[line.j] += golden_section * shift;
  return {origin, ray.direction, ray.right, ray.down};
}

// Turns the sorted crossings of one closed surface into spans, two by two.
void RayCaster::Impl::addCrossings(mesh::Id cell, bool faces, Scratch& s) const {
  const std::vector<Crossing>& crossings = s.cell.crossings;
  for (std::size_t n = 0; n + 1 < crossings.size(); n += 2) {
    Span span{cell, mesh::none, crossings[n].t, crossings[n + 1].t, crossings[n].scalar, crossings[n + 1].scalar};
    // Ends out of order by rounding (the span then has no length to speak of), or a cell inside out: face not known.
    const bool in_order = !crossings[n].leaving && crossings[n + 1].leaving;
    if (faces && in_order) span.leave_face = mesh.faces(cell)[crossings[n + 1].face].face();
    if (field.association == mesh::Association::cells) span.front = span.back = field.values[cell];
    s.spans.push_back(span);
  }
}

void RayCaster::Impl::addCell(const Line& line, mesh::Id cell, Scratch& s) const {
  const double* values = field.association == mesh::Association::points ? field.values.data() : nullptr;
  cross(line, mesh.points, mesh.vertices(cell), shapes.patterns[shapes.of_cell[cell]], values, s.cell);
  addCrossings(cell, true, s);
}

void RayCaster::Impl::addTetrahedra(const Line& line, mesh::Id cell, Scratch& s) const {
  const double* values = tetrahedra->values.empty() ? nullptr : tetrahedra->values.data();
  for (std::size_t t = tetrahedra->offset[cell]; t < tetrahedra->offset[cell + 1]; ++t) {
    cross(line, tetrahedra->points, tetrahedra->all[t], tetrahedron, values, s.cell);
    addCrossings(cell, false, s);
  }
}

void RayCaster::Impl::addCurved(const Line& line, mesh::Id cell, Scratch& s) const {
  const bool constant = field.association == mesh::Association::cells;
  const std::size_t first = s.spans.size();
  crossCurved(line, mesh, cell, constant ? nullptr : field.values.data(), field_tolerance * (field.hi - field.lo),
              s.roots, s.spans);
  for (std::size_t n = first; constant && n < s.spans.size(); ++n)
    s.spans[n].front = s.spans[n].back = field.values[cell];
}

// Fills s.spans with everything on the ray, sorted; `eye` when nothing behind the origin is wanted.
void RayCaster::Impl::collect(const Ray& ray, const Line& line, bool eye, mesh::FieldModel model, Scratch& s) const {
  s.spans.clear();
  s.cell.reserve(shapes.most_vertices, shapes.most_edges);
  candidates.gather(ray, eye, s.cells);
  const bool tets = model == mesh::FieldModel::tets && !mesh.tetrahedral();
  const bool isoparametric = model == mesh::FieldModel::isoparametric;
  for (const mesh::Id cell : s.cells) {
    if (isoparametric && curved(mesh.cell_type[cell])) {
      addCurved(line, cell, s);
    } else if (tets) {
      addTetrahedra(line, cell, s);
    } else {
      addCell(line, cell, s);
    }
  }
  std::sort(s.spans.begin(), s.spans.end(), before);
}

Radiance RayCaster::Impl::integrate(const Line& line, const Range& range, const TransferFunction& tf,
                                    const Options& options, Scratch& s) const {
  const bool ordered = integrate::orderMatters(options.optics);
  Radiance sum;
  integrate::Gathered gathered;
  for (Span span : s.spans) {
    if (!trim(range, span)) continue;
    const double length = (span.leave - span.enter) * line.length;
    if (!ordered) {
      gather(options.optics, tf, span.front, span.back, length, gathered);
    } else {
      sum = over(sum, options.quadrature ? quadrature(tf, span.front, span.back, length)
                                         : integrate::integrate(tf, span.front, span.back, length));
    }
  }
  return ordered ? sum : radiance(options.optics, tf, gathered);
}

void RayCaster::Impl::castRow(const Rays& rays, int y, const TransferFunction& tf, const Options& options, Image& image,
                              Row& row) const {
  Scratch& s = scratch.local();
  const bool eye = !rays.view().parallel();
  const double from = eye ? 0.0 : -std::numeric_limits<double>::infinity();
  for (int x = 0; x < image.width; ++x) {
    std::array<double, 4> pixel{};
    for (int n = 0; n < options.samples; ++n) {
      const auto [px, py] = samplePosition(x, y, image.width, n, options.samples);
      const Ray ray = rays(px, py);
      const Line line = makeLine(ray, options.model);
      collect(ray, line, eye, options.model, s);
      checkContacts(mesh, field.hidden, s.spans, from, tolerances(line, options.model), row.contacts);
      row.x.resize(row.contacts.pairs.size(), px);
      row.y.resize(row.contacts.pairs.size(), py);
      row.intervals += s.spans.size();
      const Radiance radiance = integrate(line, rays.drawn(ray), tf, options, s);
      for (std::size_t c = 0; c < 3; ++c)
        pixel[c] += radiance.color[c];
      pixel[3] += radiance.alpha;
    }
    float* out = image.pixel(x, y);
    for (std::size_t c = 0; c < 4; ++c)
      out[c] = static_cast<float>(pixel[c] / options.samples);
  }
}

namespace {

// Rows one after the other, so that the result does not depend on who cast them.
void merge(const std::vector<Row>& rows, Report& report) {
  for (const Row& row : rows) {
    report.intervals += row.intervals;
    report.overlaps += row.contacts.overlaps;
    report.gaps += row.contacts.gaps;
    for (std::size_t n = 0; n < row.contacts.pairs.size(); ++n) {
      const auto& pair = row.contacts.pairs[n];
      if (report.overlapping.size() == Contacts::most_pairs) break;
      if (std::find(report.overlapping.begin(), report.overlapping.end(), pair) != report.overlapping.end()) continue;
      report.overlapping.push_back(pair);
      report.overlapping_at.push_back({row.x[n], row.y[n]});
    }
  }
}

}  // namespace

RayCaster::RayCaster(const mesh::Mesh& mesh, const mesh::Field& field) {
  const bool cells = field.association == mesh::Association::cells;
  const std::size_t expected = cells ? mesh.cell_count() : mesh.points.size();
  if (field.values.size() != expected || (!field.hidden.empty() && field.hidden.size() != mesh.cell_count())) {
    throw Error(fmt::format("{}: field '{}' has {} values for {} {}: it belongs to another mesh", mesh.name, field.name,
                            field.values.size(), expected, cells ? "cells" : "points"));
  }
  impl_ = std::make_unique<Impl>(mesh, field);
}

RayCaster::~RayCaster() = default;

Image RayCaster::render(const View& view, const TransferFunction& tf, const Options& options, Report* report) const {
  const Rays rays(view);
  impl_->prepare(options);
  Image image(view.width, view.height);
  std::vector<Row> rows(static_cast<std::size_t>(view.height));
  std::mutex mutex;
  int done = 0;
  tbb::parallel_for(tbb::blocked_range<int>(0, view.height, 1), [&](const tbb::blocked_range<int>& range) {
    for (int y = range.begin(); y < range.end(); ++y) {
      impl_->castRow(rays, y, tf, options, image, rows[static_cast<std::size_t>(y)]);
      if (!options.progress) continue;
      const std::scoped_lock lock(mutex);
      options.progress(static_cast<double>(++done) / view.height);
    }
  });
  if (report != nullptr) {
    *report = {};
    report->rays = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height) *
                   static_cast<std::size_t>(options.samples);
    merge(rows, *report);
  }
  return image;
}

void RayCaster::intervals(const View& view, double x, double y, const Options& options,
                          std::vector<Interval>& out) const {
  const Rays rays(view);
  impl_->prepare(options);
  const Ray ray = rays(x, y);
  const Line line = impl_->makeLine(ray, options.model);
  const Range range = rays.drawn(ray);
  Scratch& s = impl_->scratch.local();
  impl_->collect(ray, line, !view.parallel(), options.model, s);
  out.clear();
  for (Span span : s.spans) {
    if (!trim(range, span)) continue;
    out.push_back({span.cell, span.enter * line.length, span.leave * line.length, span.front, span.back});
  }
}

std::vector<std::uint8_t> RayCaster::edgeOnMask(const View& view) const {
  return reference::edgeOnMask(impl_->mesh, view, edge_on_width);
}

}  // namespace spillikin::reference
