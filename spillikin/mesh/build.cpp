#include "spillikin/mesh/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "spillikin/base/error.h"
#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/hull.h"
#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/points.h"
#include "spillikin/mesh/quadratic.h"
#include "spillikin/mesh/raw_cells.h"

namespace spillikin::mesh {
namespace {

const char* sourceName(const Source& source) {
  return source.name.empty() ? "mesh" : source.name.c_str();
}

// What becomes of a cell of the file.
enum class Kind : std::uint8_t { lower, fixed, quadratic, convex_set, polyhedron, unsupported };
struct Plan {
  Kind kind = Kind::unsupported;
  CellType type = CellType::tetrahedron;  // of fixed cells
};

Plan plan(std::uint8_t type) {
  switch (type) {
    case vtk_cell::tetra:
      return {Kind::fixed, CellType::tetrahedron};
    // NOLINTNEXTLINE(bugprone-branch-clone): one line a type
    case vtk_cell::voxel:
      return {Kind::fixed, CellType::hexahedron};  // reordered later
    case vtk_cell::hexahedron:
      return {Kind::fixed, CellType::hexahedron};
    case vtk_cell::wedge:
      return {Kind::fixed, CellType::wedge};
    case vtk_cell::pyramid:
      return {Kind::fixed, CellType::pyramid};
    case vtk_cell::pentagonal_prism:
      return {Kind::fixed, CellType::pentagonal_prism};
    case vtk_cell::hexagonal_prism:
      return {Kind::fixed, CellType::hexagonal_prism};
    case vtk_cell::convex_point_set:
      return {Kind::convex_set};
    case vtk_cell::polyhedron:
      return {Kind::polyhedron};
    default:
      break;
  }
  if (quadraticNodes(type) > 0) return {Kind::quadratic};
  // VTK's cells of dimension 0, 1 and 2: linear, quadratic, parametric, of higher order, Lagrange, Bezier.
  constexpr std::array<std::uint8_t, 32> lower{0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  21, 22, 23, 28, 30, 34,
                                               35, 36, 51, 52, 53, 54, 60, 61, 62, 63, 68, 69, 70, 75, 76, 77};
  return std::find(lower.begin(), lower.end(), type) != lower.end() ? Plan{Kind::lower} : Plan{};
}

// The corners of a polyhedron's face stream: visit(polygon) for each face. False when the stream does not fit.
template <class Visit>
bool forEachStreamFace(std::span<const std::uint32_t> stream, const Visit& visit) {
  if (stream.empty()) return false;
  std::size_t at = 1;
  for (std::uint32_t face = 0; face < stream[0]; ++face) {
    if (at >= stream.size() || stream[at] > stream.size() - at - 1) return false;
    visit(stream.subspan(at + 1, stream[at]));
    at += 1 + stream[at];
  }
  return at == stream.size();
}

class Builder {
 public:
  Builder(const Source& source, BuildReport& report) : source_(source), report_(report), pool_(source) {}

  Mesh run() {
    report_.source_points = source_.points.size();
    report_.source_cells = source_.types.size();
    survey();
    checkConnectivity();
    markPoints();
    checkCoordinates();
    subdivideQuadratic();
    numbering_ = numberPoints(pool_, used_);
    emitFixed();
    emitQuadratic();
    emitCollapsed();
    emitIrregular();
    orient(pool_, numbering_, cells_, report_);
    Mesh mesh = arrange(pool_, numbering_, cells_);
    mesh.name = source_.name;
    report_.merged_points = numbering_.merged;
    report_.coincident_points = numbering_.coincident;
    numbering_ = {};
    if (mesh.cell_count() == 0) refuseFlat();
    const std::size_t folded = matchFaces(mesh);
    warn(folded);
    return mesh;
  }

