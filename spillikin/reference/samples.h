// Where in a pixel its rays go.
#pragma once

#include <array>

namespace spillikin::reference {

// Image position of sample n of `count` in pixel (x, y) of an image `width` wide: the centre when count is 1; else one
// place in each of `count` cells of equal area (rows of as even a number of columns as can be), jittered by a hash of
// the pixel and n alone.
std::array<double, 2> samplePosition(int x, int y, int width, int n, int count);

}  // namespace spillikin::reference
