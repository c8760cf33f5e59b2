#include "spillikin/composite/gl_hull.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spillikin::composite {

namespace {

constexpr float inf = std::numeric_limits<float>::infinity();
// Corners that lie further outside than this many windows are not handed to the rasterizer, whose arithmetic would move
// them by more than the margin.
constexpr float max_reach = 4.0F;
// Corners sharper than this, as 1 + cosine between the edges' normals, would stick out by more than 8 margins.
constexpr float min_miter = 1.0F / 32.0F;

struct Box {
  float x0 = inf, y0 = inf, x1 = -inf, y1 = -inf;
  void add(float x, float y) {
    x0 = std::min(x0, x);
    y0 = std::min(y0, y);
    x1 = std::max(x1, x);
    y1 = std::max(y1, y);
  }
};

// Whether [low, high], widened by the margin, contains a pixel centre, these being at `first` + 1/2 + integers.
bool hasCenter(float low, float high, float first) {
  return std::floor(high + cover_margin - first - 0.5F) >= std::ceil(low - cover_margin - first - 0.5F);
}

// The parts before the eye plane of a cell that crosses it: towards a vertex on or behind it the projection goes to
// infinity, on both sides when the vertex could be anywhere.
Box boxAcrossEyePlane(std::span<const ScreenVertex> vertices, const FrameMap& map) {
  Box box;
  for (const ScreenVertex& a : vertices) {
    const float ha = map.weight(a.depth);
    if (ha > 0.0F) {
      box.add(a.x / ha, a.y / ha);
      continue;
    }
    // Every edge to a vertex in front meets the eye plane at a point whose direction is the projection's way out.
    for (const ScreenVertex& b : vertices) {
      const float hb = map.weight(b.depth);
      if (hb <= 0.0F) {
        continue;
      }
      const float x = a.x * hb - b.x * ha;
      const float y = a.y * hb - b.y * ha;
      const float rounding =
          1e-5F * (std::fabs(a.x * hb) + std::fabs(b.x * ha) + std::fabs(a.y * hb) + std::fabs(b.y * ha));
      box.x1 = x > -rounding ? inf : box.x1;
      box.x0 = x < rounding ? -inf : box.x0;
      box.y1 = y > -rounding ? inf : box.y1;
      box.y0 = y < rounding ? -inf : box.y0;
    }
  }
  return box;
}

void fromBox(const Box& box, const Window& window, Cover& out) {
  const float x0 = std::max(box.x0 - cover_margin, window.x0 - 1.0F);
  const float y0 = std::max(box.y0 - cover_margin, window.y0 - 1.0F);
  const float x1 = std::min(box.x1 + cover_margin, window.x1 + 1.0F);
  const float y1 = std::min(box.y1 + cover_margin, window.y1 + 1.0F);
  out = {{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}};
}

float cross(const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Andrew's monotone chain, counterclockwise.
void convexHull(std::vector<ScreenPoint>& points, std::vector<ScreenPoint>& hull) {
  std::sort(points.begin(), points.end(),
            [](const ScreenPoint& a, const ScreenPoint& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  hull.clear();
  const auto chain = [&](const auto begin, const auto end) {
    const std::size_t base = hull.size();
    for (auto p = begin; p != end; ++p) {
      while (hull.size() >= base + 2 && cross(hull[hull.size() - 2], hull.back(), *p) <= 0.0F) {
        hull.pop_back();
      }
      hull.push_back(*p);
    }
    hull.pop_back();
  };
  chain(points.begin(), points.end());
  chain(points.rbegin(), points.rend());
}

// A hull of three or four corners moved out by the margin; false when a corner is too sharp for that.
bool offset(const std::vector<ScreenPoint>& hull, Cover& out) {
  const std::size_t n = hull.size();
  std::array<ScreenPoint, 4> normal;
  for (std::size_t i = 0; i < n; ++i) {
    const ScreenPoint& a = hull[i];
    const ScreenPoint& b = hull[(i + 1) % n];
    const float length = std::hypot(b.x - a.x, b.y - a.y);
    if (!(length > 0.0F)) {
      return false;
    }
    normal[i] = {(b.y - a.y) / length, (a.x - b.x) / length};
  }
  for (std::size_t i = 0; i < n; ++i) {
    const ScreenPoint& before = normal[(i + n - 1) % n];
    const ScreenPoint& after = normal[i];
    const float miter = 1.0F + before.x * after.x + before.y * after.y;
    if (miter < min_miter) {
      return false;
    }
    const float scale = cover_margin / miter;
    out[i] = {hull[i].x + scale * (before.x + after.x), hull[i].y + scale * (before.y + after.y)};
  }
  if (n == 3) {
    out[3] = out[2];
  }
  return true;
}

// The smallest rectangle along an edge of the hull, moved out by the margin.
void rectangle(const std::vector<ScreenPoint>& hull, Cover& out) {
  float best = inf;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const ScreenPoint& a = hull[i];
    const ScreenPoint& b = hull[(i + 1) % hull.size()];
    const float length = std::hypot(b.x - a.x, b.y - a.y);
    const ScreenPoint u =
        length > 0.0F ? ScreenPoint{(b.x - a.x) / length, (b.y - a.y) / length} : ScreenPoint{1.0F, 0.0F};
    Box box;  // along the edge and across it, from a
    for (const ScreenPoint& p : hull) {
      box.add((p.x - a.x) * u.x + (p.y - a.y) * u.y, (p.y - a.y) * u.x - (p.x - a.x) * u.y);
    }
    const float x0 = box.x0 - cover_margin, x1 = box.x1 + cover_margin;
    const float y0 = box.y0 - cover_margin, y1 = box.y1 + cover_margin;
    if ((x1 - x0) * (y1 - y0) < best) {
      best = (x1 - x0) * (y1 - y0);
      const auto at = [&](float x, float y) { return ScreenPoint{a.x + x * u.x - y * u.y, a.y + x * u.y + y * u.x}; };
      out = {at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)};
    }
  }
}

}  // namespace

bool cover(std::span<const ScreenVertex> vertices, const FrameMap& map, const Window& window, CoverScratch& scratch,
           Cover& out) {
  Box box;
  scratch.points.clear();
  bool behind = false;
  bool before = false;
  for (const ScreenVertex& v : vertices) {
    const float h = map.weight(v.depth);
    if (!(h > 0.0F)) {
      behind = true;
      continue;
    }
    before = true;
    const ScreenPoint p{v.x / h, v.y / h};
    scratch.points.push_back(p);
    box.add(p.x, p.y);
  }
  if (!before) {
    return false;
  }
  if (behind) {
    box = boxAcrossEyePlane(vertices, map);
  }
  box.x0 = std::max(box.x0, window.x0 - max_reach * (window.x1 - window.x0));
  box.y0 = std::max(box.y0, window.y0 - max_reach * (window.y1 - window.y0));
  box.x1 = std::min(box.x1, window.x1 + max_reach * (window.x1 - window.x0));
  box.y1 = std::min(box.y1, window.y1 + max_reach * (window.y1 - window.y0));
  if (!(box.x1 + cover_margin > window.x0 && box.x0 - cover_margin < window.x1 && box.y1 + cover_margin > window.y0 &&
        box.y0 - cover_margin < window.y1) ||
      !hasCenter(box.x0, box.x1, window.x0) || !hasCenter(box.y0, box.y1, window.y0)) {
    return false;
  }
  const bool far = std::any_of(scratch.points.begin(), scratch.points.end(), [&](const ScreenPoint& p) {
    return p.x < box.x0 || p.x > box.x1 || p.y < box.y0 || p.y > box.y1;
  });
  if (behind || far) {
    fromBox(box, window, out);
    return true;
  }
  convexHull(scratch.points, scratch.hull);
  if (scratch.hull.size() < 3 || scratch.hull.size() > 4 || !offset(scratch.hull, out)) {
    rectangle(scratch.hull, out);
  }
  return true;
}

}  // namespace spillikin::composite
