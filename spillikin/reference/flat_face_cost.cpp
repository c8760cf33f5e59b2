#include "spillikin/reference/flat_face_cost.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace spillikin::reference {
namespace {

// A cell on one ray under one model: the length inside, and the scalar's integral along it.
struct Passage {
  mesh::Id cell;
  bool curved;
  double length, integral;
};

void add(std::vector<Passage>& all, const std::vector<Interval>& intervals, bool curved) {
  for (const Interval& i : intervals) {
    const double length = i.leave - i.enter;
    all.push_back({i.cell, curved, length, 0.5 * (i.front + i.back) * length});
  }
}

// All passages of one ray, put together by cell.
void count(std::vector<Passage>& ray, std::vector<FlatFaceCost>& costs) {
  std::stable_sort(ray.begin(), ray.end(), [](const Passage& a, const Passage& b) { return a.cell < b.cell; });
  for (std::size_t n = 0; n < ray.size();) {
    const mesh::Id cell = ray[n].cell;
    double length[2]{}, integral[2]{};
    for (; n < ray.size() && ray[n].cell == cell; ++n) {
      length[ray[n].curved] += ray[n].length;
      integral[ray[n].curved] += ray[n].integral;
    }
    FlatFaceCost& cost = costs[cell];
    ++cost.rays;
    cost.length_face += length[0];
    cost.length_curved += length[1];
    cost.worst_length = std::max(cost.worst_length, std::abs(length[0] - length[1]));
    if (length[0] > 0.0 && length[1] > 0.0)
      cost.worst_scalar = std::max(cost.worst_scalar, std::abs(integral[0] / length[0] - integral[1] / length[1]));
  }
}

}  // namespace

double FlatFaceCost::relative() const {
  if (length_curved > 0.0) return std::abs(length_face - length_curved) / length_curved;
  return length_face > 0.0 ? 1.0 : 0.0;
}

std::vector<FlatFaceCost> flatFaceCost(const RayCaster& caster, const View& view, std::size_t cells) {
  std::vector<FlatFaceCost> costs(cells);
  const auto width = static_cast<std::size_t>(view.width);
  std::vector<std::vector<Passage>> row(width);  // of each pixel; reused
  Options curved;
  curved.model = mesh::FieldModel::isoparametric;
  for (int y = 0; y < view.height; ++y) {
    tbb::parallel_for(std::size_t{0}, width, [&](std::size_t x) {
      thread_local std::vector<Interval> intervals;
      row[x].clear();
      for (const bool is_curved : {false, true}) {
        caster.intervals(view, static_cast<double>(x) + 0.5, y + 0.5, is_curved ? curved : Options{}, intervals);
        add(row[x], intervals, is_curved);
      }
    });
    for (auto& ray : row)
      count(ray, costs);
  }
  return costs;
}

}  // namespace spillikin::reference
