// The points that cells are made of, and their numbering along a space-filling curve. Inside of building a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"
#include "spillikin/mesh/source.h"

namespace spillikin::mesh {

// One summand of a point that the file lacks: its place and its values are sums of weight * file point.
struct Share {
  Id point = 0;
  double weight = 0.0;
};

// The file's points, and after them the points made on the way (quadratic cells' missing nodes).
class PointPool {
 public:
  explicit PointPool(const Source& source);

  std::size_t size() const { return source_->points.size() + made_.size(); }
  std::size_t fromFile() const { return source_->points.size(); }
  const Vec3& operator[](std::size_t i) const { return i < fromFile() ? source_->points[i] : made_[i - fromFile()]; }
  // The shares are summed in the order given; weights sum to 1. Returns the new point's id.
  Id make(std::span<const Share> shares);
  std::span<const Share> shares(std::size_t i) const;
  std::size_t made() const { return made_.size(); }

  // Lexicographic order of all point arrays' values at two points, by their bits: -1, 0, 1.
  int compareValues(std::size_t i, std::size_t j) const;

 private:
  const Source* source_;
  std::vector<const Array*> arrays_;
  std::vector<Vec3> made_;
  std::vector<std::size_t> share_offset_{0};
  std::vector<Share> shares_;
};

// Points along the Morton curve of their bounding box. Points at equal coordinates follow each other; those with equal
// values are one vertex, named after the first in the file.
struct Numbering {
  std::vector<Id> vertex;  // per point of the pool; none where unused
  std::vector<Id> point;   // per vertex
  std::vector<Id> place;   // per vertex, the first vertex at its coordinates; empty when no two coincide
  std::size_t merged = 0, coincident = 0;
  Id placeOf(Id v) const { return place.empty() ? v : place[v]; }
};

// `used`: per point of the pool, nonzero where it counts. Linear, in parallel but for one walk over the sorted points.
Numbering numberPoints(const PointPool& pool, const std::vector<std::uint8_t>& used);

}  // namespace spillikin::mesh
