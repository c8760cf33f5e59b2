// The vector kernels of rays that walk from tetrahedron to tetrahedron through their faces (Garrity 1990; Bunyk,
// Kaufman and Silva 1997): a packet of rays takes a step at a time, each ray in a cell of its own, so that nothing is
// sorted and no cell that hides behind another costs anything.
//
// A ray sees a corner as (u, v), its place on the screen from the ray's own. It crosses a face where the edge functions
// u_i v_j - v_i u_j of the face's corners, taken to the right, are all positive; over the corners' depths, they are the
// weights of the corners at the crossing. A new corner q has three edge functions with the corners of the face that the
// cell was entered by, and their signs tell the face that it is left by: q takes the place of the corner between the
// two signs. An edge function has the same bits in all cells of its edge, up to its sign, so that rays leave no gaps
// and take nothing twice.
//
// Places are whole numbers of a small share of a pixel, so that what a ray sees of near corners is as fine as float is,
// wherever on the screen it is.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_links.h"
#include "spillikin/composite/native_pixels.h"
#include "spillikin/composite/native_screen.h"

namespace spillikin::composite::native {

// A vertex: its place on the screen in shares of a pixel, from the middle of the part that is drawn; in perspective the
// inverse of its depth, in a parallel view the depth; its scalar on the frame's scale.
struct WalkPoint {
  std::int32_t x = 0, y = 0;
  float depth = 0.0F, value = 0.0F;
};

// The pieces of the transfer function that the mesh's values reach (see Piece), an array for each of their numbers.
class PieceTable {
 public:
  void set(const Screen& screen);

  std::int32_t count = 0;
  bool straight = false;  // extinction is one line over all of them
  bool jumps = false;     // some piece does not begin as the one before it ends
  std::vector<float> begin, end, anchor, extinction, extinction_slope, bent;  // begin of the first: below everything
  std::array<std::vector<float>, 3> color, color_slope, kink;
  // Half of the scalar's change along an optically thin fragment, up to which one bend needs no look at the light's
  // bow, and up to which all of them may be weighted with it (see bowLeftOut).
  float one_bend_half = 0.0F, few_bends_half = 0.0F;

 private:
  void setBendLimits();
};

// What the rays of a frame walk on.
struct WalkFrame {
  const WalkPoint* points = nullptr;
  const Link* links = nullptr;
  const Entrance* entrances = nullptr;
  const PieceTable* pieces = nullptr;
  const float* cell_values = nullptr;    // of a cell field, on the frame's scale; else null
  const std::int32_t* hidden = nullptr;  // null, or per cell, -1 where nothing of it is drawn and 0 elsewhere
  bool peaks = false;                    // see Frame
  bool clipped = false;                  // the pixels' clip limits hold
  bool parallel = false;
  bool many = false;           // more links than caches hold
  std::int32_t pixel = 1;      // shares of a pixel that places are given in
  float tolerance = 0.0F;      // of depth: a ray that goes back by more has lost its way
  std::size_t most_steps = 0;  // no ray crosses more cells
};

// Where the centre of a tile's first pixel lies, as points' places are given. Rays that lose their way at a pixel's
// centre try again a little beside it.
struct WalkPlace {
  std::int32_t x = 0, y = 0;
};

// Of `count` pixels `step` apart, the centre of the first at 0, those that may lie in [lo, hi], first and last; none if
// last < first. With room for rays beside their pixels' centres.
struct PixelRange {
  int first = 0, last = -1;
  PixelRange(std::int32_t lo, std::int32_t hi, std::int32_t step, int count) {
    const std::int32_t room = step / 128;
    if (hi + room < 0) return;
    first = lo - room <= 0 ? 0 : (lo - room + step - 1) / step;
    last = std::min((hi + room) / step, count - 1);
  }
};

// A ray that enters the mesh.
struct Start {
  float depth = 0.0F;
  std::uint32_t entrance = 0;
  std::uint32_t pixel = 0;  // pixelIndex
};

// Rays that take their steps together.
struct RayPacket {
  static constexpr std::size_t rays = 16;  // or as many as a vector holds
  template <class T>
  using PerRay = T[rays];
  // Of the face that the ray came through: its corners' places seen from the ray, depths and scalars, and the edge
  // functions opposite to them.
  alignas(64) PerRay<float> u[3], v[3], depth[3], value[3], edge[3];
  alignas(64) PerRay<std::int32_t> x, y;        // the ray's own place
  alignas(64) PerRay<float> length;             // as in Pixels
  alignas(64) PerRay<std::int32_t> ranks;       // of the three corners, and of the one ahead: see RankTable
  alignas(64) PerRay<std::int32_t> way, ahead;  // into the cell where the ray is, and the corner that is new there
  alignas(64) PerRay<std::int32_t> lost;        // -1 or 0
  alignas(64) PerRay<float> at, scalar;         // depth and scalar where the ray is
  alignas(64) PerRay<std::int32_t> piece;
  alignas(64) PerRay<float> red, green, blue, light;
  alignas(64) PerRay<float> advance;              // the least of its steps, in depth
  alignas(64) PerRay<float> clip_near, clip_far;  // the depths that clip planes leave
  alignas(64) PerRay<std::uint32_t> pixel;
  std::uint8_t live[8];  // a bit each
  std::size_t count = 0, steps = 0;
};

// Where the rays of a packet have been since they were last shaded.
struct RayPath {
  static constexpr std::size_t most = 32;
  alignas(64) float depth[most + 1][RayPacket::rays];
  alignas(64) float scalar[most + 1][RayPacket::rays];  // of a cell field, the scalar on the way there
  std::uint8_t hidden[most + 1][8];                     // a bit for each ray that came through a hidden cell
};

struct WalkScratch {
  // Enough packets at a time for their memory's latency to hide behind one another's.
  static constexpr std::size_t packets = 4;
  RayPacket packet[packets];
  RayPath path[packets];
  std::array<float, tile_pixels> left;            // depth at which the last ray of a pixel left the mesh
  std::array<std::int32_t, tile_pixels> balance;  // faces that a pixel's line enters by, less those it leaves by
};

// Appends where the rays of the pixels `wanted` enter the mesh by `faces`, indices of entrances, and counts faces in
// scratch.balance, which must be 0 where a line's faces have all been found.
void findStarts(const WalkFrame& frame, const WalkPlace& place, std::span<const std::uint32_t> faces,
                const PixelMask& wanted, WalkScratch& scratch, std::vector<Start>& out);

// Walks rays, of pixels that differ and between the pixels' clip limits (as depths here), until they leave the mesh or
// nothing shows any more, and composites what they see behind what the pixels hold. Pixels whose rays lose their way
// are flagged. Returns the fragments.
std::size_t walkRays(const WalkFrame& frame, const WalkPlace& place, std::span<const Start> starts, Pixels& pixels,
                     WalkScratch& scratch);

}  // namespace spillikin::composite::native
