// Whether one cell hides another, by a road of its own.
#pragma once

#include <CGAL/Gmpzf.h>
#include <CGAL/QP_functions.h>
#include <CGAL/QP_models.h>
#include <gtest/gtest.h>

#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Does a ray from the viewpoint pass through the inside of convex cell a and then of b? Weights of the corners of a,
// all at least s, give a point beside which weights of b, all at least s, give one farther on the same ray, by at least
// s. The largest such s: above 0 where the ray exists.
inline double obscuring(const mesh::Mesh& mesh, mesh::Id a, mesh::Id b, const Viewpoint& v) {
  const auto va = mesh.vertices(a), vb = mesh.vertices(b);
  const auto na = static_cast<int>(va.size()), nb = static_cast<int>(vb.size());
  const bool parallel = v.w == 0.0;
  const int s = na + nb, t = s + 1;  // variables: weights, s, and the way along a parallel view
  CGAL::Quadratic_program<double> lp(CGAL::SMALLER, true, 0, false, 0);
  int row = 0;
  for (int k = 0; k < 3; ++k, ++row) {  // b's point - a's point (scaled towards the viewer) = 0
    for (int i = 0; i < na; ++i)
      lp.set_a(i, row,
               parallel ? mesh.points[va[static_cast<std::size_t>(i)]][k]
                        : mesh.points[va[static_cast<std::size_t>(i)]][k] - v[k]);
    for (int j = 0; j < nb; ++j)
      lp.set_a(na + j, row,
               parallel ? -mesh.points[vb[static_cast<std::size_t>(j)]][k]
                        : v[k] - mesh.points[vb[static_cast<std::size_t>(j)]][k]);
    if (parallel) lp.set_a(t, row, -v[k]);
    lp.set_r(row, CGAL::EQUAL);
  }
  for (int j = 0; j < nb; ++j)
    lp.set_a(na + j, row, 1);  // weights of b sum to one
  lp.set_b(row, 1);
  lp.set_r(row++, CGAL::EQUAL);
  // Those of a sum to one in a parallel view; in perspective to t > 1, which brings a's point nearer by 1 / t.
  for (int i = 0; i < na; ++i)
    lp.set_a(i, row, 1);
  if (!parallel) lp.set_a(s, row, -1);
  lp.set_b(row, 1);
  lp.set_r(row++, parallel ? CGAL::EQUAL : CGAL::LARGER);
  if (parallel) {
    lp.set_a(t, row, 1);
    lp.set_a(s, row, -1);
    lp.set_r(row++, CGAL::LARGER);
  }
  for (int i = 0; i < na + nb; ++i, ++row) {
    lp.set_a(i, row, 1);
    lp.set_a(s, row, -1);
    lp.set_r(row, CGAL::LARGER);
  }
  lp.set_u(s, true, 1);
  lp.set_c(s, -1);
  const auto solution = CGAL::solve_linear_program(lp, CGAL::Gmpzf());
  return solution.is_infeasible() ? -1.0 : -CGAL::to_double(solution.objective_value());
}

inline bool obscures(const mesh::Mesh& mesh, mesh::Id a, mesh::Id b, const Viewpoint& v, double least = 1e-9) {
  return obscuring(mesh, a, b, v) > least;
}

inline void expectAllPairs(const mesh::Mesh& mesh, const Viewpoint& v, const Order& order) {
  ASSERT_TRUE(order.cuts.empty());
  ASSERT_EQ(order.cells.size(), mesh.cell_count());
  std::vector<std::size_t> place(mesh.cell_count(), mesh.cell_count());
  for (std::size_t i = 0; i < order.cells.size(); ++i)
    place[order.cells[i]] = i;
  for (mesh::Id a = 0; a < mesh.cell_count(); ++a) {
    ASSERT_LT(place[a], mesh.cell_count());
    for (mesh::Id b = 0; b < mesh.cell_count(); ++b) {
      // Only what would be an inversion needs the oracle.
      if (a != b && place[a] < place[b]) {
        ASSERT_FALSE(obscures(mesh, a, b, v)) << "cell " << a << " hides cell " << b << " but comes first";
      }
    }
  }
}

}  // namespace spillikin::sort
