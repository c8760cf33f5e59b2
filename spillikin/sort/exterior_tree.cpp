#include "spillikin/sort/exterior_tree.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

// Below this sine two directions are taken for parallel and span no plane.
constexpr double least_sine = 1e-7;
// Triangles at a plane or beyond, after which none found to meet proves nothing: large flat sides would ask for all
// pairs.
constexpr std::size_t most_asked = 128;

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
double length(const Vec3& a) {
  return std::sqrt(dot(a, a));
}

std::uint64_t spread3(std::uint64_t v) {  // 21 bits to every third place
  v &= 0x1FFFFF;
  v = (v | (v << 32)) & 0x1F00000000FFFFULL;
  v = (v | (v << 16)) & 0x1F0000FF0000FFULL;
  v = (v | (v << 8)) & 0x100F00F00F00F00FULL;
  v = (v | (v << 4)) & 0x10C30C30C30C30C3ULL;
  v = (v | (v << 2)) & 0x1249249249249249ULL;
  return v;
}

// The normal of a plane spanned by two directions, zero where they hardly span one.
Vec3 spanned(const Vec3& u, const Vec3& v) {
  const Vec3 n = cross(u, v);
  const double size = length(n);
  return size > least_sine * length(u) * length(v) ? n / size : Vec3(0.0);
}

}  // namespace

ExteriorTree::ExteriorTree(const mesh::Mesh& mesh, std::vector<ExteriorTriangle> exterior)
    : mesh_(mesh), triangles_(std::move(exterior)) {
  measure();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> codes;
  codes.reserve(triangles_.size());
  for (std::size_t i = 0; i < triangles_.size(); ++i)
    codes.emplace_back(code(i), static_cast<std::uint32_t>(i));
  std::sort(codes.begin(), codes.end());
  std::vector<ExteriorTriangle> sorted;
  sorted.reserve(triangles_.size());
  for (const auto& [code, i] : codes)
    sorted.push_back(triangles_[i]);
  triangles_.swap(sorted);
  build();
}

// Its place on a space-filling curve. After the first two levels of that come the six sides that a normal can point to,
// so that neighbours are seen from the same side and an exit shares its node with few entries.
std::uint64_t ExteriorTree::code(std::size_t triangle) const {
  const Triangle t = corners(triangle);
  std::uint64_t place = 0;
  for (int k = 0; k < 3; ++k) {
    const double middle = (t[0][k] - origin_[k] + (t[1][k] - origin_[k]) + (t[2][k] - origin_[k])) / 3.0 * scale_;
    place |= spread3(static_cast<std::uint64_t>(std::clamp((middle + 1.0) * 0x1p20, 0.0, 0x1p21 - 1.0))) << k;
  }
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    axis = std::abs(n[k]) > std::abs(n[axis]) ? k : axis;
  const std::uint64_t side = 2 * static_cast<std::uint64_t>(axis) + (n[axis] > 0.0 ? 1U : 0U);
  constexpr unsigned first = 6, all = 63, bits = 3;
  const std::uint64_t coarse = place >> (all - first), fine = place & ((std::uint64_t{1} << (all - first)) - 1);
  return (coarse << (all - first)) | (side << (all - first - bits)) | (fine >> bits);
}

// The box of all and what makes it local.
void ExteriorTree::measure() {
  lower_ = Vec3(std::numeric_limits<double>::infinity());
  upper_ = -lower_;
  for (const auto& t : triangles_) {
    for (const mesh::Id v : t.corner) {
      for (int k = 0; k < 3; ++k) {
        lower_[k] = std::min(lower_[k], mesh_.points[v][k]);
        upper_[k] = std::max(upper_[k], mesh_.points[v][k]);
      }
    }
  }
  double extent = 0.0;
  for (int k = 0; k < 3; ++k) {
    origin_[k] = triangles_.empty() ? 0.0 : 0.5 * lower_[k] + 0.5 * upper_[k];
    extent = std::max(extent, 0.5 * upper_[k] - 0.5 * lower_[k]);
  }
  scale_ = extent > 0.0 ? 1.0 / extent : 1.0;
}

void ExteriorTree::keep(const std::vector<std::uint8_t>& wanted) {
  std::vector<ExteriorTriangle> kept;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    if (wanted[t] != 0) kept.push_back(triangles_[t]);
  }
  kept.shrink_to_fit();
  triangles_.swap(kept);
  measure();
  build();
}

