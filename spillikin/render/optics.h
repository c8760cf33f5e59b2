// Looks under other optical models, drawn as absorption and emission of a changed look.
#pragma once

#include "spillikin/base/image.h"
#include "spillikin/integrate/optics.h"
#include "spillikin/integrate/transfer_function.h"

namespace spillikin::render {

// What is composited, and what must be done to the picture.
struct Rendition {
  integrate::TransferFunction look;
  bool order_matters = true;
  bool peaks = false;  // composite::Frame's
  // Of the picture's colours; its alpha is to be nothing where that is not 1. A gas that only glows is one so thin that
  // it hides nothing, and brighter by as much.
  double gain = 1.0;
};

// Of a mesh of this extent, in world units. An emission errs by at most half of `hidden`, as a share of itself.
inline constexpr double hidden = 1e-5;
Rendition rendition(integrate::Optics optics, const integrate::TransferFunction& look, double extent);

// Applies the gain, on all cores.
void develop(const Rendition& rendition, Image& image);

}  // namespace spillikin::render
