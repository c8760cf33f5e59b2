// Where rays cross one cell, in double precision: any cell, cut or whole, seen from outside or inside. The vector
// kernels' rare cases come here, and every pixel whose fragments must be put in order again.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "spillikin/composite/native_screen.h"

namespace spillikin::composite::native {

// One interval of a ray inside a cell: depths, and the scalar (as in the mesh, not scaled) at both ends.
struct Span {
  double near = 0.0, far = 0.0;
  double front = 0.0, back = 0.0;
};

// Half-open range of pixels.
struct Box {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool empty() const { return x0 >= x1 || y0 >= y1; }
  bool operator==(const Box&) const = default;
};

// Prepared for one cell, asked for many rays. Reused, it stops allocating.
class CellShape {
 public:
  // For the rays of the window's pixels, relative to whose corner coordinates are taken. `keep`: half-spaces that the
  // piece of the cell is limited to, which must last. Cost: linear in the cell's faces.
  void set(const Screen& screen, mesh::Id cell, std::span<const sort::HalfSpace> keep, const Box& window);

  // The pixels of `window` whose centres the cell may cover.
  Box pixels(const Box& window) const;

  // The intervals on the ray through image position (x, y), near to far, that are the piece's to draw, trimmed by the
  // eye and the clip planes; `out` is overwritten. Depths on a triangle are the same to the bit from both its cells.
  void spans(double x, double y, std::vector<Span>& out);

  // A boundary triangle that such rays may meet, its corners in the order of their ids.
  struct Triangle {
    std::array<mesh::Id, 3> id{};
    std::array<Vec3, 3> edge;       // the forms e_ab, e_bc, e_ca of (x, y, 1)
    std::array<Vec3, 3> size;       // the magnitudes that each of their coefficients was summed up from
    Vec3 normal{0.0};               // of the plane, in screen coordinates (x, y times the depth in perspective)
    double level = 0.0;             // normal . corner
    Vec3 depth_form{0.0};           // depth from the corners' shares, in a parallel view
    std::array<double, 3> value{};  // scalar at the corners
    double lo = 0.0, hi = 0.0;      // depths of the corners
    bool turned = false;            // outward is against the order of the ids
  };
  const std::vector<Triangle>& triangles() const { return triangles_; }
  mesh::Id cell() const { return cell_; }
  std::span<const sort::HalfSpace> keep() const { return keep_; }

 private:
  struct Crossing {
    double depth = 0.0;
    double value = 0.0;
  };
  void addTriangle(const std::array<mesh::Id, 3>& corner);
  bool positive(double at, const Vec3& size, mesh::Id a, mesh::Id b, const Vec3& ray) const;
  std::array<double, 3> exactWeights(const Triangle& triangle, const Vec3& ray) const;
  bool cross(const Triangle& triangle, const Vec3& ray, Crossing& out) const;
  void keepShare(double x, double y, std::vector<Span>& out) const;
  void trim(double x, double y, std::vector<Span>& out) const;

  const Screen* screen_ = nullptr;
  std::span<const sort::HalfSpace> keep_;
  mesh::Id cell_ = 0;
  int x0_ = 0, y0_ = 0;
  bool constant_ = false;
  double cell_value_ = 0.0;
  mesh::Surface surface_;
  std::vector<Triangle> triangles_;
  std::vector<mesh::Id> corners_;
  std::vector<Crossing> crossings_;
};

// The pixels whose centres a hull of vertices may cover, eye plane or not.
Box pixelBox(const Screen& screen, std::span<const mesh::Id> vertices, const Box& window);

}  // namespace spillikin::composite::native
