// The lifted (power) distance of cells as floats, with what they may be wrong by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// One view's distances, for the linear pass over the cells (lifted_distance_simd.cpp): the viewpoint, and how the
// number (dot(cell, viewpoint) - middle) * scale becomes a key of `bits` bits. Keys ascend with the number: seven of
// eight, evenly spaced, for those between -1 and 1, the others, spaced as floats, for those beyond, up to 256 on either
// side.
struct KeyQuery {
  float x = 0.0F, y = 0.0F, z = 0.0F, w = 0.0F, middle = 0.0F, scale = 1.0F;
  unsigned bits = 20;  // or 22
  constexpr std::int32_t half() const { return std::int32_t{1} << (bits - 1); }
  constexpr std::int32_t beyond() const { return half() / 8; }       // keys on either side for the numbers beyond
  constexpr std::int32_t even() const { return half() - beyond(); }  // keys for those from 0 to 1
  constexpr unsigned shift() const { return 30 - bits; }  // eight powers of two: (8 * 2^23 >> shift) == beyond()
};
void liftedKeys(const float* x, const float* y, const float* z, const float* w, std::size_t count,
                const KeyQuery& query, std::uint32_t* keys);
std::uint32_t liftedKey(float distance, const KeyQuery& query);

// Faces of [begin, end) whose two cells have keys less than `least` apart, appended to `close`. keys[-1] must be legal
// to read and far from all others: exterior faces look there.
void closeFaces(const std::uint32_t (*cells)[2], std::size_t begin, std::size_t end, const std::uint32_t* keys,
                std::uint32_t least, std::vector<mesh::Id>& close);

// Edelsbrunner 1989; Max, Williams, Silva 2000, section III. The vertices of a mesh of tetrahedra have heights (their
// squared length, or given ones); L_t is the linear function with the heights of t's vertices. |V|^2 - L_t(V) is the
// power distance of V to t's circumsphere, weighted as the heights are; ascending L_t(V) is back to front.
//
// L_t is kept as four floats in coordinates and heights scaled by powers of two to about [-1, 1]. A cell is tame when
// all four are at most `magnitude` and within 2^-23 magnitude of the exact coefficients, which is proven when they are
// made; the others are wild and kept as doubles beside, within 2^-25 magnitude as far as doubles can.
class LiftedDistance {
 public:
  // `key_bits` of the views' keys.
  explicit LiftedDistance(const mesh::Mesh& mesh, unsigned key_bits, std::span<const double> heights = {});

  // What a viewpoint asks for, and what keys tell: cells s and t whose keys are at least `certain` apart have L_s(V)
  // and L_t(V) in the order of their keys.
  struct View {
    KeyQuery query;
    Vec4 at{0.0};
    std::uint32_t certain = 0;
  };
  View view(const Viewpoint& viewpoint) const;
  // keys[begin .. end).
  void keys(const View& view, std::size_t begin, std::size_t end, std::uint32_t* keys) const;

  // Interior faces of cells so flat that doubles do not hold them either, ascending: nothing is certain about these.
  const std::vector<mesh::Id>& hopelessFaces() const { return hopeless_; }
  std::size_t bytes() const;

 private:
  struct Wild {
    mesh::Id cell = 0;
    Vec4 form{0.0};
  };
  struct Form;
  struct Scale {
    int length = 0, height = 0;  // coordinates and heights are times 2 to the power of these
  };
  Form form(const mesh::Mesh& mesh, std::span<const double> heights, mesh::Id cell) const;
  Form exactForm(const mesh::Mesh& mesh, std::span<const double> heights, mesh::Id cell) const;
  void chooseScale(const mesh::Mesh& mesh, std::span<const double> heights);
  void tameForms(const mesh::Mesh& mesh, std::span<const double> heights, std::vector<mesh::Id>& wild);
  void wildForms(const mesh::Mesh& mesh, std::span<const double> heights, const std::vector<mesh::Id>& wild);

  std::size_t count_ = 0;
  unsigned key_bits_ = 0;
  Vec3 origin_{0.0};
  Scale scale_;
  double magnitude_ = 0.0;
  std::vector<float> x_, y_, z_, w_;
  std::vector<Wild> wild_;  // by cell
  std::vector<mesh::Id> hopeless_;
};

}  // namespace spillikin::sort
