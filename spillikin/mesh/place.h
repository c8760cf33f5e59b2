// Coincident vertices as one.
#pragma once

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

// The first vertex at the place of `vertex`: coincident vertices have neighbouring ids (mesh.h). Cost: how many there
// are.
inline Id place(const Mesh& mesh, Id vertex) {
  while (vertex > 0 && mesh.points[vertex] == mesh.points[vertex - 1])
    --vertex;
  return vertex;
}

}  // namespace spillikin::mesh
