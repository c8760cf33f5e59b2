// One pixel, explained: the cells on its ray with their intervals, scalars and contributions, front to back.
#pragma once

#include <string>

#include "spillikin/render/session.h"

namespace spillikin::cli {

// A table as text, of the cells that the session draws, under a field model of the ground truth. `positions`:
// also each cell's place in the session's order, so that an inversion can be seen. `image`, when given, adds the
// pixel's colour in it beside the sum of the contributions. Throws Error when the pixel is outside of the image.
std::string explainPixel(render::Session& session, int x, int y, bool positions, const Image* image = nullptr,
                         mesh::FieldModel model = mesh::FieldModel::face);

}  // namespace spillikin::cli
