#include "spillikin/sort/power.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

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
  for (auto* coefficient : {&x_, &y_, &z_, &w_})
    coefficient->resize(mesh.cell_count());
  tbb::parallel_for(Range(0, mesh.cell_count(), 4096), [&](const Range& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      const mesh::Id* v = mesh.cell_vertex.data() + 4 * c;
      const Vec3 a = mesh.points[v[0]] - origin_;
      const Vec3 centre = circumcentre(mesh.points[v[1]] - mesh.points[v[0]], mesh.points[v[2]] - mesh.points[v[0]],
                                       mesh.points[v[3]] - mesh.points[v[0]]);
      x_[c] = static_cast<float>(-2.0 * (a.x + centre.x));
      y_[c] = static_cast<float>(-2.0 * (a.y + centre.y));
      z_[c] = static_cast<float>(-2.0 * (a.z + centre.z));
      w_[c] = static_cast<float>(dot(a, a) + 2.0 * dot(a, centre));
    }
  });
}

void PowerSort::operator()(const Viewpoint& viewpoint, Order& order) {
  const Vec3 local = viewpoint.w == 0.0 ? Vec3(viewpoint) : Vec3(viewpoint) - origin_;
  const auto vx = static_cast<float>(local.x), vy = static_cast<float>(local.y), vz = static_cast<float>(local.z);
  const float vw = viewpoint.w == 0.0 ? 0.0F : 1.0F;
  auto& keys = radix_.keys();
  keys.resize(x_.size());
  tbb::parallel_for(Range(0, keys.size(), 1 << 14), [&](const Range& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      keys[c] = descendingKey(x_[c] * vx + y_[c] * vy + z_[c] * vz + w_[c] * vw);
    }
  });
  radix_(order.cells);
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.exact = order.cells.size() < 2;
}

std::string PowerSort::why() const {
  return "power distances order a Delaunay tetrahedralization, which this mesh has not been shown to be";
}

std::size_t PowerSort::bytes() const {
  return 4 * x_.capacity() * sizeof(float) + radix_.bytes();
}

}  // namespace spillikin::sort
