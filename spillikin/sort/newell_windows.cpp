#include "spillikin/sort/newell_windows.h"

#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "spillikin/mesh/parallel.h"

namespace spillikin::sort {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Room for the rounding of measured extents, relative to the distances involved: 32 roundings of a double, where
// differences from the viewpoint and scalar products of them suffer 8.
constexpr double slack = 0x1p-48;
// A vertex is projected where its height over the eye's plane is at least this part of its distance.
constexpr double least_height = 1.0 / 16.0;
// One image plane does for cells within 66 degrees of its middle.
constexpr double wide_height = 0.4;
constexpr std::uint32_t most_levels = 12;

float below(double x) {
  return static_cast<float>(std::max(0.0, x * (1.0 - 0x1p-23)));
}
float above(double x) {
  return static_cast<float>(std::min(1.0, x * (1.0 + 0x1p-23) + 0x1p-120));
}

// Of the points in front of a side, in its image.
struct Bounds {
  std::array<double, 2> lower{infinity, infinity}, upper{-infinity, -infinity};
  bool in_front = true;
  void add(const Bounds& b) {
    for (std::size_t k = 0; k < 2; ++k) {
      lower[k] = std::min(lower[k], b.lower[k]);
      upper[k] = std::max(upper[k], b.upper[k]);
    }
    in_front = in_front && b.in_front;
  }
};

}  // namespace

NewellWindows::Side NewellWindows::side(const Vec3& forward) const {
  const Vec3 other = std::abs(forward.x) < 0.6 ? Vec3(1.0, 0.0, 0.0) : Vec3(0.0, 1.0, 0.0);
  const Vec3 right = glm::normalize(glm::cross(forward, other));
  return {right, glm::cross(right, forward), forward, {-1.0, -1.0}, {0.5, 0.5}};
}

// One side that all points are seen on, well in front, or the six of a cube.
void NewellWindows::chooseSides() {
  sides_.assign(1, side(sight_));
  Side& whole = sides_.front();
  const auto& points = mesh_.points;
  using Range = tbb::blocked_range<std::size_t>;
  const Bounds bounds = tbb::parallel_reduce(
      Range(0, points.size(), 4096), Bounds{},
      [&](const Range& range, Bounds all) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          const Vec3 p = fromViewpoint(points[i]);
          const double z = glm::dot(p, whole.forward), scale = parallel_ ? 1.0 : 1.0 / z;
          const double x = glm::dot(p, whole.right) * scale, y = glm::dot(p, whole.up) * scale;
          all.add({{x, y}, {x, y}, parallel_ || z > wide_height * glm::length(p)});
        }
        return all;
      },
      [](Bounds a, const Bounds& b) {
        a.add(b);
        return a;
      });
  if (bounds.in_front) {
    for (std::size_t k = 0; k < 2; ++k) {
      const double extent = bounds.upper[k] - bounds.lower[k];
      whole.lower[k] = bounds.lower[k];
      whole.scale[k] = extent > 0.0 ? 1.0 / extent : 0.0;
    }
    return;
  }
  sides_.clear();
  for (int k = 0; k < 6; ++k) {
    Vec3 forward(0.0);
    forward[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
    sides_.push_back(side(forward));
  }
}

// Depths are distances from the eye, or heights along the line of sight: both grow along every ray. The farthest point
// of a cell is a vertex; its nearest is no nearer than its vertices measured along the line to their middle.
NewellWindows::Depths NewellWindows::depths(mesh::Id cell) const {
  const auto vertices = mesh_.vertices(cell);
  Vec3 axis = sight_;
  if (!parallel_) {
    axis = Vec3(0.0);
    for (const mesh::Id v : vertices)
      axis += fromViewpoint(mesh_.points[v]);
    const double length = glm::length(axis);
    axis = length > 0.0 ? axis / length : sight_;
  }
  Depths d{infinity, -infinity};
  for (const mesh::Id v : vertices) {
    const Vec3 p = fromViewpoint(mesh_.points[v]);
    const double size = glm::length(p), along = glm::dot(p, axis);
    d.nearest = std::min(d.nearest, along - slack * size);
    d.farthest = std::max(d.farthest, (parallel_ ? along : size) + slack * size);
  }
  return d;
}

