// The tetrahedra of every cell in one array, for the field model `tets`: those that `--project tets` draws, cells that
// their own tetrahedra do not fill coned from a point inside.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "spillikin/mesh/subdivide.h"

namespace spillikin::reference {

struct Tetrahedra {
  Tetrahedra(const mesh::Mesh& mesh, const mesh::Field& field) {
    mesh::Tetrahedralization made = mesh::tetrahedralize(mesh);
    if (field.association == mesh::Association::points) values = mesh::tetrahedraField(made, field).values;
    points = std::move(made.mesh.points);
    const std::vector<mesh::Id>& corners = made.mesh.cell_vertex;
    all.reserve(made.parent.size());
    for (std::size_t t = 0; t < made.parent.size(); ++t)
      all.push_back({corners[4 * t], corners[4 * t + 1], corners[4 * t + 2], corners[4 * t + 3]});
    offset.assign(mesh.cell_count() + 1, 0);
    for (const mesh::Id cell : made.parent)
      ++offset[cell + 1];
    for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell)
      offset[cell + 1] += offset[cell];
  }
  std::vector<Vec3> points;    // the mesh's, and those inside cells
  std::vector<double> values;  // at all of these; none where the field is of the cells
  std::vector<mesh::Tetrahedron> all;
  std::vector<std::size_t> offset;  // per cell + 1
};

}  // namespace spillikin::reference
