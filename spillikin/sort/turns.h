// Turns: a coarse time for each cell, so that what lies across empty space comes in the order of depth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "spillikin/sort/convexity.h"
#include "spillikin/sort/face_signs.h"
#include "spillikin/sort/triangle_order.h"

namespace spillikin::sort {

// A cell is listed in its turn, small turns first. A cell that a ray leaves through an exterior face (an exit, turned
// away from the viewpoint) must wait for all that lies behind that face across empty space, and gets at least the turn
// of the face's depth; any other cell has the latest turn of the cells behind it. Among cells of one turn the
// topological order decides.
using Turn = std::uint16_t;

// Depths in bands of equal thickness, the nearest last. Distances are those from the eye, or heights along the line of
// sight of a parallel view; the bands span the box given.
class DepthBands {
 public:
  static constexpr Turn bands = 4096;

  DepthBands(const Vec3& lower, const Vec3& upper, const Viewpoint& viewpoint);

  // The band of the nearest point of a triangle and that of the farthest, each rounded so that whatever rounding does,
  // latest(a) >= earliest(b) when a point of a lies on a ray no farther than a point of b.
  Turn latest(const Triangle& triangle) const;
  Turn earliest(const Triangle& triangle) const;

  // The largest distance, how much smaller the least one is, and what is left for rounding. No depth where they are
  // too large for doubles.
  double farthest() const { return far_; }
  double depth() const { return depth_; }
  double room() const { return room_; }

 private:
  Turn band(double distance) const;

  Viewpoint viewpoint_;
  double far_ = 0.0, depth_ = 0.0, scale_ = 0.0, room_ = 0.0;
};

// The rows of FaceSigns that hold exterior triangles.
std::vector<std::size_t> exteriorRows(const mesh::Mesh& mesh, const FaceSigns& signs,
                                      std::span<const ExteriorTriangle> triangles);

// *turn = max(*turn, least), by any number of threads at once.
void raise(Turn& turn, Turn least);

// Lists cells by their turn; those of one turn keep the sequence in which they are. Keeps its scratch space. Cost: two
// passes over the cells on all cores; the result does not depend on the number of threads.
class TurnSort {
 public:
  void operator()(std::span<const Turn> turn, std::vector<mesh::Id>& cells);
  std::size_t bytes() const { return 4 * (other_.capacity() + histogram_.capacity()); }

 private:
  std::vector<mesh::Id> other_;
  std::vector<std::uint32_t> histogram_;  // by part and turn
};

}  // namespace spillikin::sort
