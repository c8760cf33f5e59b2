// Cells that the eye plane, a clip plane or a half-space of a cut trims, and cells that are not convex.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/project/cell_on_screen.h"
#include "spillikin/project/regions.h"
#include "spillikin/sort/sort.h"

namespace spillikin::project {

// Trimming shortens the ray's segment and leaves the field as it is: linear between the triangle where the untrimmed
// ray enters, be it behind the eye, and the one where it leaves. So no new polyhedron is made. For each pair of an
// entry and an exit triangle the image positions whose lines cross both make a convex polygon, inside or behind the eye
// alike: a line through the eye meets a triangle where three determinants of homogeneous corners have one sign. Every
// plane's depth is a quotient of functions linear in x and y of which one is constant, so that two planes change order
// on a straight line; cutting the polygon along these lines leaves regions with one front and one back end.
//
// Computed in double without exact predicates: neighbouring regions meet to within rounding. Only the part in the
// image, one pixel larger on every side, is made, which keeps what comes near the eye plane small. Cost: the pairs of
// triangles that some ray crosses, times the planes.
class TrimmedProjection {
 public:
  // Appends the regions of `cell` inside all of `planes`.
  void operator()(const CellOnScreen& cell, const Camera& camera, std::span<const sort::HalfSpace> planes,
                  Regions& out);

 private:
  using Form = Vec3;  // a x + b y + c of an image position
  using Polygon = std::vector<Vec2>;

  // A depth as the quotient of two forms, one of which is constant.
  struct Limit {
    Form numerator{0.0}, denominator{0.0, 0.0, 1.0};
    std::int32_t end = ends_at_triangle;
    double depth(const Vec2& p) const;
  };
  struct Triangle {
    std::array<Form, 3>
        edge;  // opposite to each corner; all <= 0 where a ray enters through it, all >= 0 where it leaves
    Form sum{0.0};
    double determinant = 0.0;
    Limit limit;
    double near = 0.0, far = 0.0;  // depths of its corners
  };
  struct Pair {
    std::uint32_t entry = 0, exit = 0;
    Limit front, back;
  };

  static double at(const Form& form, const Vec2& p) { return form.x * p.x + form.y * p.y + form.z; }
  static bool constant(const Form& form) { return form.x == 0.0 && form.y == 0.0; }
  static Form order(const Limit& first, const Limit& second, const Vec2& somewhere);

  void setTriangles(const CellOnScreen& cell);
  void setPlanes(const Camera& camera, std::span<const sort::HalfSpace> planes);
  bool convex(const CellOnScreen& cell) const;
  Polygon& scratch(std::size_t level);
  bool cut(const Polygon& in, const Form& keep, Polygon& out) const;
  void splitByEdges(const Pair& pair, std::size_t edge, std::size_t level);
  void trimByPlanes(const Pair& pair, std::size_t plane, std::size_t level);
  void trimFront(const Pair& pair, std::size_t plane, std::size_t level);
  void trimBack(const Pair& pair, std::size_t plane, std::size_t level);
  bool consecutive(const Pair& pair, const Polygon& polygon) const;
  void emit(const Pair& pair, std::size_t level);
  Sample onTriangle(std::uint32_t triangle, const Vec2& p) const;

  const CellOnScreen* cell_ = nullptr;
  const Camera* camera_ = nullptr;
  Regions* out_ = nullptr;
  bool convex_ = true;
  std::vector<Triangle> triangles_;
  std::vector<Limit> planes_;
  std::vector<Polygon> scratch_;  // one polygon per level of the recursion
};

}  // namespace spillikin::project
