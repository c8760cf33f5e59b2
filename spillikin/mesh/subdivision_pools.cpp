#include "spillikin/mesh/subdivision_pools.h"

#include <algorithm>

#include "spillikin/mesh/predicates.h"

namespace spillikin::mesh {
namespace {

// The faces of a tetrahedron of positive volume, outward.
constexpr std::uint8_t faces_outward[4][3] = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}};

std::array<Id, 3> sorted(std::array<Id, 3> corner) {
  std::sort(corner.begin(), corner.end());
  return corner;
}

// Each face of the tetrahedra is a triangle of the boundary or lies between two of them. False when it does not fit.
template <class Block>
bool connect(const std::vector<Tetrahedron>& tetrahedra, const Surface& boundary, Block& block) {
  if (tetrahedra.size() != block.tetrahedron.size() || boundary.triangles.size() != block.at.size()) return false;
  std::copy(tetrahedra.begin(), tetrahedra.end(), block.tetrahedron.begin());
  struct Face {
    std::array<Id, 3> key, corner;
    std::uint8_t tetrahedron;
  };
  std::array<Face, 24> open;  // waits for its other side
  std::size_t waiting = 0, inner = 0, outer = 0;
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    for (const auto& local : faces_outward) {
      const std::array<Id, 3> corner{tetrahedra[t][local[0]], tetrahedra[t][local[1]], tetrahedra[t][local[2]]};
      const Face face{sorted(corner), corner, static_cast<std::uint8_t>(t)};
      const auto on = std::find_if(boundary.triangles.begin(), boundary.triangles.end(),
                                   [&](const auto& triangle) { return sorted(triangle) == face.key; });
      if (on != boundary.triangles.end()) {
        block.at[static_cast<std::size_t>(on - boundary.triangles.begin())] = face.tetrahedron;
        ++outer;
        continue;
      }
      const auto end = open.begin() + static_cast<std::ptrdiff_t>(waiting);
      const auto other = std::find_if(open.begin(), end, [&](const Face& f) { return f.key == face.key; });
      if (other == end) {
        open[waiting++] = face;
        continue;
      }
      if (inner == block.between.size()) return false;
      block.between[inner++] = {other->corner, {other->tetrahedron, face.tetrahedron}};
      *other = open[--waiting];
    }
  }
  return waiting == 0 && inner == block.between.size() && outer == block.at.size();
}

}  // namespace

SubdivisionPools::SubdivisionPools(const Mesh& mesh) : mesh_(mesh) {}

template <class B>
Id SubdivisionPools::Pool<B>::take() {
  if (unused.empty()) {
    blocks.emplace_back();
    return static_cast<Id>(blocks.size() - 1);
  }
  const Id block = unused.back();
  unused.pop_back();
  return block;
}

template <class P>
bool SubdivisionPools::fill(P& pool, unsigned which, Id cell) {
  const Id block = pool.take();
  if (!connect(pieces_, boundary_, pool.blocks[block])) {
    pool.unused.push_back(block);
    return false;
  }
  pool.blocks[block].parent = cell;
  block_[cell] = 4 * block + which;
  return true;
}

bool SubdivisionPools::fillsTheCell() const {
  return std::all_of(pieces_.begin(), pieces_.end(), [&](const Tetrahedron& t) {
    return orient3d(mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]], mesh_.points[t[3]]) > 0;
  });
}

bool SubdivisionPools::subdivide(Id cell) {
  if (subdivided(cell)) {
    wanted_[place_[cell]] = 1;
    return true;
  }
  const CellType type = mesh_.cell_type[cell];
  if (type != CellType::pyramid && type != CellType::wedge && type != CellType::hexahedron) return false;
  tetrahedra(mesh_, cell, pieces_);
  if (!fillsTheCell()) return false;
  surface(mesh_, cell, boundary_);
  if (block_.empty()) {
    block_.assign(mesh_.cell_count(), none);
    place_.assign(mesh_.cell_count(), none);
  }
  bool filled = false;
  switch (pieces_.size()) {
    case 2:
      filled = fill(pyramids_, 0, cell);
      break;
    case 3:
      filled = fill(wedges_, 1, cell);
      break;
    case 5:
      filled = fill(five_, 2, cell);
      break;
    case 6:
      filled = fill(six_, 3, cell);
      break;
    default:
      break;
  }
  if (!filled) return false;
  ++made_;
  place_[cell] = static_cast<Id>(cells_.size());
  cells_.push_back(cell);
  wanted_.push_back(1);
  return true;
}

void SubdivisionPools::restoreOthers() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Id cell = cells_[i];
    if (wanted_[i] != 0) {
      place_[cell] = static_cast<Id>(kept);
      wanted_[kept] = 0;
      cells_[kept++] = cell;
      continue;
    }
    const Id block = block_[cell] / 4;
    const std::array<std::vector<Id>*, 4> unused{&pyramids_.unused, &wedges_.unused, &five_.unused, &six_.unused};
    unused[block_[cell] % 4]->push_back(block);
    block_[cell] = none;
  }
  cells_.resize(kept);
  wanted_.resize(kept);
}

SubdividedCell SubdivisionPools::operator[](Id cell) const {
  const Id block = block_[cell] / 4;
  switch (block_[cell] % 4) {
    case 0:
      return pyramids_.blocks[block].view();
    case 1:
      return wedges_.blocks[block].view();
    case 2:
      return five_.blocks[block].view();
    default:
      return six_.blocks[block].view();
  }
}

std::array<std::size_t, 4> SubdivisionPools::blocks() const {
  return {pyramids_.blocks.size(), wedges_.blocks.size(), five_.blocks.size(), six_.blocks.size()};
}

std::array<std::size_t, 4> SubdivisionPools::unused() const {
  return {pyramids_.unused.size(), wedges_.unused.size(), five_.unused.size(), six_.unused.size()};
}

std::size_t SubdivisionPools::bytes() const {
  const auto of = [](const auto&... lists) { return (std::size_t{0} + ... + (lists.capacity() * sizeof(lists[0]))); };
  return of(pyramids_.blocks, wedges_.blocks, five_.blocks, six_.blocks, pyramids_.unused, wedges_.unused) +
         of(five_.unused, six_.unused, block_, cells_, wanted_, place_);
}

}  // namespace spillikin::mesh
