// A few dozen tetrahedra as the rasterizing loop wants them: structure of arrays, coordinates relative to the tile.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/composite/native_pixels.h"
#include "spillikin/composite/native_screen.h"

namespace spillikin::composite::native {

// A linear form of the pixel is off in float by less than this share of its terms: a few units in the last place.
inline constexpr float float_rounding = 4e-7F;

inline constexpr std::size_t batch_cells = 32;  // stays in the first level of cache beside the tile

// Fragments of a cell are optically thinner than these where it is shaded by a short series, by a long one, and by a
// short one where they are cut; and along those of the first, extinction times length changes by less than this.
inline constexpr float thin_depth = 0.25F, deep_depth = 1.0F, cut_depth = 0.125F;
inline constexpr float thin_growth = 0.25F;

// How a cell is shaded. Where extinction is linear over the whole cell: by a short series, the colour linear too, or
// bent at one place, or at several; or by a long series. Else cut where pieces of the transfer function meet, at one or
// at several places, by a short series; by a long one; or with the scalar kept within the cell's range and at any
// depth. Or nothing is integrated, only its peak is wanted. An edge-on face takes the cell out of the kernel's hands.
enum class Care : std::int32_t { none, bend, bends, long_bends, cut, cuts, deep, full, peak, edge_on };

// What a colour's bends may leave out of a fragment's light: a twentieth of a display step.
inline constexpr float bend_left_out = 2e-4F;
// The same where a line or a parabola stands for a colour that bends: a quarter of a display step.
inline constexpr float fit_left_out = 1e-3F;
inline constexpr float most_bend = 8.0F;  // so that float keeps the differences of what the pieces give

// What is left out of a bend's light at most, for each unit of opacity and of the bend times the scalar's change: where
// the light along a fragment is taken for a line, and where for a parabola (its mean, its tilt and its bow). `depth` is
// optical, at most deep_depth; `growth` is what extinction changes by times the length, `change` that without the
// length, `amid` the extinction half way. Fitted from above to quadrature over all fragments that deep.
struct LeftOut {
  static constexpr float depth_squared = 1.0F / 384, growth = 1.0F / 124;
  static constexpr float depth_cubed = 1.2e-4F, depth_growth = 5.8e-4F, growth_ratio = 2.4e-4F,
                         depth_growth_ratio = 1.2e-4F;
};
constexpr float tiltLeftOut(float depth, float growth) {
  return LeftOut::depth_squared * depth * depth + LeftOut::growth * growth;
}
constexpr float bowLeftOut(float depth, float growth, float change, float amid) {
  const float ratio = std::min(change / std::max(amid, 1e-30F), 2.0F);
  const float by_ratio = (LeftOut::growth_ratio + LeftOut::depth_growth_ratio * depth) * ratio;
  return LeftOut::depth_cubed * depth * depth * depth + growth * (LeftOut::depth_growth * depth + by_ratio);
}

// What a cell shows of the transfer function: its pieces first .. last, over the scalar's range.
struct Look {
  const Piece* pieces = nullptr;
  std::int32_t first = 0, last = 0;
  float lo = 0.0F, hi = 0.0F;

  // How a cell of at most this length along a ray is to be shaded; `steady` as long as rounding does not move the
  // scalar out of its range.
  Care care(float length, bool steady) const {
    if (!steady) return Care::full;
    if (last <= pieces[first].reach) {
      const Care straight = straightCare(length);
      if (straight != Care::full) return straight;
    }
    float most = 0.0F;
    for (std::int32_t k = first; k <= last; ++k) {
      const Piece& p = pieces[k];
      const float from = k == first ? lo : pieces[k - 1].end;
      const float to = k == last ? hi : p.end;
      most = std::max(most, p.extinction + p.extinction_slope * (from - p.anchor));
      most = std::max(most, p.extinction + p.extinction_slope * (to - p.anchor));
    }
    if (!(most * length < deep_depth)) return Care::full;
    if (!(most * length < cut_depth)) return Care::deep;
    return first == last ? Care::none : last - first == 1 ? Care::cut : Care::cuts;
  }

