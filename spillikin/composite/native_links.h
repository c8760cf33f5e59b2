// The tetrahedra behind each face, as rays read them that walk from cell to cell.
//
// The corners of a cell are numbered by their ids, ascending: rank 0 to 3. Corners of a face have the same order in
// both of its cells, so that a ray that crosses it knows its corners' ranks in the next cell from the rank of the one
// corner that is new there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::composite::native {

// A way into a cell, through the face opposite to its corner of a rank: 4 * cell + rank, and that corner. no_way where
// the mesh ends.
struct Link {
  std::uint32_t way;
  mesh::Id corner;
};
inline constexpr std::uint32_t no_way = 0xffffffffU;

// A face that a ray may begin at: its corners, as the cell behind it names them, turn to the right as seen by a ray
// that enters; and the way in. Exterior faces are such, and both sides of a seam, a face whose cells name other
// vertices at the same places because values differ from side to side: there a walk ends, and the next begins.
struct Entrance {
  mesh::Id corner[3];
  Link in;
};

// 32 bytes a cell, 20 an entrance.
class Links {
 public:
  // False, with nothing kept, where rays cannot walk: cells that are no tetrahedra, 2^28 cells or more. Linear, on all
  // cores.
  bool set(const mesh::Mesh& mesh);
  void clear();

  // no_way behind exterior faces and seams. Of cell c, left through the face opposite to its corner of rank k:
  // links()[4 * c + k].
  std::span<const Link> links() const { return {links_.get(), count_}; }
  const std::vector<Entrance>& entrances() const { return entrances_; }
  std::size_t bytes() const { return count_ * sizeof(Link) + entrances_.size() * sizeof(Entrance); }

 private:
  bool link(const mesh::Mesh& mesh);
  std::size_t entrancesOf(const mesh::Mesh& mesh, std::size_t face) const;
  void findEntrances(const mesh::Mesh& mesh);

  bool seams_ = false;             // there are some
  std::unique_ptr<Link[]> links_;  // made without being cleared: that takes as long as the linking
  std::size_t count_ = 0;
  std::vector<Entrance> entrances_;
};

}  // namespace spillikin::composite::native
