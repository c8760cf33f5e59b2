// Exterior faces seen edge-on, and the pixels whose centre lies on them.
#pragma once

#include <cstdint>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::reference {

// See RayCaster::edgeOnMask. `width` in pixels.
std::vector<std::uint8_t> edgeOnMask(const mesh::Mesh& mesh, const View& view, double width);

}  // namespace spillikin::reference
