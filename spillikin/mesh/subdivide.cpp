#include "spillikin/mesh/subdivide.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "spillikin/mesh/build.h"
#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/interior_point.h"
#include "spillikin/mesh/parallel.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::mesh {

namespace {

// For each position in a hexahedron, the one at the other end of the space diagonal.
constexpr std::array<std::uint8_t, 8> opposite_corner{6, 7, 4, 5, 2, 3, 0, 1};

bool contains(const std::array<Id, 3>& triangle, Id vertex) {
  return triangle[0] == vertex || triangle[1] == vertex || triangle[2] == vertex;
}

Tetrahedron cone(Id apex, Id a, Id b, Id c) {
  return {a, c, b, apex};
}

// A hexahedron whose apex is the smallest vertex; `far` is the corner opposite to it. The diagonals of the three far
// faces that end in `far` are counted: with none, they and the three diagonals from the apex are the edges of a central
// tetrahedron, which leaves one at each of the other four corners; with one or more the diagonal from the apex to `far`
// is an edge, and the two prisms it cuts the cell into give three each, which is what coning from the apex gives.
void hexahedronTetrahedra(Id apex, Id far, const std::vector<std::array<Id, 3>>& opposite,
                          std::vector<Tetrahedron>& out) {
  const auto touches = [far](const auto& triangle) { return contains(triangle, far); };
  const bool central = std::count_if(opposite.begin(), opposite.end(), touches) == 3;
  if (!central) {
    for (const auto& t : opposite) {
      out.push_back(cone(apex, t[0], t[1], t[2]));
    }
    return;
  }
  // The triangles (far, p, q), (far, q, r), (far, r, p) make the corner at `far`; p, q, r with the apex the centre.
  std::array<std::array<Id, 2>, 3> edges{};
  std::size_t found = 0;
  for (const auto& t : opposite) {
    if (!touches(t)) {
      out.push_back(cone(apex, t[0], t[1], t[2]));
      continue;
    }
    const std::size_t at = static_cast<std::size_t>(std::find(t.begin(), t.end(), far) - t.begin());
    edges[found++] = {t[(at + 1) % 3], t[(at + 2) % 3]};
  }
  const Id p = edges[0][0];
  const Id q = edges[0][1];
  const Id r = edges[1][0] == q ? edges[1][1] : edges[2][1];
  out.push_back({p, q, r, far});
  out.push_back({p, r, q, apex});
}

}  // namespace

void tetrahedra(const Mesh& mesh, Id cell, std::vector<Tetrahedron>& out) {
  out.clear();
  const std::span<const Id> vertices = mesh.vertices(cell);
  if (mesh.cell_type[cell] == CellType::tetrahedron) {
    out.push_back({vertices[0], vertices[1], vertices[2], vertices[3]});
    return;
  }
  const std::size_t smallest = smallestCorner(vertices);
  const Id apex = vertices[smallest];
  // The boundary triangles that do not touch the apex: every face fans from its own smallest vertex, so that on the
  // faces which do touch the apex all triangles do.
  thread_local std::vector<std::array<Id, 3>> opposite;
  opposite.clear();
  forEachPolygon(mesh, cell, [&](std::span<const Id> polygon) {
    if (std::find(polygon.begin(), polygon.end(), apex) == polygon.end()) {
      forEachTriangle(polygon, [&](Id a, Id b, Id c) { opposite.push_back({a, b, c}); });
    }
  });
  if (mesh.cell_type[cell] == CellType::hexahedron) {
    hexahedronTetrahedra(apex, vertices[opposite_corner[smallest]], opposite, out);
    return;
  }
  for (const auto& t : opposite) {
    out.push_back(cone(apex, t[0], t[1], t[2]));
  }
}

namespace {

int orientation(const Mesh& mesh, const Tetrahedron& t) {
  return orient3d(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], mesh.points[t[3]]);
}

// What one block of cells becomes. Corners from first_centre onwards are the block's own points inside cells.
constexpr Id first_centre = Id{1} << 31U;
struct Block {
  std::vector<Tetrahedron> tetrahedra;
  std::vector<Id> parent;
  std::vector<InteriorPoint> centres;
  std::vector<Id> unfilled;

  void add(const Tetrahedron& t, Id cell) {
    tetrahedra.push_back(t);
    parent.push_back(cell);
  }
};

class CellCutter {
 public:
  CellCutter(const Mesh& mesh, Block& block) : mesh_(mesh), block_(block) {}

  void cut(Id cell) {
    tetrahedra(mesh_, cell, pieces_);
    const bool filled =
        std::all_of(pieces_.begin(), pieces_.end(), [&](const Tetrahedron& t) { return orientation(mesh_, t) >= 0; });
    if (!filled && fromInside(cell)) return;
    if (!filled) block_.unfilled.push_back(cell);
    for (Tetrahedron t : pieces_) {
      const int sign = orientation(mesh_, t);
      if (sign < 0) std::swap(t[0], t[1]);
      if (sign != 0) block_.add(t, cell);
    }
  }