  // Where only the colour bends, once, and a line does for it: sets `line` to that and shows nothing else. `line` is to
  // outlive the look.
  void straighten(Piece& line) {
    const Piece& p = pieces[first];
    if (last - first != 1 || last > p.reach) return;
    const float below = p.end - lo, above = hi - p.end, range = hi - lo;
    // The line errs by `lift` times the bend at both ends and where it bends (see native_fit-inl.h).
    const float lift = 0.5F * below * above / range;
    const float bend = std::max({std::abs(p.kink[0]), std::abs(p.kink[1]), std::abs(p.kink[2])});
    if (!(bend * lift <= fit_left_out)) return;
    line = p;
    const float share = above / range;
    for (std::size_t c = 0; c < 3; ++c) {
      line.color_slope[c] += share * p.kink[c];
      line.color[c] += (lift - share * (p.end - p.anchor)) * p.kink[c];
    }
    line.reach = 0;
    pieces = &line;
    first = last = 0;
  }

 private:
  // One line of extinction.
  Care straightCare(float length) const {
    const Piece& p = pieces[first];
    const float a = p.extinction + p.extinction_slope * (lo - p.anchor);
    const float b = p.extinction + p.extinction_slope * (hi - p.anchor);
    const float depth = std::max(a, b) * length;
    if (!(depth < deep_depth)) return Care::full;
    const float change = std::abs(a - b);
    const float growth = change * length;
    const bool thin = depth < thin_depth && growth < thin_growth;
    if (first == last) return thin ? Care::none : Care::long_bends;
    const float bend = (hi - lo) * (pieces[last].bent - p.bent);
    const float left_out = bend * bowLeftOut(depth, growth, change, 0.5F * (a + b));
    if (!(bend <= most_bend && left_out <= bend_left_out)) return Care::full;
    if (!thin) return Care::long_bends;
    return last - first == 1 && bend * tiltLeftOut(depth, growth) <= bend_left_out ? Care::bend : Care::bends;
  }
};

// What shades a tetrahedron's fragments: its care, with a number of bends of its own where they are few, so that no
// branch depends on a fragment. Tiny cells (native_tiny-inl.h) and small ones (native_small-inl.h) come first.
enum class Kind : std::int32_t {
  tiny,
  tiny_curved,
  tiny_bend,
  small_curved,
  small,
  small_bends1,
  small_bends2,
  small_bends3,
  small_bends4,
  small_bends,
  none,
  bend,
  bends1,
  bends2,
  bends3,
  bends4,
  bends,
  long0,
  long1,
  long2,
  long3,
  long4,
  longs,
  kept,  // as any of these, with the scalar kept within the cell's range, which rounding moves it out of
  cut,
  cuts,
  deep,
  full,
  peak,
  edge_on
};
inline constexpr std::int32_t few_bends = 4;

inline Kind kindOf(Care care, std::int32_t bends) {
  const auto counted = [bends](Kind none, Kind many) {
    return bends > few_bends ? many : static_cast<Kind>(static_cast<std::int32_t>(none) + bends);
  };
  switch (care) {
    case Care::none:
      return Kind::none;
    case Care::bend:
      return Kind::bend;
    case Care::bends:
      return counted(Kind::bend, Kind::bends);
    case Care::long_bends:
      return counted(Kind::long0, Kind::longs);
    case Care::cut:
      return Kind::cut;
    case Care::cuts:
      return Kind::cuts;
    case Care::deep:
      return Kind::deep;
    case Care::full:
      return Kind::full;
    case Care::peak:
      return Kind::peak;
    case Care::edge_on:
      break;
  }
  return Kind::edge_on;
}

// The faces of a cell by the code of those that it is left through: entered faces first.
struct FaceOrder {
  alignas(64) std::int32_t packed[16] = {};   // the faces, two bits each
  alignas(64) std::int32_t entered[16] = {};  // how many are
  constexpr FaceOrder() {
    for (unsigned code = 0; code < 16; ++code) {
      unsigned n = 0;
      for (const unsigned left : {0U, 1U}) {
        for (unsigned f = 0; f < 4; ++f) {
          if ((code >> f & 1U) == left) packed[code] |= static_cast<std::int32_t>(f << (2 * n++));
        }
        if (left == 0) entered[code] = static_cast<std::int32_t>(n);
      }
    }
  }
};
inline constexpr FaceOrder face_order;

struct CellBatch {
  template <class T>
  using PerCell = T[batch_cells];

