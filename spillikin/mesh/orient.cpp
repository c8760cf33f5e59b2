// Orientation by volume. A cell's volume is that of its boundary triangles; its sign is exact.
#include <CGAL/Exact_rational.h>
#include <CGAL/Mpzf.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/predicates.h"
#include "spillikin/mesh/raw_cells.h"

namespace spillikin::mesh {
namespace {

#ifdef CGAL_HAS_MPZF
using Exact = CGAL::Mpzf;
#else
using Exact = CGAL::Exact_rational;
#endif

class Orienter {
 public:
  Orienter(const PointPool& pool, const Numbering& numbering, RawCells& cells)
      : pool_(pool), numbering_(numbering), cells_(cells) {}

  int sign(std::size_t cell) const {
    const Id* v = cells_.vertex.data() + cells_.offset[cell];
    if (cells_.type[cell] == CellType::tetrahedron) return orient3d(point(v[0]), point(v[1]), point(v[2]), point(v[3]));
    const Vec3 origin = point(v[0]);
    double volume = 0.0, size = 0.0;
    eachTriangle(cell, [&](Id a, Id b, Id c) {
      const Vec3 p = point(a) - origin, q = point(b) - origin, r = point(c) - origin;
      const double x = q.y * r.z - q.z * r.y, y = q.z * r.x - q.x * r.z, z = q.x * r.y - q.y * r.x;
      volume += p.x * x + p.y * y + p.z * z;
      size += std::abs(p.x) * (std::abs(q.y * r.z) + std::abs(q.z * r.y)) +
              std::abs(p.y) * (std::abs(q.z * r.x) + std::abs(q.x * r.z)) +
              std::abs(p.z) * (std::abs(q.x * r.y) + std::abs(q.y * r.x));
    });
    // Each product carries some 8 roundings, the sum one more per triangle: 2^-45 covers 200 triangles.
    const double error = size * 0x1p-45;
    if (size > 0x1p-900 && size < 0x1p900 && std::abs(volume) > error && trianglesOf(cell) < 200) {
      return volume > 0.0 ? 1 : -1;
    }
    return exactSign(cell);
  }

  // Swaps vertices so that the cell's faces turn round.
  void turn(std::size_t cell) {
    const std::span<Id> v = cells_.vertices(cell);
    const std::size_t half = v.size() / 2;
    switch (cells_.type[cell]) {
      case CellType::tetrahedron:
        std::swap(v[0], v[1]);
        break;
      case CellType::pyramid:
        std::swap(v[1], v[3]);
        break;
      case CellType::polyhedron:
        turnPolygons(cells_.polyhedron_index[cell]);
        break;
      default:
        std::swap_ranges(v.data(), v.data() + half, v.data() + half);  // the prisms' two ends
    }
  }

 private:
  const Vec3& point(Id vertex) const { return pool_[numbering_.point[vertex]]; }

  template <class Visit>
  void eachTriangle(std::size_t cell, const Visit& visit) const {
    cells_.forEachPolygon(cell, [&](std::span<const Id> polygon) { forEachTriangle(polygon, visit); });
  }

  void turnPolygons(Id polyhedron) {
    for (Id p = cells_.polyhedron_polygons[polyhedron]; p < cells_.polyhedron_polygons[polyhedron + 1]; ++p) {
      const std::span<Id> polygon = cells_.polygons[p];
      std::reverse(polygon.begin(), polygon.end());
    }
  }

  std::size_t trianglesOf(std::size_t cell) const {
    std::size_t count = 0;
    eachTriangle(cell, [&](Id, Id, Id) { ++count; });
    return count;
  }

  int exactSign(std::size_t cell) const {
    Exact volume(0.0);
    eachTriangle(cell, [&](Id a, Id b, Id c) {
      const auto exact = [&](Id v) {
        const Vec3& p = point(v);
        return std::array<Exact, 3>{Exact(p.x), Exact(p.y), Exact(p.z)};
      };
      const auto p = exact(a), q = exact(b), r = exact(c);
      volume = volume + p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
               p[2] * (q[0] * r[1] - q[1] * r[0]);
    });
    return static_cast<int>(CGAL::sign(volume));
  }

  const PointPool& pool_;
  const Numbering& numbering_;
  RawCells& cells_;
};

}  // namespace

void orient(const PointPool& pool, const Numbering& numbering, RawCells& cells, BuildReport& report) {
  Orienter orienter(pool, numbering, cells);
  std::atomic<std::size_t> inverted{0}, degenerate{0};
  parallelBlocks(cells.type.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
    std::size_t turned = 0, flat = 0;
    for (std::size_t c = begin; c < end; ++c) {
      if (cells.dropped[c] != 0) continue;
      const int sign = orienter.sign(c);
      if (sign < 0) orienter.turn(c), ++turned;
      if (sign == 0) cells.dropped[c] = 1, ++flat;
    }
    inverted += turned;
    degenerate += flat;
  });
  report.inverted += inverted;
  report.degenerate += degenerate;
}

}  // namespace spillikin::mesh