 private:
  void survey() {
    const std::size_t n = source_.types.size();
    if (source_.offsets.size() != n + 1 || source_.offsets[n] > source_.connectivity.size()) {
      throw Error(fmt::format("{}: {} cells but {} offsets into {} ids; the file is damaged, write it again",
                              sourceName(source_), n, source_.offsets.size(), source_.connectivity.size()));
    }
    if (!source_.left_out.empty() && source_.left_out.size() != n) {
      throw Error(fmt::format("{}: {} cells but {} marks of ghost or hidden ones; the file is damaged, write it again",
                              sourceName(source_), n, source_.left_out.size()));
    }
    if (n >= none || source_.points.size() >= none) {
      throw Error(fmt::format("{}: {} cells and {} points, more than 32-bit ids can count; take a part of the mesh",
                              sourceName(source_), n, source_.points.size()));
    }
    std::array<Plan, 256> plans;
    for (std::size_t t = 0; t < plans.size(); ++t) {
      const auto type = static_cast<std::uint8_t>(t);
      plans[t] = plan(type);
      const bool fixed = plans[t].kind == Kind::fixed;
      nodes_[t] = static_cast<std::uint8_t>(fixed ? vertexCount(plans[t].type) : quadraticNodes(type));
    }
    cells_.file_id.reserve(n);
    cells_.type.reserve(n);
    for (std::size_t c = 0; c < n; ++c) {
      const Plan& p = plans[source_.types[c]];
      if (p.kind == Kind::lower) {
        ++report_.lower_dimension;
      } else if (!source_.left_out.empty() && source_.left_out[c] != 0) {
        ++report_.left_out;
      } else if (p.kind == Kind::unsupported) {
        ++report_.unsupported;
        ++report_.unsupported_types[source_.types[c]];
      } else if (p.kind == Kind::fixed) {
        cells_.file_id.push_back(static_cast<Id>(c));
        cells_.type.push_back(p.type);
      } else {
        (p.kind == Kind::quadratic ? quadratic_ : irregular_).push_back(static_cast<Id>(c));
      }
    }
    report_.quadratic = quadratic_.size();
    if (cells_.type.empty() && quadratic_.empty() && irregular_.empty()) refuseEmpty();
  }

  [[noreturn]] void refuseEmpty() const {
    throw Error(fmt::format(
        "{}: no three-dimensional cell to draw (of {} cells, {} have lower dimension, {} are ghost or "
        "hidden, {} of other types); give a volume mesh",
        sourceName(source_), report_.source_cells, report_.lower_dimension, report_.left_out, report_.unsupported));
  }

  [[noreturn]] void refuseFlat() const {
    throw Error(
        fmt::format("{}: no three-dimensional cell to draw: {} have zero volume and {} do not close; give a "
                    "volume mesh",
                    sourceName(source_), report_.degenerate, report_.unclosed));
  }

  void warn(std::size_t folded) {
    const auto say = [&](std::size_t count, const std::string& what) {
      if (count > 0) report_.warnings.push_back(fmt::format("{} {}", count, what));
    };
    for (const auto& [type, count] : report_.unsupported_types) {
      say(count, fmt::format("cells of VTK type {} are left out: this type is not drawn", type));
    }
    say(longer_, "cells name more points than their type has: the first ones count");
    say(report_.unclosed, "polyhedra are left out: their faces do not close");
    say(folded, "faces have both their cells on one side: these cells overlap");
  }

  // The cell's connectivity; of a fixed type, as many points as the type has: files exist that name more.
  std::span<const std::uint32_t> fileCell(std::size_t cell) const {
    const std::span<const std::uint32_t> all(source_.connectivity.data() + source_.offsets[cell],
                                             source_.connectivity.data() + source_.offsets[cell + 1]);
    const std::size_t nodes = nodes_[source_.types[cell]];
    return nodes > 0 ? all.first(nodes) : all;
  }

  // Calls visit with every point that the cell names.
  template <class Visit>
  bool forEachFilePoint(Id cell, const Visit& visit) const {
    if (source_.types[cell] == vtk_cell::polyhedron) {
      return forEachStreamFace(fileCell(cell), [&](std::span<const std::uint32_t> face) {
        for (const std::uint32_t p : face)
          visit(p);
      });
    }
    for (const std::uint32_t p : fileCell(cell))
      visit(p);
    return true;
  }

