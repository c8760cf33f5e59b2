#include "spillikin/sort/simple_orders.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

namespace spillikin::sort {
namespace {

using Range = tbb::blocked_range<std::size_t>;

}  // namespace

CentroidSort::CentroidSort(const mesh::Mesh& mesh) {
  if (!mesh.points.empty()) origin_ = mesh.points.front();
  for (auto* axis : {&x_, &y_, &z_})
    axis->resize(mesh.cell_count());
  tbb::parallel_for(Range(0, mesh.cell_count(), 4096), [&](const Range& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      Vec3 sum(0.0);
      const auto vertices = mesh.vertices(static_cast<mesh::Id>(c));
      for (const mesh::Id v : vertices)
        sum += mesh.points[v] - origin_;
      sum /= static_cast<double>(vertices.size());
      x_[c] = static_cast<float>(sum.x);
      y_[c] = static_cast<float>(sum.y);
      z_[c] = static_cast<float>(sum.z);
    }
  });
}

void CentroidSort::operator()(const Viewpoint& viewpoint, Order& order) {
  const bool parallel = viewpoint.w == 0.0;
  const Vec3 local = parallel ? Vec3(viewpoint) : Vec3(viewpoint) - origin_;
  const auto vx = static_cast<float>(local.x), vy = static_cast<float>(local.y), vz = static_cast<float>(local.z);
  auto& keys = radix_.keys();
  keys.resize(x_.size());
  tbb::parallel_for(Range(0, keys.size(), 1 << 14), [&](const Range& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      const float dx = x_[c] - vx, dy = y_[c] - vy, dz = z_[c] - vz;
      const float far = parallel ? -(x_[c] * vx + y_[c] * vy + z_[c] * vz) : dx * dx + dy * dy + dz * dz;
      keys[c] = descendingKey(far);
    }
  });
  radix_(order.cells);
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.exact = order.cells.size() < 2;
}

std::size_t CentroidSort::bytes() const {
  return 3 * x_.capacity() * sizeof(float) + radix_.bytes();
}

FileOrder::FileOrder(const mesh::Mesh& mesh) : cells_(mesh.cell_count()) {
  std::iota(cells_.begin(), cells_.end(), 0U);
  std::stable_sort(cells_.begin(), cells_.end(),
                   [&](mesh::Id a, mesh::Id b) { return mesh.cell_file_id[a] < mesh.cell_file_id[b]; });
}

void FileOrder::operator()(const Viewpoint&, Order& order) {
  order.cells.assign(cells_.begin(), cells_.end());
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.exact = order.cells.size() < 2;
}

}  // namespace spillikin::sort
