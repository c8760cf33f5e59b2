// A mesh that deforms: new places for the same cells, without matching a face again.
#pragma once

#include <cstdint>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/source.h"

namespace spillikin::mesh {

// A fingerprint of what adjacency depends on: cell types, connectivity, what is left out, and the number of points.
// Equal for two steps of a series whose nodes only move. Cost: linear, one pass.
std::uint64_t topologyFingerprint(const Source& source);

// Moves the vertices of `mesh` to their places in `source`, a step with the same topology as the one it was built from
// with `report`. False, with the mesh untouched, when the build must be done again because it depended on the places:
// points were merged or lay together, cells were made or dropped or are convex point sets, or a cell would turn inside
// out or flat. Throws Error for coordinates that are not finite, as build does. Cost: linear, a small part of build.
bool refit(Mesh& mesh, const BuildReport& report, const Source& source);

// Adds `scale` times a point array of three components to the points of a source: displacements as solvers write them.
// Throws Error when there is no such array (lists the candidates) or it has no three components.
void warp(Source& source, const std::string& array, double scale);

}  // namespace spillikin::mesh