  template <class Visit>
  void forEachKept(const Visit& visit) const {
    for (const std::vector<Id>* list : {&cells_.file_id, &quadratic_, &irregular_}) {
      parallelFor(list->size(), [&](std::size_t i) { visit((*list)[i]); });
    }
  }

  // The first kept cell, in the order of the file, for which `bad` holds; none if there is none.
  template <class Bad>
  Id firstCell(const Bad& bad) const {
    std::atomic<Id> first{none};
    forEachKept([&](Id cell) {
      if (!bad(cell)) return;
      Id now = first.load();
      while (cell < now && !first.compare_exchange_weak(now, cell)) {
      }
    });
    return first;
  }

  bool wrongLength(Id cell) const {
    const std::uint64_t begin = source_.offsets[cell], end = source_.offsets[cell + 1];
    if (begin > end || end > source_.connectivity.size()) return true;
    if (source_.types[cell] == vtk_cell::polyhedron) return !forEachFilePoint(cell, [](std::uint32_t) {});
    return end - begin < nodes_[source_.types[cell]];
  }

  void checkConnectivity() {
    const Id wrong = firstCell([&](Id cell) { return wrongLength(cell); });
    if (wrong != none) {
      throw Error(
          fmt::format("{}: cell {} (VTK type {}) has connectivity of a wrong length ({}); the file is damaged, "
                      "write it again",
                      sourceName(source_), wrong, source_.types[wrong],
                      static_cast<std::int64_t>(source_.offsets[wrong + 1] - source_.offsets[wrong])));
    }
    const auto largest = [&](Id cell) {
      std::uint32_t id = 0;
      forEachFilePoint(cell, [&](std::uint32_t p) { id = std::max(id, p); });
      return id;
    };
    const Id outside = firstCell([&](Id cell) {
      return source_.offsets[cell] < source_.offsets[cell + 1] && largest(cell) >= source_.points.size();
    });
    if (outside != none) {
      throw Error(
          fmt::format("{}: cell {} names point {}, but there are only {} points; the file is damaged, write it "
                      "again",
                      sourceName(source_), outside, largest(outside), source_.points.size()));
    }
    std::atomic<std::size_t> longer{0};
    forEachKept([&](Id cell) {
      const std::size_t nodes = nodes_[source_.types[cell]];
      if (nodes > 0 && source_.offsets[cell + 1] - source_.offsets[cell] > nodes) ++longer;
    });
    longer_ = longer;
  }

  void markPoints() {
    used_.assign(pool_.size(), 0);
    forEachKept([&](Id cell) {
      forEachFilePoint(cell, [&](std::uint32_t p) {
        std::atomic_ref<std::uint8_t> mark(used_[p]);
        if (mark.load(std::memory_order_relaxed) == 0) mark.store(1, std::memory_order_relaxed);
      });
    });
    report_.unused_points = static_cast<std::size_t>(std::count(used_.begin(), used_.end(), 0));
  }

  void checkCoordinates() const {
    std::size_t count = 0;
    std::string first;
    for (std::size_t p = 0; p < used_.size(); ++p) {
      const Vec3& x = source_.points[p];
      if (used_[p] == 0 || (std::isfinite(x.x) && std::isfinite(x.y) && std::isfinite(x.z))) continue;
      if (++count <= 8) first += fmt::format("{}{}", first.empty() ? "" : ", ", p);
    }
    if (count > 0) {
      throw Error(fmt::format("{}: {} points have coordinates that are not finite (points {}{}); repair the file",
                              sourceName(source_), count, first, count > 8 ? ", ..." : ""));
    }
  }

