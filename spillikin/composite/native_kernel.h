// The vector kernels' door: whole runs of tetrahedra onto one tile, for the best instruction set the machine has.
//
// A tetrahedron's faces are planes, whose nearness (see Depths) is linear in the pixel: a ray enters where the last of
// the planes it enters by is crossed and leaves at the first it leaves by. The planes' coefficients are computed in
// double precision from the corners in the order of their ids, so that both cells of a face get the same bits and
// thicknesses along a ray add up to the chord.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_bins.h"
#include "spillikin/composite/native_pixels.h"
#include "spillikin/composite/native_screen.h"

namespace spillikin::composite::native {

struct WholeCell;

// What a kernel hands back in its turn: a cell with a face seen so nearly edge-on that its plane does not tell on which
// side a pixel lies, or the pixels on which a whole cell has more than one interval.
struct HandBack {
  void (*take)(void* self, Entry entry) = nullptr;
  void (*take_pixels)(void* self, Entry entry, std::span<const std::uint16_t> pixels) = nullptr;
  void* self = nullptr;
};

// Nearness beyond this many times the mesh's is as good as infinite, and still squares within float.
inline constexpr double nearness_limit = 1e12;

// What a run of cells is painted with. All of it outlives the call.
struct TileView {
  const Screen* screen = nullptr;
  int x0 = 0, y0 = 0;           // the tile's corner
  int width = 0, height = 0;    // the part of the tile that lies in the image
  float longest = 1.0F;         // world length of a unit of depth: the largest over the tile's pixels
  double nearness_scale = 1.0;  // how near the mesh is, roughly
  float rounding = 0.0F;        // of a depth in float, as a share of it (as a depth, in a parallel view)
  float overlap_at = 0.0F, overlap_slope = 0.0F;
  // What a cell's kernel begins with, ready to be spread over a vector: depths' z0; a fragment is solid where near >
  // solid_slope far + solid_at, and early where near > early_slope last + overlap_at.
  float z0 = 0.0F, early_slope = 1.0F, solid_at = 0.0F, solid_slope = 1.0F;
  float steepest = 0.0F;  // more nearness a tile than this, and a plane is edge-on (a share of the cell's, if relative)
  bool relative = false;  // nearness is plain inverse depth
  HandBack hand_back;
  std::span<const PixelBox> pieces;  // of the order's cuts
  bool clipped = false;              // the clip planes' limits in the pixels must be kept
  bool peaks = false;                // see Frame
  bool trusted = false;              // the order is exact: what lies behind an opaque pixel needs no look
};

// Clears the pixels of a tile and sets the lengths of their rays; the clip planes' limits are left as they are.
void clearPixels(const TileView& view, Pixels& pixels);

// Writes the tile's pixels as premultiplied RGBA: rows of `width` pixels, `stride` floats apart.
void storePixels(const Pixels& pixels, int width, int height, float* out, std::size_t stride);
// The same of a tile that no cell covers.
void storeBlank(int width, int height, float* out, std::size_t stride);

// Composites the tetrahedra, nearest first; none of the entries is a cut. Returns the fragments drawn. Stops early
// where every pixel is opaque and the order is trusted.
std::size_t paintTetrahedra(const TileView& view, std::span<const Entry> entries, Pixels& pixels,
                            KernelScratch& scratch);

// Shades the tetrahedra's fragments on the pixels `wanted` and appends them to `out`, in the order of the entries.
// False, with part of them in `out`, once there are more than `most` of them. Overwrites Pixels::live.
bool collectTetrahedra(const TileView& view, std::span<const Entry> entries, const PixelMask& wanted, Pixels& pixels,
                       KernelScratch& scratch, std::size_t most, std::vector<Fragment>& out);

// Appends the fragments of one cell of any kind on the pixels `wanted` to `out`; scratch.left_over as with paintWhole.
void collectWhole(const TileView& view, const WholeCell& cell, const PixelMask& wanted, const Pixels& pixels,
                  KernelScratch& scratch, std::vector<Fragment>& out);

// Composites one cell of any kind, or a piece of one. The pixels on which it has more than one interval, or where float
// cannot tell, are left alone and put into scratch.left_over.
std::size_t paintWhole(const TileView& view, const WholeCell& cell, Pixels& pixels, KernelScratch& scratch);

// Marks the pixels to which no more cells need come (see Pixels::live); true when that is all of them.
bool markOpaque(Pixels& pixels);

// The tiles of `region` that the tetrahedra first <= c < last may cover, into boxes[c]; unknown_tiles for one that
// reaches behind the eye. Returns where it stopped, short of a full vector before `last`.
std::size_t boxTetrahedra(const Place* places, const mesh::Id* corners, const Box& region, std::size_t first,
                          std::size_t last, TileBox* boxes);

// The instruction sets compiled in that this machine has, best first, and the choice of one by tests: index into that
// list, or -1 for the best again.
std::vector<const char*> kernelTargets();
void chooseKernelTarget(int index);

}  // namespace spillikin::composite::native
