#include "spillikin/composite/native_links.h"

#include <atomic>

#include "spillikin/mesh/parallel.h"

namespace spillikin::composite::native {

namespace {

// So that twice a way fits 31 bits.
constexpr std::size_t most_cells = std::size_t{1} << 28U;

// A face as the cell on one side of it knows it.
struct Side {
  Link in;                              // no_way where the cell does not have the face
  std::array<mesh::Id, 3> corner = {};  // the cell's own vertices at the face's
  bool same = true;                     // they are the face's
};

Side sideOf(const mesh::Mesh& mesh, mesh::Id cell, const std::array<mesh::Id, 3>& face) {
  Side side{{no_way, 0}, face};
  unsigned found = 0, others = 0;
  for (const mesh::Id v : mesh.vertices(cell)) {
    std::size_t k = 0;
    while (k < 3 && face[k] != v)
      ++k;
    for (std::size_t i = 0; k == 3 && i < 3; ++i) {
      if (mesh.points[face[i]] != mesh.points[v]) continue;
      side.same = false;
      k = i;
    }
    if (k < 3) {
      side.corner[k] = v;
      found |= 1U << k;
    } else {
      side.in.corner = v;
      ++others;
    }
  }
  if (found != 7 || others != 1) return side;
  std::uint32_t rank = 0;
  for (const mesh::Id v : side.corner)
    rank += v < side.in.corner ? 1 : 0;
  side.in.way = 4 * cell + rank;
  return side;
}

// The two sides of a face; the second has no way in behind an exterior face.
struct Sides {
  Side first, second;
  bool exterior = false;
  Sides(const mesh::Mesh& mesh, std::size_t face) {
    const std::array<mesh::Id, 2> cells = mesh.triangle_cells[face];
    first = sideOf(mesh, cells[0], mesh.triangle[face]);
    exterior = cells[1] == mesh::none;
    if (exterior) {
      second.in.way = no_way;
    } else {
      second = sideOf(mesh, cells[1], mesh.triangle[face]);
    }
  }
  bool known() const { return first.in.way != no_way && (exterior || second.in.way != no_way); }
  bool seam() const { return !exterior && !(first.same && second.same); }
  std::size_t entrances() const { return exterior ? 1 : seam() ? 2 : 0; }
};

}  // namespace

bool Links::set(const mesh::Mesh& mesh) {
  clear();
  if (!mesh.tetrahedral() || mesh.cell_count() == 0 || mesh.cell_count() >= most_cells) return false;
  if (!link(mesh)) {
    clear();
    return false;
  }
  findEntrances(mesh);
  return true;
}

void Links::clear() {
  links_ = {};
  entrances_ = {};
}

bool Links::link(const mesh::Mesh& mesh) {
  links_.resize(4 * mesh.cell_count());
  std::atomic<bool> known = true;
  mesh::parallelFor(mesh.triangle_count(), [&](std::size_t f) {
    const Sides sides(mesh, f);
    if (!sides.known()) {
      known.store(false, std::memory_order_relaxed);
      return;
    }
    constexpr Link end{no_way, 0};
    links_[sides.first.in.way] = sides.seam() ? end : sides.second.in;
    if (!sides.exterior) links_[sides.second.in.way] = sides.seam() ? end : sides.first.in;
  });
  return known;
}

// The normal of a face points away from the cell on its first side.
void Links::findEntrances(const mesh::Mesh& mesh) {
  std::vector<std::size_t> begin(mesh::blockCount(mesh.triangle_count()) + 1, 0);
  mesh::parallelBlocks(mesh.triangle_count(), [&](std::size_t block, std::size_t first, std::size_t last) {
    std::size_t count = 0;
    for (std::size_t f = first; f < last; ++f)
      count += Sides(mesh, f).entrances();
    begin[block + 1] = count;
  });
  for (std::size_t b = 1; b < begin.size(); ++b)
    begin[b] += begin[b - 1];
  entrances_.resize(begin.back());
  mesh::parallelBlocks(mesh.triangle_count(), [&](std::size_t block, std::size_t first, std::size_t last) {
    std::size_t at = begin[block];
    for (std::size_t f = first; f < last; ++f) {
      const Sides sides(mesh, f);
      if (sides.entrances() == 0) continue;
      const std::array<mesh::Id, 3>& a = sides.first.corner;
      entrances_[at++] = {{a[0], a[2], a[1]}, sides.first.in};
      if (!sides.seam()) continue;
      const std::array<mesh::Id, 3>& b = sides.second.corner;
      entrances_[at++] = {{b[0], b[1], b[2]}, sides.second.in};
    }
  });
}

}  // namespace spillikin::composite::native
