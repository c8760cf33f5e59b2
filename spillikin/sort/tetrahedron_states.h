// What the queue starts from, for tetrahedra: how many neighbours come first, and which come after.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// A tetrahedron's state: in the low four bits the count of neighbours that must come before it, above them a bit for
// each of its faces whose neighbour comes after. For the cells first <= c < last, from the bits of interior faces
// (FaceSigns::interiorBits) and the cells' faces, four each. Vectors of cells, for every SIMD target
// (tetrahedron_states_simd.cpp).
inline constexpr unsigned state_count = 0x0F, state_first_after = 0x10;
void tetrahedronStates(const std::uint64_t* bits, const mesh::FaceUse* uses, std::size_t first, std::size_t last,
                       std::uint8_t* state);

}  // namespace spillikin::sort