// False where the cell is certainly not seen on this side.
bool NewellWindows::project(const Side& side, mesh::Id cell, Rectangle& box) const {
  double lower[2] = {infinity, infinity}, upper[2] = {-infinity, -infinity};
  bool in_front = true, outside[4] = {true, true, true, true};
  for (const mesh::Id v : mesh_.vertices(cell)) {
    const Vec3 p = fromViewpoint(mesh_.points[v]);
    const double size = glm::length(p), room = slack * size, z = glm::dot(p, side.forward);
    const double at[2] = {glm::dot(p, side.right), glm::dot(p, side.up)};
    in_front = in_front && (parallel_ || z > least_height * size);
    for (std::size_t k = 0; k < 2; ++k) {
      outside[2 * k] = outside[2 * k] && at[k] - z > room;
      outside[2 * k + 1] = outside[2 * k + 1] && -at[k] - z > room;
      const double image = parallel_ ? at[k] : at[k] / z;
      const double image_room = parallel_ ? room : slack * (size / z) * (size / z);
      lower[k] = std::min(lower[k], image - image_room);
      upper[k] = std::max(upper[k], image + image_room);
    }
  }
  box = {{0.0F, 0.0F}, {1.0F, 1.0F}};
  if (!in_front) return !(outside[0] || outside[1] || outside[2] || outside[3]);
  for (std::size_t k = 0; k < 2; ++k) {
    const double from = (lower[k] - side.lower[k]) * side.scale[k], to = (upper[k] - side.lower[k]) * side.scale[k];
    if (from > 1.0 + slack || to < -slack) return false;
    box.lower[k] = std::min(1.0F, below(from));
    box.upper[k] = std::max(0.0F, above(to));
  }
  return true;
}

void NewellWindows::sortByDepth() {
  const std::size_t count = mesh_.cell_count();
  const Ladder ladder(count, [&](std::size_t c) { return depths(static_cast<mesh::Id>(c)).farthest; });
  nearest_.resize(count);
  radix_(
      count,
      [&](std::size_t begin, std::size_t end, std::uint32_t* keys) {
        for (std::size_t c = begin; c < end; ++c) {
          const Depths d = depths(static_cast<mesh::Id>(c));
          keys[c - begin] = ladder(d.farthest);
          nearest_[c] = ladder(d.nearest);
        }
      },
      cells_);
}

void NewellWindows::findFootprints() {
  const std::size_t count = mesh_.cell_count();
  first_.resize(count + 1);
  seen_on_.assign(count, 1);
  if (sides_.size() > 1) {
    mesh::parallelFor(count, [&](std::size_t c) {
      Rectangle box;
      unsigned seen = 0;
      for (std::size_t s = 0; s < sides_.size(); ++s)
        seen |= project(sides_[s], static_cast<mesh::Id>(c), box) ? 1U << s : 0U;
      seen_on_[c] = static_cast<std::uint8_t>(seen);
    });
  }
  first_[0] = 0;
  for (std::size_t c = 0; c < count; ++c)
    first_[c + 1] = first_[c] + static_cast<std::uint32_t>(__builtin_popcount(seen_on_[c]));
  footprint_.resize(first_[count]);
  mesh::parallelFor(count, [&](std::size_t c) {
    std::uint32_t at = first_[c];
    for (std::size_t s = 0; s < sides_.size(); ++s) {
      if (((seen_on_[c] >> s) & 1U) == 0) continue;
      Footprint& f = footprint_[at++];
      project(sides_[s], static_cast<mesh::Id>(c), f.box);
      f.side = static_cast<std::uint8_t>(s);
      place(f);
    }
  });
}

// The level whose windows are just not smaller, and there the window of the lower corner.
void NewellWindows::place(Footprint& f) const {
  double width = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    width = std::max(width, static_cast<double>(f.box.upper[k]) - static_cast<double>(f.box.lower[k]));
  std::uint32_t level = levels_ - 1;
  while (level > 0 && std::ldexp(width, static_cast<int>(level)) > 1.0)
    --level;
  const std::uint32_t side = 1U << level;
  const auto window = [&](std::size_t k) {
    return std::min(side - 1, static_cast<std::uint32_t>(f.box.lower[k] * static_cast<float>(side)));
  };
  f.level = static_cast<std::uint8_t>(level);
  f.window = static_cast<std::uint32_t>(f.side * windowsOfSide() + windowsBefore(level) +
                                        std::size_t{window(1)} * side + window(0));
}

// Counts, and then the cells of the list one by one, so that every window has its farthest first.
void NewellWindows::fill() {
  window_.assign(sides_.size() * windowsOfSide(), {0, 0});
  waiting_.assign(sides_.size() * levels_, 0);
  for (const Footprint& f : footprint_) {
    ++window_[f.window].end;
    ++waiting_[f.side * levels_ + f.level];
  }
  std::uint32_t begin = 0;
  for (Window& w : window_) {
    w.head = begin;
    begin += w.end;
    w.end = w.head;
  }
  entry_.resize(footprint_.size());
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const mesh::Id c = cells_[i];
    for (std::uint32_t f = first_[c]; f < first_[c + 1]; ++f)
      entry_[window_[footprint_[f].window].end++] = {footprint_[f].box, radix_.sortedKey(i), c};
  }
}

