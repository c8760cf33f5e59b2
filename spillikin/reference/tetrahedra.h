// The tetrahedra of every cell in one array, for the field model `tets`.
#pragma once

#include <cstdint>
#include <vector>

#include "spillikin/mesh/subdivide.h"

namespace spillikin::reference {

struct Tetrahedra {
  explicit Tetrahedra(const mesh::Mesh& mesh) {
    std::vector<mesh::Tetrahedron> some;
    offset.reserve(mesh.cell_count() + 1);
    offset.push_back(0);
    for (mesh::Id cell = 0; cell < mesh.cell_count(); ++cell) {
      mesh::tetrahedra(mesh, cell, some);
      all.insert(all.end(), some.begin(), some.end());
      offset.push_back(all.size());
    }
  }
  std::vector<mesh::Tetrahedron> all;
  std::vector<std::size_t> offset;  // per cell + 1
};

}  // namespace spillikin::reference
