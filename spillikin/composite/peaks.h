// The largest scalar on each ray, and its colour (integrate::Optics::mip).
#pragma once

#include "spillikin/base/image.h"
#include "spillikin/composite/compositor.h"

namespace spillikin::composite {

// Backends gather the largest scalar, on [0, 1] over the field's range as they have their scalars, as an image's red,
// with an alpha of 1 where the ray meets a cell and 0 elsewhere. Puts its colour in its place. A scalar that rounding
// has moved off a point of the transfer function is taken to be at the point, so that it stays on its side of a jump.
void colorPeaks(const Frame& frame, Image& image);

}  // namespace spillikin::composite
