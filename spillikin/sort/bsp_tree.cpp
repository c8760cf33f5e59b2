#include "spillikin/sort/bsp_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t large_set = 24;    // fragments, from which on planes across an axis are taken
constexpr std::size_t planes_tried = 6;  // of a small set's own

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

}  // namespace

BspTree::BspTree(const ExteriorTree& exterior) : exterior_(exterior) {
  const std::size_t count = exterior.triangles().size();
  std::vector<Fragment> all;
  Vec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
  for (std::uint32_t t = 0; t < count; ++t) {
    all.push_back({t, {}});
    for (const Vec3& p : exterior.corners(t)) {
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(lower[k], p[k]);
        upper[k] = std::max(upper[k], p[k]);
      }
    }
  }
  if (count == 0) return;
  tolerance_ = thin * std::sqrt(dot(upper - lower, upper - lower));
  std::vector<Task> tasks;
  tasks.push_back({std::move(all), nothing, false});
  while (!tasks.empty()) {
    Task task = std::move(tasks.back());
    tasks.pop_back();
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    if (task.parent != nothing) (task.above ? nodes_[task.parent].above : nodes_[task.parent].below) = index;
    const Node node = choose(task.set);
    Task above{{}, index, true}, below{{}, index, false};
    for (Fragment& fragment : task.set)
      split(node, index, std::move(fragment), above.set, below.set);
    nodes_.push_back(node);
    if (!above.set.empty()) tasks.push_back(std::move(above));
    if (!below.set.empty()) tasks.push_back(std::move(below));
  }
  for (std::size_t i = nodes_.size(); i-- > 0;) {  // children come after their parents
    for (const std::uint32_t child : {nodes_[i].above, nodes_[i].below})
      nodes_[i].size += child == nothing ? 0 : nodes_[child].size;
  }
  place_.resize(nodes_.size());
  offset_.assign(count + 1, 0);
  node_of_.resize(placed_.size());
  for (const auto& [triangle, node] : placed_)
    ++offset_[triangle + 1];
  for (std::size_t t = 0; t < count; ++t)
    offset_[t + 1] += offset_[t];
  std::vector<std::uint32_t> next(offset_.begin(), offset_.end() - 1);
  for (const auto& [triangle, node] : placed_)
    node_of_[next[triangle]++] = node;
  placed_ = decltype(placed_)();  // gives the memory back, as {} would not
}

BspTree::Node BspTree::choose(const std::vector<Fragment>& set) const {
  Node node;
  if (set.size() >= large_set) {
    // The median of the middles along the axis where they spread most.
    std::vector<Vec3> middle;
    Vec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
    for (const Fragment& f : set) {
      const Triangle t = exterior_.corners(f.triangle);
      Vec3 sum(0.0);
      if (f.polygon.empty()) {
        sum = (t[0] + t[1] + t[2]) / 3.0;
      } else {
        for (const Vec3& p : f.polygon)
          sum += p;
        sum /= static_cast<double>(f.polygon.size());
      }
      middle.push_back(sum);
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(lower[k], sum[k]);
        upper[k] = std::max(upper[k], sum[k]);
      }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      axis = upper[k] - lower[k] > upper[axis] - lower[axis] ? k : axis;
    std::vector<double> values;
    values.reserve(middle.size());
    for (const Vec3& m : middle)
      values.push_back(m[axis]);
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    node.axis = static_cast<std::uint32_t>(axis);
    node.value = *half;
    // Not where it would cut much, as around a vertex of many triangles: they would never become few.
    std::size_t cut = 0;
    for (const Fragment& f : set) {
      const Triangle t = exterior_.corners(f.triangle);
      bool up = false, down = false;
      const auto look = [&](const Vec3& p) {
        up = up || p[axis] > node.value;
        down = down || p[axis] < node.value;
      };
      f.polygon.empty() ? std::for_each(t.begin(), t.end(), look)
                        : std::for_each(f.polygon.begin(), f.polygon.end(), look);
      cut += up && down ? 1U : 0U;
    }
    if (4 * cut <= set.size()) return node;
    node = Node{};
  }
  std::size_t best = std::numeric_limits<std::size_t>::max();
  const std::size_t step = std::max<std::size_t>(1, set.size() / planes_tried);
  for (std::size_t i = 0; i < set.size(); i += step) {
    const Triangle plane = exterior_.corners(set[i].triangle);
    std::size_t above = 0, below = 0, cut = 0;
    for (const Fragment& f : set) {
      bool up = false, down = false;
      for (const Vec3& p : exterior_.corners(f.triangle)) {
        const int s = mesh::orient3d(plane[0], plane[1], plane[2], p);
        up = up || s > 0;
        down = down || s < 0;
      }
      cut += up && down ? 1U : 0U;
      above += up ? 1U : 0U;
      below += down ? 1U : 0U;
    }
    const std::size_t cost = 8 * cut + std::max(above, below);
    if (cost >= best) continue;
    best = cost;
    node.triangle = set[i].triangle;
  }
  return node;
}

double BspTree::height(const Node& node, const Vec3& p) const {
  if (node.axis < 3) return p[static_cast<int>(node.axis)] - node.value;
  const Triangle t = exterior_.corners(node.triangle);
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  return dot(n, p - t[0]) / std::sqrt(dot(n, n));
}

void BspTree::split(const Node& node, std::uint32_t index, Fragment&& fragment, std::vector<Fragment>& above,
                    std::vector<Fragment>& below) {
  const Triangle t = exterior_.corners(fragment.triangle);
  bool up = false, down = false;
  if (fragment.polygon.empty()) {
    const Triangle plane = exterior_.corners(node.triangle);
    for (const Vec3& p : t) {
      const double h = node.axis < 3 ? height(node, p) : mesh::orient3d(plane[0], plane[1], plane[2], p);
      up = up || h > 0.0;
      down = down || h < 0.0;
    }
    if (up && down) fragment.polygon.assign(t.begin(), t.end());
  } else if (node.axis < 3 || node.triangle != fragment.triangle) {
    for (const Vec3& p : fragment.polygon) {
      const double h = height(node, p);
      up = up || h > tolerance_;
      down = down || h < -tolerance_;
    }
  }
  if (!up && !down) {
    placed_.emplace_back(fragment.triangle, index);
    return;
  }
  if (!up || !down) {
    (up ? above : below).push_back(std::move(fragment));
    return;
  }
  for (const bool upper : {true, false}) {
    Fragment part{fragment.triangle, {}};
    bool inside = false;
    const auto& polygon = fragment.polygon;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vec3 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
      const double hp = upper ? height(node, p) : -height(node, p), hq = upper ? height(node, q) : -height(node, q);
      inside = inside || hp > tolerance_;
      if (hp >= 0.0) part.polygon.push_back(p);
      if ((hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0)) part.polygon.push_back(p + (q - p) * (hp / (hp - hq)));
    }
    if (inside && part.polygon.size() >= 3) (upper ? above : below).push_back(std::move(part));
  }
}

std::size_t BspTree::bytes() const {
  return nodes_.capacity() * sizeof(Node) + 4 * (place_.capacity() + offset_.capacity() + node_of_.capacity());
}

}  // namespace spillikin::sort
