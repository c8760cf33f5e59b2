// What holds for every mesh that is built, checked cell by cell and face by face.
#pragma once

#include "spillikin/mesh/mesh.h"

namespace spillikin::tests {

// Sum over the cells of the volume that their boundary triangles enclose.
double volume(const mesh::Mesh& mesh);
double volume(const mesh::Mesh& mesh, mesh::Id cell);

// Fails the running test where: ids are out of range; a cell's boundary is not closed (every edge once each way); a
// face does not start at its smallest vertex, or is not what its cells say, side 0 seeing it as stored and side 1 the
// other way round; a cell's use of a face and the face's cells disagree; a volume is not positive; a point is unused;
// vertices at one point do not have neighbouring ids.
void checkInvariants(const mesh::Mesh& mesh);

}  // namespace spillikin::tests