  // Nearness on a face: face[k][0] x + face[k][1] y + face[k][2]. The faces are set up in the order of the corners of
  // ascending id that they are opposite to, and then put in that of rays: those that are entered first.
  alignas(64) PerCell<float> face[4][3];
  alignas(64) PerCell<std::int32_t> code;  // bit k set where the cell is left through the k-th face as set up
  alignas(64) PerCell<std::int32_t> entered;
  // The scalar on the ray at depth w is at(x, y) + steepness(x, y) (w - middle) / middle, at(x, y) = at[0] x + at[1] y
  // + at[2]. In perspective steepness(x, y) = at(x, y) - apex, apex the scalar run on to the eye; in a parallel view
  // it is -apex.
  alignas(64) PerCell<float> at[3];
  alignas(64) PerCell<float> apex;
  alignas(64) PerCell<float> middle_nearness;
  alignas(64) PerCell<float> half_per_middle;  // half of 1 / middle in perspective, of 1 in a parallel view
  alignas(64) PerCell<float> lo, hi;           // range of the scalar
  alignas(64) PerCell<std::int32_t> first_piece, last_piece;
  // Where `parts`: the range of the scalar in what lies in the tile, but for rounding (see native_part-inl.h).
  alignas(64) PerCell<float> part[2];
  bool parts = false;
  alignas(64) PerCell<float> thickness;  // in depth
  alignas(64) PerCell<float> chord;      // depth that a ray gains in the cell, at most
  // Blocks of pixels that the cell's box touches, first and last; x0 > x1 where there are none. Of these, those with
  // pixels on the inner side of every line that bounds the cell on the screen: a bit each, the lower half first.
  alignas(64) PerCell<std::int32_t> block_x0, block_x1, block_y0, block_y1;
  alignas(64) PerCell<std::int32_t> blocks[2];
  alignas(64) PerCell<std::int32_t> straddles;  // the eye plane runs through the cell
  alignas(64) PerCell<float> slope;             // of nearness over the tile, on the steepest face
  alignas(64) PerCell<Kind> kind;
  alignas(64) PerCell<float> least;                                   // extent of a small cell's that proves anything
  alignas(64) PerCell<float> turn[3], depth[3], depth_square, shift;  // of small cells, see native_small-inl.h
  alignas(64) PerCell<float> per_near, per_far, tiny_origin, tiny_depth[3], half_change;  // see native_tiny-inl.h
  alignas(64) PerCell<float> origin;  // at[2] less what the cell's shader wants scalars relative to; or tiny_origin
  alignas(64) PerCell<float> uneven = {};  // how far the scalar may be from `at` and `apex`; never, in a tetrahedron
  // What small cells show, as functions of the scalar less `amid`, the middle of its range (see native_fit-inl.h).
  alignas(64) PerCell<float> amid, extinction, extinction_slope;
  alignas(64) PerCell<float> color[3], color_slope[3], color_curve[3];

  std::uint64_t blockBits(std::size_t i) const {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(blocks[1][i])) << 32U |
           static_cast<std::uint32_t>(blocks[0][i]);
  }
  Look look(const Piece* pieces, std::size_t i) const { return {pieces, first_piece[i], last_piece[i], lo[i], hi[i]}; }

  bool parallel = false;
  float eye_nearness = 0.0F;  // as near as nearness goes in float without overflow

  // Scratch of the set-up: ids of the corners, ascending, and the corners themselves, four doubles each.
  alignas(64) std::uint32_t id[4 * batch_cells];
  alignas(64) std::uint32_t sorted[4][batch_cells];
  alignas(64) PerCell<std::int32_t> odd;  // the ids' order is an odd permutation of the cell's
  alignas(64) double corner[4][4 * batch_cells];
};

// The fragments of one cell on one tile, vector by vector: where each vector lies and where its rays enter and leave.
struct Coverage {
  alignas(64) float near[tile_pixels];
  alignas(64) float far[tile_pixels];
  std::uint32_t pixel[tile_pixels + 1];  // index of the vector's first pixel
};

// One shaded fragment, kept to be composited later: premultiplied colour, and the light that it lets through.
struct Fragment {
  float near = 0.0F, far = 0.0F;  // nearness
  float red = 0.0F, green = 0.0F, blue = 0.0F, light = 1.0F;
  std::uint32_t pixel = 0;  // pixelIndex
};

// What the kernels work with between cells; one per thread. Not thread-local: the loops must know that it stays put.
struct KernelScratch {
  CellBatch batch;
  Coverage covered;
  Pixels blank;  // fragments are shaded onto it one vector at a time where they are collected rather than composited
  std::vector<std::uint16_t> left_over;  // pixels that a whole cell could not be painted on (see paintWhole)
};

}  // namespace spillikin::composite::native
