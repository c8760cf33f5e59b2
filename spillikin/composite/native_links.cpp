#include "spillikin/composite/native_links.h"

#include <atomic>

#include "spillikin/mesh/parallel.h"

namespace spillikin::composite::native {

namespace {

// So that twice a way fits 31 bits.
constexpr std::size_t most_cells = std::size_t{1} << 28U;

// A face as the cell on one side of it knows it.
struct Side {
  Link in{no_way, 0};                   // no_way where the cell does not have the face
  std::array<mesh::Id, 3> corner = {};  // the cell's own vertices at the face's
  bool same = true;                     // they are the face's
};

std::uint32_t wayTo(mesh::Id cell, mesh::Id ahead, const std::array<mesh::Id, 3>& behind) {
  return 4 * cell + (behind[0] < ahead ? 1 : 0) + (behind[1] < ahead ? 1 : 0) + (behind[2] < ahead ? 1 : 0);
}

// The cell's own vertices at the places of the face's.
Side sideByPlace(const mesh::Mesh& mesh, mesh::Id cell, const std::array<mesh::Id, 3>& face) {
  Side side{{no_way, 0}, face, false};
  unsigned found = 0, others = 0;
  for (const mesh::Id v : mesh.vertices(cell)) {
    std::size_t k = 0;
    while (k < 3 && face[k] != v && mesh.points[face[k]] != mesh.points[v])
      ++k;
    if (k < 3) {
      side.corner[k] = v;
      found |= 1U << k;
    } else {
      side.in.corner = v;
      ++others;
    }
  }
  if (found == 7 && others == 1) side.in.way = wayTo(cell, side.in.corner, side.corner);
  return side;
}

Side sideOf(const mesh::Mesh& mesh, mesh::Id cell, const std::array<mesh::Id, 3>& face) {
  const mesh::Id* const v = mesh.cell_vertex.data() + 4 * std::size_t{cell};
  mesh::Id ahead = 0;
  int others = 0;
  for (int i = 0; i < 4; ++i) {
    const bool other = (v[i] != face[0]) & (v[i] != face[1]) & (v[i] != face[2]);
    ahead = other ? v[i] : ahead;
    others += other ? 1 : 0;
  }
  if (others != 1) return sideByPlace(mesh, cell, face);
  return {{wayTo(cell, ahead, face), ahead}, face, true};
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
  links_.reset();
  count_ = 0;
  entrances_ = {};
}

bool Links::link(const mesh::Mesh& mesh) {
  count_ = 4 * mesh.cell_count();
  links_ = std::make_unique_for_overwrite<Link[]>(count_);
  std::atomic<bool> known = true, seams = false;
  mesh::parallelFor(mesh.triangle_count(), [&](std::size_t f) {
    const Sides sides(mesh, f);
    if (!sides.known()) {
      known.store(false, std::memory_order_relaxed);
      return;
    }
    constexpr Link end{no_way, 0};
    if (sides.seam()) seams.store(true, std::memory_order_relaxed);
    links_[sides.first.in.way] = sides.seam() ? end : sides.second.in;
    if (!sides.exterior) links_[sides.second.in.way] = sides.seam() ? end : sides.first.in;
  });
  seams_ = seams;
  return known;
}

std::size_t Links::entrancesOf(const mesh::Mesh& mesh, std::size_t face) const {
  if (mesh.triangle_cells[face][1] == mesh::none) return 1;
  return seams_ && Sides(mesh, face).seam() ? 2 : 0;
}

// The normal of a face points away from the cell on its first side.
void Links::findEntrances(const mesh::Mesh& mesh) {
  std::vector<std::size_t> begin(mesh::blockCount(mesh.triangle_count()) + 1, 0);
  mesh::parallelBlocks(mesh.triangle_count(), [&](std::size_t block, std::size_t first, std::size_t last) {
    std::size_t count = 0;
    for (std::size_t f = first; f < last; ++f)
      count += entrancesOf(mesh, f);
    begin[block + 1] = count;
  });
  for (std::size_t b = 1; b < begin.size(); ++b)
    begin[b] += begin[b - 1];
  entrances_.resize(begin.back());
  mesh::parallelBlocks(mesh.triangle_count(), [&](std::size_t block, std::size_t first, std::size_t last) {
    std::size_t at = begin[block];
    for (std::size_t f = first; f < last; ++f) {
      if (entrancesOf(mesh, f) == 0) continue;
      const Sides sides(mesh, f);
      const std::array<mesh::Id, 3>& a = sides.first.corner;
      entrances_[at++] = {{a[0], a[2], a[1]}, sides.first.in};
      if (!sides.seam()) continue;
      const std::array<mesh::Id, 3>& b = sides.second.corner;
      entrances_[at++] = {{b[0], b[1], b[2]}, sides.second.in};
    }
  });
}

}  // namespace spillikin::composite::native
