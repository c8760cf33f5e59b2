// Where the pieces of cut cells lie in the image: a sliver covers few of its cell's pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/composite/native_cell.h"
#include "spillikin/composite/native_screen.h"

namespace spillikin::composite::native {

// Pixels whose centres a piece may cover, half-open; all of them where nothing better is known.
struct PixelBox {
  std::uint16_t x0 = 0, y0 = 0, x1 = UINT16_MAX, y1 = UINT16_MAX;
};

// A box for each of the order's cuts. A piece lies in its cell's convex hull and so, for each of its half-spaces, in
// the hull of the vertices inside it and the points where lines from these to the others cross its plane; the box is
// what the boxes of such hulls share. Half-spaces that keep more than half of a cell's vertices are not looked at.
// Linear in the cuts, on all cores.
void findPieces(const Screen& screen, std::vector<PixelBox>& boxes);

}  // namespace spillikin::composite::native
