// What orders are held to.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/sort.h"
#include "tests/sort_views.h"

namespace spillikin::sort {

// Where in the order each cell comes; every cell comes once.
inline void findPositions(const mesh::Mesh& mesh, const Order& order, std::vector<std::size_t>& position) {
  ASSERT_EQ(order.cells.size(), mesh.cell_count());
  position.assign(mesh.cell_count(), mesh.cell_count());
  for (std::size_t i = 0; i < order.cells.size(); ++i)
    position[order.cells[i]] = i;
  ASSERT_EQ(std::count(position.begin(), position.end(), mesh.cell_count()), 0);
}

// Both cells of every interior triangle come in the order that its exact sign demands, and `also(behind, front)` is
// called for them; not for triangles whose plane holds the viewpoint.
template <class Also>
void expectFaces(const mesh::Mesh& mesh, const Viewpoint& v, const std::vector<std::size_t>& position,
                 const Also& also) {
  for (std::size_t f = 0; f < mesh.triangle_count(); ++f) {
    const auto [behind, front] = mesh.triangle_cells[f];
    if (front == mesh::none) continue;
    const auto& t = mesh.triangle[f];
    const int s = exactSign(mesh, t[0], t[1], t[2], v);
    if (s == 0) continue;
    ASSERT_EQ(position[behind]<position[front], s> 0) << "face " << f;
    also(behind, front);
  }
}

inline void expectEveryFace(const mesh::Mesh& mesh, const Viewpoint& v, const Order& order) {
  std::vector<std::size_t> position;
  ASSERT_NO_FATAL_FAILURE(findPositions(mesh, order, position));
  expectFaces(mesh, v, position, [](mesh::Id, mesh::Id) {});
}

}  // namespace spillikin::sort