void ExteriorTree::build() {
  nodes_.clear();
  levels_.clear();
  struct Box {
    Vec3 lower, upper;
  };
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle t = corners(i);
    Box box{Vec3(std::numeric_limits<double>::infinity()), Vec3(-std::numeric_limits<double>::infinity())};
    for (const Vec3& p : t) {
      for (int k = 0; k < 3; ++k) {
        box.lower[k] = std::min(box.lower[k], (p[k] - origin_[k]) * scale_);
        box.upper[k] = std::max(box.upper[k], (p[k] - origin_[k]) * scale_);
      }
    }
    boxes.push_back(box);
  }
  while (!boxes.empty()) {
    const std::size_t count = boxes.size();
    levels_.push_back({nodes_.size(), count});
    std::vector<Box> parents;
    for (std::size_t i = 0; i < count; i += wide) {
      Node node{};
      Box parent = boxes[i];
      for (std::size_t j = i; j < std::min(count, i + wide); ++j) {
        for (int k = 0; k < 3; ++k) {
          parent.lower[k] = std::min(parent.lower[k], boxes[j].lower[k]);
          parent.upper[k] = std::max(parent.upper[k], boxes[j].upper[k]);
          const double centre = 0.5 * (boxes[j].lower[k] + boxes[j].upper[k]);
          const double half = 0.5 * (boxes[j].upper[k] - boxes[j].lower[k]);
          (k == 0 ? node.cx : k == 1 ? node.cy : node.cz)[j - i] = static_cast<float>(centre);
          (k == 0 ? node.hx : k == 1 ? node.hy : node.hz)[j - i] = static_cast<float>(half) * (1.0F + 0x1p-20F);
        }
      }
      nodes_.push_back(node);
      parents.push_back(parent);
    }
    if (count <= wide) break;
    boxes.swap(parents);
  }
}

TreePlane ExteriorTree::plane(std::size_t triangle) const {
  const Triangle p = corners(triangle);
  const Vec3 n = spanned(p[1] - p[0], p[2] - p[0]);
  return {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z),
          static_cast<float>(dot(n, p[0] - origin_) * scale_)};
}

bool ExteriorTree::anyBeyond(std::size_t t, const std::function<bool(std::uint32_t)>& meets) const {
  const Triangle p = corners(t);
  const TreePlane n = plane(t);
  if (n.x == 0.0F && n.y == 0.0F && n.z == 0.0F) return true;  // a sliver: rather searched for in vain
  for (int k = 0; k < 3; ++k) {                                // flat sides, as of blocks
    const double side = (k == 0 ? n.x : k == 1 ? n.y : n.z) > 0.0F ? upper_[k] : lower_[k];
    if (p[0][k] == side && p[1][k] == side && p[2][k] == side) return false;
  }
  std::size_t left = most_asked;
  // Depth first, the box that reaches farthest last, so that it is opened first.
  std::vector<std::pair<std::size_t, std::size_t>> stack{{levels_.size() - 1, 0}};
  while (!stack.empty()) {
    const auto [level, node] = stack.back();
    stack.pop_back();
    float farthest = -std::numeric_limits<float>::infinity();
    for (std::size_t box = wide * node; box < std::min(levels_[level].count, wide * (node + 1)); ++box) {
      const float height = top(level, box, n);
      if (height <= -margin) continue;
      if (level == 0) {
        if (left-- == 0 || meets(static_cast<std::uint32_t>(box))) return true;
        continue;
      }
      stack.emplace_back(level - 1, box);
      if (height > farthest) {
        farthest = height;
      } else {
        std::swap(stack.back(), stack[stack.size() - 2]);
      }
    }
  }
  return false;
}

// Appends the later triangles that t crosses.
void ExteriorTree::crossed(std::size_t t, std::vector<std::pair<std::uint32_t, std::uint32_t>>& out) const {
  const Triangle p = corners(t);
  float centre[3], half[3];
  for (int k = 0; k < 3; ++k) {
    const double low = std::min({p[0][k], p[1][k], p[2][k]}), high = std::max({p[0][k], p[1][k], p[2][k]});
    centre[k] = static_cast<float>((0.5 * low + 0.5 * high - origin_[k]) * scale_);
    half[k] = static_cast<float>((0.5 * high - 0.5 * low) * scale_) + margin;
  }
  std::vector<std::pair<std::size_t, std::size_t>> stack{{levels_.size() - 1, 0}};
  while (!stack.empty()) {
    const auto [level, node] = stack.back();
    stack.pop_back();
    const Node& boxes = nodes_[levels_[level].first + node];
    for (std::size_t j = 0; j < std::min(wide, levels_[level].count - wide * node); ++j) {
      if (std::abs(boxes.cx[j] - centre[0]) > boxes.hx[j] + half[0] ||
          std::abs(boxes.cy[j] - centre[1]) > boxes.hy[j] + half[1] ||
          std::abs(boxes.cz[j] - centre[2]) > boxes.hz[j] + half[2]) {
        continue;
      }
      const std::size_t box = wide * node + j;
      if (level > 0) {
        stack.emplace_back(level - 1, box);
      } else if (box > t && cross(p, corners(box))) {
        out.emplace_back(static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(box));
      }
    }
  }
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> ExteriorTree::crossings(std::size_t most) const {
  tbb::enumerable_thread_specific<std::vector<std::pair<std::uint32_t, std::uint32_t>>> local;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, triangles_.size(), 256),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t t = range.begin(); t < range.end(); ++t)
                        crossed(t, local.local());
                    });
  std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
  for (const auto& found : local)
    all.insert(all.end(), found.begin(), found.end());
  std::sort(all.begin(), all.end());
  if (all.size() > most) all.resize(most);
  return all;
}

std::size_t ExteriorTree::bytes() const {
  return triangles_.capacity() * sizeof(ExteriorTriangle) + nodes_.capacity() * sizeof(Node) +
         levels_.capacity() * sizeof(Level);
}

}  // namespace spillikin::sort