  void subdivideQuadratic() {
    if (quadratic_.empty()) return;
    const Numbering by_place = numberPoints(pool_, used_);
    QuadraticCells subdivision(pool_, by_place);
    for (const Id cell : quadratic_)
      subdivision.knowCentres(source_.types[cell], fileCell(cell));
    for (const Id cell : quadratic_) {
      subdivision.subdivide(source_.types[cell], fileCell(cell), cell, linear_);
    }
    used_.resize(pool_.size(), 1);
  }

  void emitFixed() {
    const std::size_t n = cells_.type.size();
    cells_.offset.resize(n + 1);
    std::size_t total = 0;
    for (std::size_t i = 0; i < n; ++i) {
      cells_.offset[i] = static_cast<Id>(total);
      total += vertexCount(cells_.type[i]);
    }
    refuseTooMany(total + linear_.vertex.size());
    cells_.offset[n] = static_cast<Id>(total);
    cells_.vertex.resize(total);
    cells_.dropped.assign(n, 0);
    parallelFor(n, [&](std::size_t i) {
      const auto ids = fileCell(cells_.file_id[i]);
      Id* vertex = cells_.vertex.data() + cells_.offset[i];
      for (std::size_t k = 0; k < ids.size(); ++k)
        vertex[k] = numbering_.vertex[ids[k]];
      if (source_.types[cells_.file_id[i]] == vtk_cell::voxel) {
        std::swap(vertex[2], vertex[3]);
        std::swap(vertex[6], vertex[7]);
      }
    });
  }

  void emitQuadratic() {
    std::vector<Id> vertices;
    for (std::size_t i = 0; i < linear_.type.size(); ++i) {
      vertices.clear();
      for (Id k = linear_.offset[i]; k < linear_.offset[i + 1]; ++k) {
        vertices.push_back(numbering_.vertex[linear_.vertex[k]]);
      }
      cells_.add(linear_.type[i], vertices, linear_.file_id[i]);
    }
    linear_ = {};
  }

  void emitCollapsed() {
    IrregularCells irregular(numbering_, cells_, report_);
    const std::size_t n = cells_.type.size();
    parallelFor(n, [&](std::size_t i) { cells_.dropped[i] = irregular.collapsed(cells_.vertices(i)) ? 1 : 0; });
    for (std::size_t i = 0; i < n; ++i) {
      if (cells_.dropped[i] != 0) irregular.addCollapsed(i);
    }
  }

  void emitIrregular() {
    IrregularCells irregular(numbering_, cells_, report_);
    Polygons polygons;
    for (const Id cell : irregular_) {
      if (source_.types[cell] == vtk_cell::polyhedron) {
        polygons.clear();
        forEachStreamFace(fileCell(cell), [&](std::span<const std::uint32_t> face) { polygons.add(face); });
      } else {
        polygons = convexHull(pool_, fileCell(cell));
      }
      for (Id& v : polygons.vertex)
        v = numbering_.vertex[v];
      irregular.addPolyhedron(polygons, cell);
    }
    refuseTooMany(std::max(cells_.vertex.size(), cells_.polygons.vertex.size()));
  }

  void refuseTooMany(std::size_t corners) const {
    if (corners < none) return;
    throw Error(fmt::format("{}: {} cell corners, more than 32-bit ids can count; take a part of the mesh",
                            sourceName(source_), corners));
  }

  const Source& source_;
  BuildReport& report_;
  PointPool pool_;
  std::size_t longer_ = 0;                 // cells that name more points than their type has
  std::array<std::uint8_t, 256> nodes_{};  // of each VTK type; 0 where every cell has its own number
  std::vector<std::uint8_t> used_;
  std::vector<Id> quadratic_, irregular_;  // cells of the file
  LinearCells linear_;
  Numbering numbering_;
  RawCells cells_;
};

}  // namespace

Mesh build(const Source& source, BuildReport* report) {
  BuildReport scratch;
  BuildReport& out = report != nullptr ? *report : scratch;
  out = {};
  return Builder(source, out).run();
}

}  // namespace spillikin::mesh