void NewellWindows::operator()(const Viewpoint& viewpoint) {
  parallel_ = viewpoint.w == 0.0;
  Vec3 middle(0.0);
  for (const Vec3& p : mesh_.points)
    middle += p / static_cast<double>(mesh_.points.size());
  const Vec3 given(viewpoint);
  origin_ = parallel_ ? middle : given;
  sight_ = parallel_ ? -given : middle - given;
  const double largest = std::max({std::abs(sight_.x), std::abs(sight_.y), std::abs(sight_.z)});
  sight_ = largest > 0.0 ? glm::normalize(sight_ / largest) : Vec3(0.0, 0.0, -1.0);
  chooseSides();
  levels_ = 1;
  while (levels_ < most_levels && (sides_.size() << (2 * levels_)) < mesh_.cell_count())
    ++levels_;
  sortByDepth();
  findFootprints();
  fill();
  listed_.assign(mesh_.cell_count(), 0);
}

void NewellWindows::list(mesh::Id cell) {
  listed_[cell] = 1;
  for (std::uint32_t f = first_[cell]; f < first_[cell + 1]; ++f)
    --waiting_[footprint_[f].side * levels_ + footprint_[f].level];
}

NewellWindows::Search NewellWindows::search(mesh::Id cell) const {
  Search s{};
  s.cell = cell;
  s.footprint = first_[cell];
  if (s.footprint == first_[cell + 1] || !openLevel(s)) s.footprint = first_[cell + 1];
  return s;
}

// From its level on, the next with cells that wait; the windows there that they may lie in. False past the last.
bool NewellWindows::openLevel(Search& s) const {
  for (; s.footprint < first_[s.cell + 1]; ++s.footprint, s.level = 0) {
    const Footprint& f = footprint_[s.footprint];
    while (s.level < levels_ && waiting_[f.side * levels_ + s.level] == 0)
      ++s.level;
    if (s.level == levels_) continue;
    const std::uint32_t side = 1U << s.level;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto from = static_cast<std::uint32_t>(f.box.lower[k] * static_cast<float>(side));
      s.first[k] = from == 0 ? 0 : std::min(from, side) - 1;
      s.last[k] = std::min(side - 1, static_cast<std::uint32_t>(f.box.upper[k] * static_cast<float>(side)));
    }
    s.x = s.first[0];
    s.y = s.first[1];
    return true;
  }
  return false;
}

// The next window with cells that wait. False past the last of the last level.
bool NewellWindows::openWindow(Search& s) {
  while (s.footprint < first_[s.cell + 1]) {
    const Footprint& f = footprint_[s.footprint];
    Window* const level = window_.data() + f.side * windowsOfSide() + windowsBefore(s.level);
    for (; s.y <= s.last[1]; ++s.y, s.x = s.first[0]) {
      for (; s.x <= s.last[0]; ++s.x) {
        Window& w = level[(std::size_t{s.y} << s.level) + s.x];
        while (w.head < w.end && listed_[entry_[w.head].cell] != 0)
          ++w.head;
        if (w.head == w.end) continue;
        s.at = w.head;
        s.end = w.end;
        ++s.x;
        return true;
      }
    }
    ++s.level;
    if (!openLevel(s)) return false;
  }
  return false;
}

mesh::Id NewellWindows::next(Search& s) {
  const std::uint32_t nearest = nearest_[s.cell];
  while (true) {
    if (s.at == s.end && !openWindow(s)) return mesh::none;
    const Rectangle& box = footprint_[s.footprint].box;
    for (; s.at < s.end; ++s.at) {
      const Entry& e = entry_[s.at];
      if (e.farthest > nearest) break;  // test 1, for it and all that follow in this window
      if (e.box.upper[0] < box.lower[0] || box.upper[0] < e.box.lower[0]) continue;  // test 2
      if (e.box.upper[1] < box.lower[1] || box.upper[1] < e.box.lower[1]) continue;  // test 3
      if (e.cell == s.cell || listed_[e.cell] != 0) continue;
      ++s.at;
      return e.cell;
    }
    s.at = s.end;
  }
}

std::size_t NewellWindows::bytes() const {
  return radix_.bytes() + cells_.capacity() * 4 + nearest_.capacity() * 4 + seen_on_.capacity() +
         first_.capacity() * 4 + footprint_.capacity() * sizeof(Footprint) + entry_.capacity() * sizeof(Entry) +
         window_.capacity() * sizeof(Window) + waiting_.capacity() * 4 + listed_.capacity();
}

}  // namespace spillikin::sort
