#include "spillikin/mesh/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "spillikin/base/error.h"
#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/points.h"
#include "spillikin/mesh/raw_cells.h"

namespace spillikin::mesh {
namespace {

const char* sourceName(const Source& source) {
  return source.name.empty() ? "mesh" : source.name.c_str();
}

// What becomes of a cell of the file.
enum class Kind : std::uint8_t { lower, fixed, voxel, unsupported };
struct Plan {
  Kind kind = Kind::unsupported;
  CellType type = CellType::tetrahedron;  // of fixed cells
};

Plan plan(std::uint8_t type) {
  switch (type) {
    case vtk_cell::tetra:
      return {Kind::fixed, CellType::tetrahedron};
    case vtk_cell::voxel:
      return {Kind::voxel, CellType::hexahedron};
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
    default:
      break;
  }
  // VTK's cells of dimension 0, 1 and 2, linear and of higher order.
  constexpr std::array<std::uint8_t, 24> lower{0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  21, 22,
                                               23, 28, 30, 34, 35, 36, 51, 56, 60, 61, 68, 69};
  constexpr std::array<std::uint8_t, 4> lower_bezier{70, 75, 76, 77};
  const auto in = [type](const auto& list) { return std::find(list.begin(), list.end(), type) != list.end(); };
  return in(lower) || in(lower_bezier) ? Plan{Kind::lower} : Plan{};
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
    numbering_ = numberPoints(pool_, used_);
    emit();
    orient(pool_, numbering_, cells_, report_);
    Mesh mesh = arrange(pool_, numbering_, cells_);
    mesh.name = source_.name;
    report_.merged_points = numbering_.merged;
    report_.coincident_points = numbering_.coincident;
    if (mesh.cell_count() == 0) {
      throw Error(
          fmt::format("{}: all {} three-dimensional cells have zero volume", sourceName(source_), report_.degenerate));
    }
    const std::size_t folded = matchFaces(mesh);
    if (folded > 0) {
      report_.warnings.push_back(
          fmt::format("{} faces have both their cells on one side: these cells overlap", folded));
    }
    return mesh;
  }

 private:
  void survey() {
    const std::size_t n = source_.types.size();
    if (source_.offsets.size() != n + 1 || source_.offsets[n] > source_.connectivity.size()) {
      throw Error(fmt::format("{}: {} cells but {} offsets into {} ids; the file is damaged, write it again",
                              sourceName(source_), n, source_.offsets.size(), source_.connectivity.size()));
    }
    if (n >= none || source_.points.size() >= none) {
      throw Error(fmt::format("{}: {} cells and {} points, more than 32-bit ids can count; take a part of the mesh",
                              sourceName(source_), n, source_.points.size()));
    }
    std::array<Plan, 256> plans;
    for (std::size_t t = 0; t < plans.size(); ++t)
      plans[t] = plan(static_cast<std::uint8_t>(t));
    cells_.file_id.reserve(n);
    for (std::size_t c = 0; c < n; ++c) {
      const Plan& p = plans[source_.types[c]];
      if (p.kind == Kind::lower) {
        ++report_.lower_dimension;
      } else if (!source_.left_out.empty() && source_.left_out[c] != 0) {
        ++report_.left_out;
      } else if (p.kind == Kind::unsupported) {
        ++report_.unsupported;
        ++report_.unsupported_types[source_.types[c]];
      } else {
        cells_.file_id.push_back(static_cast<Id>(c));
        cells_.type.push_back(p.type);
      }
    }
    for (const auto& [type, count] : report_.unsupported_types) {
      report_.warnings.push_back(fmt::format("{} cells of VTK type {} are not drawn", count, type));
    }
    if (cells_.type.empty()) refuseEmpty();
  }

  [[noreturn]] void refuseEmpty() const {
    throw Error(fmt::format(
        "{}: no three-dimensional cell to draw ({} cells: {} of lower dimension, {} ghost or hidden, {} of other "
        "types)",
        sourceName(source_), report_.source_cells, report_.lower_dimension, report_.left_out, report_.unsupported));
  }

  std::span<const std::uint32_t> fileCell(std::size_t cell) const {
    return {source_.connectivity.data() + source_.offsets[cell],
            source_.connectivity.data() + source_.offsets[cell + 1]};
  }

  // The first cell, in the order of the file, for which `bad` holds; none if there is none.
  template <class Bad>
  Id firstCell(const Bad& bad) const {
    std::atomic<Id> first{none};
    parallelFor(cells_.type.size(), [&](std::size_t i) {
      if (!bad(i)) return;
      Id now = first.load();
      while (cells_.file_id[i] < now && !first.compare_exchange_weak(now, cells_.file_id[i])) {
      }
    });
    return first;
  }

  void checkConnectivity() const {
    const Id wrong = firstCell([&](std::size_t i) {
      const Id c = cells_.file_id[i];
      const std::uint64_t begin = source_.offsets[c], end = source_.offsets[c + 1];
      return begin > end || end > source_.connectivity.size() || end - begin != vertexCount(cells_.type[i]);
    });
    if (wrong != none) {
      throw Error(fmt::format("{}: cell {} (VTK type {}) has {} points; the file is damaged, write it again",
                              sourceName(source_), wrong, source_.types[wrong],
                              static_cast<std::int64_t>(source_.offsets[wrong + 1] - source_.offsets[wrong])));
    }
    const Id outside = firstCell([&](std::size_t i) {
      const auto ids = fileCell(cells_.file_id[i]);
      return std::any_of(ids.begin(), ids.end(), [&](std::uint32_t p) { return p >= source_.points.size(); });
    });
    if (outside != none) {
      const auto ids = fileCell(outside);
      throw Error(
          fmt::format("{}: cell {} names point {}, but there are only {} points; the file is damaged, write it again",
                      sourceName(source_), outside, *std::max_element(ids.begin(), ids.end()), source_.points.size()));
    }
  }

  void markPoints() {
    used_.assign(pool_.size(), 0);
    parallelFor(cells_.type.size(), [&](std::size_t i) {
      for (const std::uint32_t p : fileCell(cells_.file_id[i])) {
        std::atomic_ref<std::uint8_t>(used_[p]).store(1, std::memory_order_relaxed);
      }
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
      throw Error(fmt::format("{}: {} points have coordinates that are not finite ({}{}); repair the file",
                              sourceName(source_), count, first, count > 8 ? ", ..." : ""));
    }
  }

  void emit() {
    const std::size_t n = cells_.type.size();
    cells_.offset.resize(n + 1);
    std::size_t total = 0;
    for (std::size_t i = 0; i < n; ++i) {
      cells_.offset[i] = static_cast<Id>(total);
      total += vertexCount(cells_.type[i]);
    }
    if (total >= none) {
      throw Error(fmt::format("{}: {} cell corners, more than 32-bit ids can count; take a part of the mesh",
                              sourceName(source_), total));
    }
    cells_.offset[n] = static_cast<Id>(total);
    cells_.vertex.resize(total);
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

  const Source& source_;
  BuildReport& report_;
  PointPool pool_;
  std::vector<std::uint8_t> used_;
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
