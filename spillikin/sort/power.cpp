#include "spillikin/sort/power.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "spillikin/base/error.h"

namespace spillikin::sort {
namespace {

using Range = tbb::blocked_range<std::size_t>;

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// The circumcentre relative to the first corner a; the sphere passes through a, so its power at the origin o is
// |a + c|^2 - |c|^2 = |a|^2 + 2 a . c.
Vec3 circumcentre(const Vec3& u, const Vec3& v, const Vec3& w) {
  return (dot(u, u) * cross(v, w) + dot(v, v) * cross(w, u) + dot(w, w) * cross(u, v)) / (2.0 * dot(u, cross(v, w)));
}

}  // namespace

PowerSort::PowerSort(const mesh::Mesh& mesh) {
  if (!mesh.tetrahedral()) {
    throw Error(mesh.name + ": --sort power needs a mesh of tetrahedra alone; use --sort auto or --project tets");
  }
  if (!mesh.points.empty()) origin_ = mesh.points.front();
  form_.resize(mesh.cell_count());
  tbb::parallel_for(Range(0, mesh.cell_count(), 4096), [&](const Range& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      const mesh::Id* v = mesh.cell_vertex.data() + 4 * c;
      const Vec3 a = mesh.points[v[0]] - origin_;
      const Vec3 centre = circumcentre(mesh.points[v[1]] - mesh.points[v[0]], mesh.points[v[2]] - mesh.points[v[0]],
                                       mesh.points[v[3]] - mesh.points[v[0]]);
      form_[c] = Vec4(-2.0 * (a + centre), dot(a, a) + 2.0 * dot(a, centre));
    }
  });
}

void PowerSort::operator()(const Viewpoint& viewpoint, Order& order) {
  const bool parallel = viewpoint.w == 0.0;
  const Vec4 v(parallel ? Vec3(viewpoint) : Vec3(viewpoint) - origin_, parallel ? 0.0 : 1.0);
  const auto distance = [&](std::size_t c) {
    const Vec4& f = form_[c];
    return f.x * v.x + f.y * v.y + f.z * v.z + f.w * v.w;
  };
  const Ladder ladder(form_.size(), distance);
  radix_(
      form_.size(),
      [&](std::size_t begin, std::size_t end, std::uint32_t* keys) {
        for (std::size_t c = begin; c < end; ++c)
          keys[c - begin] = ladder(distance(c));
      },
      order.cells);
  // Runs of equal keys, each by the task in whose range it begins.
  const std::size_t count = form_.size();
  tbb::parallel_for(Range(0, count, 1 << 14), [&](const Range& range) {
    for (std::size_t i = range.begin(); i < range.end();) {
      const std::uint32_t key = radix_.sortedKey(i);
      std::size_t end = i + 1;
      while (end < count && radix_.sortedKey(end) == key)
        ++end;
      if (end - i > 1 && (i == 0 || radix_.sortedKey(i - 1) != key)) {
        std::sort(order.cells.begin() + static_cast<std::ptrdiff_t>(i),
                  order.cells.begin() + static_cast<std::ptrdiff_t>(end), [&](mesh::Id a, mesh::Id b) {
                    const double da = distance(a), db = distance(b);
                    return da != db ? da > db : a < b;
                  });
      }
      i = end;
    }
  });
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.exact = order.cells.size() < 2;
}

std::string PowerSort::why() const {
  return "power distances order a Delaunay tetrahedralization, which this mesh has not been shown to be";
}

std::size_t PowerSort::bytes() const {
  return form_.capacity() * sizeof(Vec4) + radix_.bytes();
}

}  // namespace spillikin::sort
