// On which side of every face the viewpoint lies: one linear pass over float planes, exact where they cannot decide.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// Signs are kept as bits, two for each row. A row is a triangle: first the triangular faces, then the first halves of
// the quadrilaterals, then their second halves; then comes one row for each quadrilateral as a whole. Every section is
// padded to 64 rows. Bit 2r + s says that the cell on side s of row r lies behind it, so that it comes first.
//
// A quadrilateral whose halves disagree (a problem face: Max, Williams, Silva 2000, section IV) is listed in
// problems(); as a whole it has both bits set: each of its cells lies behind the other, which makes them a cycle. Where
// one half is seen edge-on, or no wider than a sliver (see triangle_order.h), the other decides.
//
// Cost: 16 bytes a row; a view reads them once, on all cores. The float planes decide with a proven bound (see
// face_signs.cpp); mesh::orientViewpoint decides the rest.
class FaceSigns {
 public:
  explicit FaceSigns(const mesh::Mesh& mesh);

  void operator()(const Viewpoint& viewpoint);

  // A face's row as a whole; a use's bit is 2 * row + side.
  std::size_t row(mesh::Id face) const { return face < triangles_ ? face : whole_ + (face - triangles_); }
  std::size_t firstHalf(mesh::Id quad_face) const { return first_ + (quad_face - triangles_); }
  std::size_t secondHalf(mesh::Id quad_face) const { return second_ + (quad_face - triangles_); }
  std::size_t bitIndex(mesh::FaceUse use) const { return 2 * row(use.face()) + use.side(); }
  bool bit(std::size_t index) const { return ((bits_[index >> 6] >> (index & 63U)) & 1U) != 0; }

  // The cell of this use comes before its neighbour: it lies behind the face.
  bool before(mesh::FaceUse use) const { return bit(bitIndex(use)); }
  // The viewpoint's side of a row: 1 where the normal points to, -1 the other, 0 edge-on.
  int sign(std::size_t row) const { return static_cast<int>(bit(2 * row)) - static_cast<int>(bit(2 * row + 1)); }

  // The bits of interior faces alone: an exterior face orders nothing by itself.
  const std::uint64_t* interiorBits() const { return interior_bits_.data(); }
  // What to add to a quadrilateral face's id to get its row as a whole.
  std::size_t quadShift() const { return whole_ - triangles_; }

  // The bits of the quadrilaterals' halves, 32 quadrilaterals a word.
  const std::uint64_t* firstHalves() const { return bits_.data() + first_ / 32; }
  const std::uint64_t* secondHalves() const { return bits_.data() + second_ / 32; }

  std::span<const mesh::Id> problems() const { return problems_; }
  // From now on the interior bits say of a problem face that the cell on this side comes first, and no more.
  void settle(mesh::Id problem, unsigned side);
  std::size_t exactCalls() const { return exact_calls_; }  // of the last view
  std::size_t bytes() const;

 private:
  std::array<mesh::Id, 3> corners(std::size_t row) const;
  void plane(std::size_t row);
  void fixUndecided(std::size_t word, std::uint64_t undecided, const Viewpoint& viewpoint, std::uint64_t& pos,
                    std::uint64_t& neg) const;
  void markInterior();
  void keepInterior();
  void joinHalves(const Viewpoint& viewpoint);
  void joinHalves(std::size_t begin, std::size_t end, const Viewpoint& viewpoint, std::vector<mesh::Id>& problems);
  unsigned seenHalves(std::size_t quad, const Viewpoint& viewpoint) const;

  const mesh::Mesh& mesh_;
  std::size_t triangles_ = 0, first_ = 0, second_ = 0, whole_ = 0;  // first rows of the sections
  std::size_t end_ = 0;
  Vec3 origin_{0.0};
  int exponent_ = 0;  // local = (world - origin) * 2^exponent lies in [-1, 1]
  std::vector<float> x_, y_, z_, w_;
  std::vector<std::uint64_t> bits_, interior_bits_;
  std::vector<std::uint64_t> interior_;  // bit per row
  std::vector<mesh::Id> problems_;
  std::vector<std::vector<mesh::Id>> found_;  // problems, by block
  std::size_t exact_calls_ = 0;
};

// The kernel, compiled for every SIMD target and chosen at run time. For each of `words` groups of 64 rows writes which
// rows are certainly positive, certainly negative, and undecided; rows in none of them are exactly zero.
struct SignQuery {
  float x = 0, y = 0, z = 0, w = 0;
  float relative = 0;  // bound on the error over the sum of the magnitudes of the products
  float absolute = 0;  // added to it
};
void signWords(const float* x, const float* y, const float* z, const float* w, std::size_t words,
               const SignQuery& query, std::uint64_t* pos, std::uint64_t* neg, std::uint64_t* undecided);

}  // namespace spillikin::sort
