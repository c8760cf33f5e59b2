#include "spillikin/sort/exterior_windows.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace spillikin::sort {
namespace {

// Of a unit vector, or of the mesh's radius: far above the rounding of a dozen operations.
constexpr double rounding = 1e-14;
// World units whose squares are sure to be numbers.
constexpr double smallest = 1e-140, largest = 1e140;
// An eye so many radii from the middle sees the mesh in a cone.
constexpr double outside = 1.05;
constexpr double steps = 65530.0;  // of a component; a few are left for rounding

}  // namespace

ExteriorWindows::ExteriorWindows(const mesh::Mesh& mesh, const ExteriorTree& tree, const FacingNodes::MayFace& mayFace)
    : lower_(tree.lower()), upper_(tree.upper()), tree_levels_(tree.levels()), facing_(tree, mayFace) {
  const std::size_t count = tree.triangles().size();
  std::vector<std::uint32_t> place(mesh.points.size(), mesh::none);
  const std::size_t padded = (count + wide - 1) / wide * wide;
  corner_.resize(padded);
  for (std::size_t t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const mesh::Id v = tree.triangles()[t].corner[k];
      if (place[v] == mesh::none) {
        place[v] = static_cast<std::uint32_t>(x_.size());
        x_.push_back(mesh.points[v].x);
        y_.push_back(mesh.points[v].y);
        z_.push_back(mesh.points[v].z);
      }
      corner_[t][k] = place[v];
    }
  }
  const std::size_t points = (x_.size() + wide - 1) / wide * wide;
  for (auto* coordinate : {&x_, &y_, &z_}) {
    if (!coordinate->empty()) coordinate->resize(points, coordinate->front());
    coordinate->shrink_to_fit();
  }
  point_lower_.resize(4 * points);
  point_upper_.resize(4 * points);
  least_.resize(padded);
  greatest_.resize(padded);
  if (tree_levels_.empty()) return;
  WindowNode empty{};
  empty.earliest.fill(never);
  nodes_.assign(tree_levels_.back().first + nodesAt(tree_levels_.size() - 1), empty);
}

// False where squares of the coordinates may not be numbers.
bool ExteriorWindows::aim(const Viewpoint& viewpoint) {
  const Vec3 middle = 0.5 * lower_ + 0.5 * upper_, half = 0.5 * upper_ - 0.5 * lower_;
  const double radius = std::sqrt(glm::dot(half, half));
  if (!(radius > smallest && radius < largest)) return false;
  const DepthBands bands(lower_, upper_, viewpoint);
  frame_.farthest = bands.farthest();
  frame_.level_scale = bands.depth() > 0.0 ? (levels - 1) / bands.depth() : 0.0;
  frame_.level_room = bands.room() * frame_.level_scale;
  frame_.parallel = viewpoint.w == 0.0;
  if (frame_.parallel) {
    const Vec3 v(viewpoint);
    const double size = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(size > 0.0) || !std::isfinite(size)) return false;
    const Vec3 scaled = v / size;
    frame_.sight = scaled / std::sqrt(glm::dot(scaled, scaled));
    frame_.origin = middle;
    frame_.farthest += glm::dot(middle, frame_.sight);
    frame_.low = Vec3(-radius);
    frame_.scale = steps / (2.0 * radius);
    frame_.room = rounding * radius * frame_.scale;
    return std::isfinite(frame_.farthest);
  }
  frame_.origin = Vec3(viewpoint);
  const Vec3 away = middle - frame_.origin;
  const double distance = std::sqrt(glm::dot(away, away));
  if (!(distance < largest)) return false;
  frame_.low = Vec3(-1.0);
  double width = 2.0;
  if (distance > outside * radius) {
    // Directions differ from the middle's by no more than the chord of the cone's angle.
    const double sine = radius / distance, cosine = std::sqrt(1.0 - sine * sine);
    const double chord = sine * std::sqrt(2.0 / (1.0 + cosine));
    frame_.low = away / distance - chord;
    width = 2.0 * chord;
  }
  frame_.scale = steps / width;
  frame_.room = rounding * frame_.scale;
  return true;
}

// Every window holds everything.
void ExteriorWindows::seeNothing() {
  for (std::size_t n = 0; n < corner_.size() / wide; ++n) {
    for (std::size_t k = 0; k < 3; ++k) {
      nodes_[n].lower[k].fill(0);
      nodes_[n].upper[k].fill(std::numeric_limits<std::uint16_t>::max());
    }
  }
  std::fill(least_.begin(), least_.end(), std::uint16_t{0});
  std::fill(greatest_.begin(), greatest_.end(), static_cast<std::uint16_t>(levels - 1));
}

void ExteriorWindows::look(const Viewpoint& viewpoint) {
  if (corner_.empty() || viewpoint == viewpoint_) return;
  viewpoint_ = viewpoint;
  if (!aim(viewpoint)) {
    seeNothing();
    return;
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, x_.size() / wide, 2 * grain), [&](const auto& range) {
    const std::size_t first = wide * range.begin();
    lookAtPoints(x_.data() + first, y_.data() + first, z_.data() + first, wide * range.size(), frame_,
                 point_lower_.data() + 4 * first, point_upper_.data() + 4 * first);
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, corner_.size() / wide, grain), [&](const auto& range) {
    const std::size_t first = wide * range.begin();
    lookAtTriangles(corner_.data() + first, point_lower_.data(), point_upper_.data(), frame_, range.size(),
                    nodes_.data() + range.begin(), least_.data() + first, greatest_.data() + first);
  });
}

void ExteriorWindows::unite() {
  for (std::size_t l = 1; l < tree_levels_.size(); ++l) {
    const std::size_t below = tree_levels_[l - 1].first, count = tree_levels_[l].count;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodesAt(l), grain / 8), [&](const auto& range) {
      for (std::size_t n = range.begin(); n < range.end(); ++n)
        uniteWindows(nodes_.data() + below + wide * n, std::min(wide, count - wide * n),
                     nodes_[tree_levels_[l].first + n]);
    });
  }
}

void ExteriorWindows::meeting(std::span<const WindowQuery> queries, std::vector<WindowPair>& out) const {
  while (!queries.empty()) {
    std::size_t count = 1;
    while (count < queries.size() && queries[count].triangle / wide == queries[0].triangle / wide)
      ++count;
    searchWindows(nodes_.data(), tree_levels_.data(), tree_levels_.size(), facing_.of(queries[0].triangle / wide),
                  queries.first(count), out);
    queries = queries.subspan(count);
  }
}

std::size_t ExteriorWindows::bytes() const {
  return facing_.bytes() + nodes_.capacity() * sizeof(WindowNode) + corner_.capacity() * sizeof(corner_[0]) +
         3 * x_.capacity() * 8 +
         2 * (point_lower_.capacity() + point_upper_.capacity() + least_.capacity() + greatest_.capacity());
}

}  // namespace spillikin::sort