 private:
  bool fromInside(Id cell) {
    surface(mesh_, cell, boundary_);
    InteriorPoint centre;
    if (!interiorPoint(mesh_, cell, boundary_, centre)) return false;
    const Id apex = first_centre + static_cast<Id>(block_.centres.size());
    block_.centres.push_back(std::move(centre));
    for (const auto& [a, b, c] : boundary_.triangles)
      block_.add({a, c, b, apex}, cell);
    return true;
  }

  const Mesh& mesh_;
  Block& block_;
  std::vector<Tetrahedron> pieces_;
  Surface boundary_;
};

// Points inside cells become vertices behind those of the mesh.
void addCentres(const std::vector<Block>& blocks, Tetrahedralization& result) {
  for (const Block& block : blocks) {
    for (const InteriorPoint& centre : block.centres) {
      result.mesh.points.push_back(centre.place);
      result.mesh.point_file_id.push_back(none);
      result.centre_vertex.insert(result.centre_vertex.end(), centre.vertex.begin(), centre.vertex.end());
      result.centre_weight.insert(result.centre_weight.end(), centre.weight.begin(), centre.weight.end());
      result.centre_offset.push_back(static_cast<Id>(result.centre_vertex.size()));
    }
    result.unfilled.insert(result.unfilled.end(), block.unfilled.begin(), block.unfilled.end());
  }
}

}  // namespace

Tetrahedralization tetrahedralize(const Mesh& mesh) {
  const std::size_t cells = mesh.cell_count();
  // Per block of cells the tetrahedra, then joined in order: the result does not depend on the number of threads.
  std::vector<Block> blocks(blockCount(cells));
  parallelBlocks(cells, [&](std::size_t b, std::size_t begin, std::size_t end) {
    CellCutter cutter(mesh, blocks[b]);
    for (std::size_t cell = begin; cell < end; ++cell)
      cutter.cut(static_cast<Id>(cell));
  });
  std::vector<std::size_t> start(blocks.size() + 1, 0), centre(blocks.size() + 1, mesh.points.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    start[b + 1] = start[b] + blocks[b].tetrahedra.size();
    centre[b + 1] = centre[b] + blocks[b].centres.size();
  }

  Tetrahedralization result;
  Mesh& out = result.mesh;
  out.name = mesh.name;
  out.points = mesh.points;
  out.point_file_id = mesh.point_file_id;
  out.made_offset = mesh.made_offset;
  out.made_point = mesh.made_point;
  out.made_weight = mesh.made_weight;
  addCentres(blocks, result);
  const std::size_t count = start.back();
  out.cell_type.assign(count, CellType::tetrahedron);
  out.cell_vertex_offset.resize(count + 1);
  out.cell_vertex.resize(4 * count);
  out.cell_file_id.resize(count);
  result.parent.resize(count);
  parallelFor(
      blocks.size(),
      [&](std::size_t b) {
        std::size_t to = start[b];
        for (std::size_t i = 0; i < blocks[b].tetrahedra.size(); ++i, ++to) {
          for (std::size_t k = 0; k < 4; ++k) {
            const Id v = blocks[b].tetrahedra[i][k];
            out.cell_vertex[4 * to + k] = v < first_centre ? v : static_cast<Id>(centre[b] + (v - first_centre));
          }
          out.cell_vertex_offset[to] = static_cast<Id>(4 * to);
          result.parent[to] = blocks[b].parent[i];
          out.cell_file_id[to] = mesh.cell_file_id[blocks[b].parent[i]];
        }
      },
      1);
  out.cell_vertex_offset[count] = static_cast<Id>(4 * count);
  matchFaces(out);
  return result;
}

Field tetrahedraField(const Tetrahedralization& tetrahedra, const Field& field) {
  Field result = field;
  const auto inherit = [&](const auto& from, auto& to) {
    to.resize(tetrahedra.parent.size());
    for (std::size_t t = 0; t < to.size(); ++t)
      to[t] = from[tetrahedra.parent[t]];
  };
  if (!field.hidden.empty()) inherit(field.hidden, result.hidden);
  if (field.association == Association::cells) {
    inherit(field.values, result.values);
    return result;
  }
  for (std::size_t k = 0; k + 1 < tetrahedra.centre_offset.size(); ++k) {
    double value = 0.0;
    for (Id i = tetrahedra.centre_offset[k]; i < tetrahedra.centre_offset[k + 1]; ++i)
      value += tetrahedra.centre_weight[i] * field.values[tetrahedra.centre_vertex[i]];
    result.values.push_back(value);
  }
  return result;
}

}  // namespace spillikin::mesh
