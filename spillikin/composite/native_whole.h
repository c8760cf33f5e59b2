// A cell of any kind as the vector kernel wants it: the lines and the planes of its boundary triangles in float,
// relative to the tile. A pixel lies on one side of the line of every edge, the same for all triangles and cells at the
// edge, so that neighbours neither both claim it nor both miss it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_cell.h"

namespace spillikin::composite::native {

struct TileView;

struct WholeCell {
  static constexpr std::size_t max_edges = 96;
  static constexpr std::size_t max_triangles = 64;
  using Form = std::array<float, 3>;  // of x, y and 1
  // A line's form, at most 1 over the tile, is off by less than this after float's rounding.
  static constexpr float unsure = 4e-7F;

  struct Triangle {
    std::uint8_t ab = 0, bc = 0, ac = 0;  // edges; the corners a, b, c in the order of their ids
    bool turned = false;                  // outward is against that order
    Form nearness{};
    float nearest = 0.0F, farthest = 0.0F;
    Form scalar{};  // the scalar is base + form (over inverse depth in perspective)
    float base = 0.0F, lo = 0.0F, hi = 0.0F;
  };

  // A half-space that a piece of a cell is limited to, by its plane's nearness: rays enter the half-space there, or
  // they leave it.
  static constexpr std::size_t max_limits = 24;
  struct Bound {
    Form nearness{};
    float rounding = 0.0F;  // of the nearness in float, anywhere on the tile
    bool entry = false;
  };

  std::array<Form, max_edges> edge;
  std::array<Triangle, max_triangles> triangle;
  std::array<Bound, max_limits> bound;
  std::size_t edge_count = 0, triangle_count = 0, bound_count = 0;
  Box blocks;  // half-open
  Look look;
  Care care = Care::full;
};

// Fills `out` from a shape of some triangles that has been set for the tile. False when the cell reaches behind the eye
// or has too many faces or limits: it must be painted pixel by pixel.
bool flatten(const TileView& view, const CellShape& shape, const Box& pixels, WholeCell& out);

// The rays of a tile as a half-space sees them: origin and direction at the tile's corner, and how they go on from
// there.
struct TileRays {
  Vec3 origin, along;
  Vec3 dx, dy;  // of the direction, or, in a parallel view, of the origin
  explicit TileRays(const TileView& view);
};

// The plane of a half-space that a piece of a cell is limited to. One seen edge-on, as those through the eye are, is
// tilted until nearness on it stays within its limit on the tile, and tells the sides of all rays but the next ones.
WholeCell::Bound boundOf(const TileView& view, const TileRays& rays, const sort::HalfSpace& keep);

}  // namespace spillikin::composite::native
