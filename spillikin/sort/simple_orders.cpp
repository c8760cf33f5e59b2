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
  const auto depth = [&](std::size_t c) {
    const float dx = x_[c] - vx, dy = y_[c] - vy, dz = z_[c] - vz;
    return parallel ? -(x_[c] * vx + y_[c] * vy + z_[c] * vz) : dx * dx + dy * dy + dz * dz;
  };
  const Ladder ladder(x_.size(), depth);
  radix_(
      x_.size(),
      [&](std::size_t begin, std::size_t end, std::uint32_t* keys) {
        for (std::size_t c = begin; c < end; ++c)
          keys[c - begin] = ladder(depth(c));
      },
      order.cells);
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
