#include "spillikin/mesh/folded.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/predicates.h"
#include "spillikin/mesh/subdivide.h"

namespace spillikin::mesh {
namespace {

using Triangle = std::array<Id, 3>;

class Folds {
 public:
  explicit Folds(const Mesh& mesh) : mesh_(mesh) {}

  bool folded(Id cell) {
    if (mesh_.cell_type[cell] == CellType::tetrahedron) return false;
    tetrahedra(mesh_, cell, pieces_);
    const bool filled = std::all_of(pieces_.begin(), pieces_.end(), [&](const Tetrahedron& t) {
      return orient3d(mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]], mesh_.points[t[3]]) >= 0;
    });
    if (filled) return false;
    surface(mesh_, cell, boundary_);
    const auto& triangles = boundary_.triangles;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      for (std::size_t j = i + 1; j < triangles.size(); ++j) {
        if (cross(triangles[i], triangles[j])) return true;
      }
    }
    return false;
  }

 private:
  static bool has(const Triangle& triangle, Id v) { return std::count(triangle.begin(), triangle.end(), v) > 0; }

  bool cross(const Triangle& a, const Triangle& b) const { return pierces(a, b) || pierces(b, a); }

  // Whether an edge of `a` passes through the inside of `b`: of two triangles that cross and touch in no more than a
  // corner, one has such an edge.
  bool pierces(const Triangle& a, const Triangle& b) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const Id p = a[k], q = a[(k + 1) % 3];
      if (has(b, p) || has(b, q)) continue;
      if (side(b[0], b[1], b[2], p) * side(b[0], b[1], b[2], q) >= 0) continue;
      const int s = side(p, q, b[0], b[1]);
      if (s != 0 && s == side(p, q, b[1], b[2]) && s == side(p, q, b[2], b[0])) return true;
    }
    return false;
  }

  int side(Id a, Id b, Id c, Id d) const {
    return orient3d(mesh_.points[a], mesh_.points[b], mesh_.points[c], mesh_.points[d]);
  }

  const Mesh& mesh_;
  std::vector<Tetrahedron> pieces_;
  Surface boundary_;
};

}  // namespace

std::vector<Id> foldedCells(const Mesh& mesh) {
  if (mesh.tetrahedral()) return {};
  std::vector<std::vector<Id>> blocks(blockCount(mesh.cell_count()));
  parallelBlocks(mesh.cell_count(), [&](std::size_t b, std::size_t begin, std::size_t end) {
    Folds folds(mesh);
    for (std::size_t c = begin; c < end; ++c) {
      if (folds.folded(static_cast<Id>(c))) blocks[b].push_back(static_cast<Id>(c));
    }
  });
  std::vector<Id> all;
  for (const auto& block : blocks)
    all.insert(all.end(), block.begin(), block.end());
  return all;
}

}  // namespace spillikin::mesh
