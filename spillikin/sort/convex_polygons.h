// Convex polygons in space and what half-spaces leave of them: their corners one after the other in one array.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// A part of the array.
struct ConvexPolygon {
  std::uint32_t begin = 0, count = 0;
  bool empty() const { return count == 0; }
};

class ConvexPolygons {
 public:
  // Forgets all. Corners within `tolerance` (world units) of a plane count as on it.
  void clear(double tolerance) {
    corners_.clear();
    tolerance_ = tolerance;
  }
  double tolerance() const { return tolerance_; }

  // The corners in their order, until the next polygon is added.
  std::span<const Vec3> operator[](ConvexPolygon p) const { return {corners_.data() + p.begin, p.count}; }

  ConvexPolygon add(std::span<const Vec3> corners);

  // What lies in the half-space: nothing where no corner does, the polygon itself where all do (Sutherland and Hodgman
  // 1974).
  ConvexPolygon clip(ConvexPolygon polygon, const HalfSpace& half);

  // 1 or -1 where the polygon lies on that side of the plane alone, 0 where on both; 2 where it lies in the plane.
  int side(ConvexPolygon polygon, const HalfSpace& half) const;

 private:
  std::vector<Vec3> corners_;
  double tolerance_ = 0.0;
};

// Of a point above the plane, along its normal.
inline double height(const HalfSpace& half, const Vec3& p) {
  return half.normal.x * p.x + half.normal.y * p.y + half.normal.z * p.z + half.offset;
}

inline HalfSpace opposite(const HalfSpace& half) {
  return {-half.normal, -half.offset};
}

}  // namespace spillikin::sort
