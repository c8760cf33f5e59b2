#include "spillikin/sort/mpvonc.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "spillikin/sort/strong_components.h"

namespace spillikin::sort {

Mpvonc::Mpvonc(const mesh::Mesh& mesh)
    : mesh_(mesh),
      signs_(mesh),
      layered_(mesh),
      problems_(mesh, signs_, CurvedCells::cut),
      exterior_(exteriorTriangles(mesh)),
      row_(exteriorRows(mesh, signs_, exterior_)),
      turn_(mesh.cell_count()) {
  if (!mesh.points.empty()) lower_ = upper_ = mesh.points.front();
  for (const Vec3& p : mesh.points) {
    for (int k = 0; k < 3; ++k) {
      lower_[k] = std::min(lower_[k], p[k]);
      upper_[k] = std::max(upper_[k], p[k]);
    }
  }
}

void Mpvonc::firstTurns(const Viewpoint& viewpoint) {
  const DepthBands bands(lower_, upper_, viewpoint);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, turn_.size(), 1 << 16), [&](const auto& range) {
    std::fill(turn_.begin() + static_cast<std::ptrdiff_t>(range.begin()),
              turn_.begin() + static_cast<std::ptrdiff_t>(range.end()), Turn{0});
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, exterior_.size(), 2048),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        if (signs_.sign(row_[i]) >= 0) continue;  // rays leave through faces turned away
                        const auto& c = exterior_[i].corner;
                        const Triangle t{mesh_.points[c[0]], mesh_.points[c[1]], mesh_.points[c[2]]};
                        raise(turn_[exterior_[i].cell], bands.latest(t));
                      }
                    });
}

double Mpvonc::nearness(mesh::Id cell, const Viewpoint& viewpoint) const {
  Vec3 mean(0.0);
  const auto vertices = mesh_.vertices(cell);
  for (const mesh::Id v : vertices)
    mean += mesh_.points[v] / static_cast<double>(vertices.size());
  const Vec3 sight(viewpoint), away = mean - sight;
  return viewpoint.w == 0.0 ? mean.x * sight.x + mean.y * sight.y + mean.z * sight.z
                            : -(away.x * away.x + away.y * away.y + away.z * away.z);
}

// Cells in cycles and those behind them: a strong component has one turn, the latest of its cells and of those before,
// and is listed by the distance of its cells' means.
void Mpvonc::appendLeft(const Viewpoint& viewpoint, Order& order) {
  std::vector<mesh::Id> left, index(mesh_.cell_count(), mesh::none);
  for (mesh::Id c = 0; c < mesh_.cell_count(); ++c) {
    if (!layered_.left(c)) continue;
    index[c] = static_cast<mesh::Id>(left.size());
    left.push_back(c);
  }
  const auto components = strongComponents(static_cast<std::uint32_t>(left.size()), [&](std::uint32_t i, auto&& f) {
    layered_.forEachAfter(left[i], [&](mesh::Id next) { f(index[next]); });
  });
  std::vector<std::pair<double, mesh::Id>> cells;
  for (std::size_t k = 0; k < components.size(); ++k) {
    const std::span<const std::uint32_t> component = components[k];
    Turn turn = 0;
    for (const std::uint32_t i : component)
      turn = std::max(turn, turn_[left[i]]);
    cells.clear();
    for (const std::uint32_t i : component) {
      const mesh::Id cell = left[i];
      turn_[cell] = turn;
      layered_.forEachAfter(cell, [&](mesh::Id next) { turn_[next] = std::max(turn_[next], turn); });
      cells.emplace_back(component.size() > 1 ? nearness(cell, viewpoint) : 0.0, cell);
    }
    std::sort(cells.begin(), cells.end());
    if (cells.size() > 1) order.cycles.emplace_back();
    for (const auto& [depth, cell] : cells) {
      order.cells.push_back(cell);
      if (cells.size() > 1) order.cycles.back().push_back(cell);
    }
  }
}

void Mpvonc::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cuts.clear();
  order.cycles.clear();
  signs_(viewpoint);
  problems_.begin(order);
  firstTurns(viewpoint);
  if (!layered_(signs_, order, nullptr, turn_.data())) appendLeft(viewpoint, order);
  by_turn_(turn_, order.cells);
  order.layer_offset.clear();
  order.exact = order.cells.size() < 2;
}

std::size_t Mpvonc::bytes() const {
  return signs_.bytes() + layered_.bytes() + problems_.bytes() + by_turn_.bytes() +
         exterior_.capacity() * sizeof(ExteriorTriangle) + row_.capacity() * sizeof(std::size_t) +
         turn_.capacity() * sizeof(Turn);
}

}  // namespace spillikin::sort
