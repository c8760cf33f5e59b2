// Float planes and why their verdict can be trusted.
//
// Row r is the plane n . (p - a) of triangle a, b, c, in local coordinates p' = (p - origin) 2^exponent, |p'| <= 1. The
// normal is computed in double and scaled by a power of two to a largest component in [1/2, 1). A component is kept
// only if its computed value is within 2^-26 of the exact one relatively, or if it is exactly zero and then stored as
// zero; otherwise the row is NaN and always left to the exact predicate. So for every row
//   stored normal     relative error <= 2^-24 (rounding to float) + 2^-26
//   viewpoint v'      relative error <= 2^-24 + 2^-53: a difference of doubles rounds once, scaling by 2^k not at all
//   four products and three sums in float: relative error of the sum of magnitudes <= 5 * 2^-24
// together below 8 * 2^-24 of sum |n_i v_i|; `relative` = 2^-20 is twice that and covers the rounding of the bound. The
// offset is wrong by at most (2^-26 + 2^-24) sum |n_i a'_i| + 2^-24 |d| <= 2^-21 for |n_i|, |a'_i| <= 1; `absolute` =
// 2^-19 |w'| covers it. In a parallel view w' = 0: a row whose products are all zero is then exactly zero.
#include "spillikin/sort/face_signs.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "spillikin/mesh/predicates.h"
#include "spillikin/sort/triangle_order.h"

namespace spillikin::sort {
namespace {

constexpr float relative_bound = 0x1p-20F;
constexpr float absolute_bound = 0x1p-19F;
constexpr float nan_plane = std::numeric_limits<float>::quiet_NaN();
// Nonzero components below this are not kept as floats, so that no product of two can vanish.
constexpr double least_component = 0x1p-50;

std::size_t padded(std::size_t rows) {
  return (rows + 63) / 64 * 64;
}

struct Difference {
  double value;
  bool exact;
};
Difference subtract(double a, double b) {  // Knuth's two-sum: the rounding error of a difference is a double
  const double d = a - b;
  const double bb = a - d;
  return {d, (a - (d + bb)) + (bb - b) == 0.0};
}

// p q - r s, each factor wrong by at most half a unit of its last place. False where cancellation leaves too little.
bool component(Difference p, Difference q, Difference r, Difference s, double& out) {
  const double left = p.value * q.value, right = r.value * s.value;
  if ((left == 0.0 && p.value != 0.0 && q.value != 0.0) || (right == 0.0 && r.value != 0.0 && s.value != 0.0)) {
    return false;
  }
  out = left - right;
  if (std::abs(out) >= 0x1p-24 * (std::abs(left) + std::abs(right))) return true;  // error below 8 * 2^-53 of the sum
  if (!(p.exact && q.exact && r.exact && s.exact)) return false;
  // The factors are exact: the products' rounding errors tell whether they are equal.
  const bool equal = left == right && std::fma(p.value, q.value, -left) == std::fma(r.value, s.value, -right);
  if (equal) out = 0.0;
  return equal;
}

// Moves the 32 low bits to the even places.
std::uint64_t spread(std::uint64_t v) {
  v &= 0xFFFFFFFFU;
  v = (v | (v << 16)) & 0x0000FFFF0000FFFFU;
  v = (v | (v << 8)) & 0x00FF00FF00FF00FFU;
  v = (v | (v << 4)) & 0x0F0F0F0F0F0F0F0FU;
  v = (v | (v << 2)) & 0x3333333333333333U;
  v = (v | (v << 1)) & 0x5555555555555555U;
  return v;
}

// A quick way to know most triangles that are seen wider than the tolerance, in perspective at their own distance: a
// corner's height over the plane through the viewpoint and an edge is this determinant over the length of a product of
// that edge and a line of sight, which is bounded here. The factor leaves room for rounding.
bool wide(const Vec3 (&t)[3], const Viewpoint& v, double tolerance) {
  const auto squared = [](const Vec3& a) { return a.x * a.x + a.y * a.y + a.z * a.z; };
  const Vec3 b = t[1] - t[0], c = t[2] - t[0], sight = v.w == 0.0 ? Vec3(v) : Vec3(v) - t[0];
  const double determinant =
      sight.x * (b.y * c.z - b.z * c.y) + sight.y * (b.z * c.x - b.x * c.z) + sight.z * (b.x * c.y - b.y * c.x);
  const double edge = std::sqrt(std::max({squared(b), squared(c), squared(c - b)}));
  return std::abs(determinant) > 4.0 * tolerance * edge * (std::sqrt(squared(sight)) + edge);
}

struct Box {
  Vec3 lower{std::numeric_limits<double>::infinity()}, upper{-std::numeric_limits<double>::infinity()};
};

Box boundingBox(const std::vector<Vec3>& points) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, points.size(), 1 << 16), Box{},
      [&](const tbb::blocked_range<std::size_t>& range, Box box) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          for (int k = 0; k < 3; ++k) {
            box.lower[k] = std::min(box.lower[k], points[i][k]);
            box.upper[k] = std::max(box.upper[k], points[i][k]);
          }
        }
        return box;
      },
      [](Box a, const Box& b) {
        for (int k = 0; k < 3; ++k) {
          a.lower[k] = std::min(a.lower[k], b.lower[k]);
          a.upper[k] = std::max(a.upper[k], b.upper[k]);
        }
        return a;
      });
}

}  // namespace

FaceSigns::FaceSigns(const mesh::Mesh& mesh)
    : mesh_(mesh),
      triangles_(mesh.triangle_count()),
      first_(padded(triangles_)),
      second_(first_ + padded(mesh.quad_count())),
      whole_(second_ + padded(mesh.quad_count())),
      end_(whole_ + padded(mesh.quad_count())) {
  const Box box = boundingBox(mesh.points);
  double extent = 0.0;
  for (int k = 0; k < 3; ++k) {
    origin_[k] = 0.5 * box.lower[k] + 0.5 * box.upper[k];
    extent = std::max(extent, std::max(box.upper[k] - origin_[k], origin_[k] - box.lower[k]));
  }
  if (extent > 0.0 && std::isfinite(extent)) exponent_ = -std::ilogb(extent) - 1;
  for (auto* coefficient : {&x_, &y_, &z_, &w_})
    coefficient->resize(whole_);
  bits_.resize(end_ / 32);
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, whole_, 4096), [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t row = range.begin(); row < range.end(); ++row) {
          const bool used = row < first_ ? row < triangles_ : (row - first_) % (second_ - first_) < mesh_.quad_count();
          if (used) plane(row);
        }
      });
  markInterior();
}

void FaceSigns::markInterior() {
  interior_bits_.resize(bits_.size());
  interior_.resize(bits_.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, end_ / 32, 1024),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t row = 32 * range.begin(); row < 32 * range.end(); ++row) {
                        const bool triangle = row < triangles_;
                        const bool quad = row >= whole_ && row - whole_ < mesh_.quad_count();
                        const bool inner = (triangle && mesh_.triangle_cells[row][1] != mesh::none) ||
                                           (quad && mesh_.quad_cells[row - whole_][1] != mesh::none);
                        interior_[row / 32] |= std::uint64_t{inner ? 3U : 0U} << (2 * (row % 32));
                      }
                    });
}

void FaceSigns::keepInterior() {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bits_.size(), 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        interior_bits_[i] = bits_[i] & interior_[i];
                      }
                    });
}

std::array<mesh::Id, 3> FaceSigns::corners(std::size_t row) const {
  if (row < first_) return mesh_.triangle[row];
  const bool second = row >= second_;
  const auto& quad = mesh_.quad[row - (second ? second_ : first_)];
  return second ? std::array<mesh::Id, 3>{quad[0], quad[2], quad[3]}
                : std::array<mesh::Id, 3>{quad[0], quad[1], quad[2]};
}

void FaceSigns::plane(std::size_t row) {
  const auto [ia, ib, ic] = corners(row);
  const Vec3 &a = mesh_.points[ia], &b = mesh_.points[ib], &c = mesh_.points[ic];
  Difference u[3], v[3];
  for (int k = 0; k < 3; ++k) {
    u[k] = subtract(b[k], a[k]);
    v[k] = subtract(c[k], a[k]);
  }
  Vec3 n(0.0);
  double largest = 0.0;
  bool good = true;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    double value = 0.0;
    if (!component(u[i], v[j], u[j], v[i], value)) {
      Vec3 axis(0.0);
      axis[k] = 1.0;
      value = 0.0;
      good = good && mesh::orientDirection(a, b, c, axis) == 0;
    }
    n[k] = value;
    largest = std::max(largest, std::abs(value));
  }
  good = good && std::isfinite(largest);
  if (good && largest > 0.0) {
    const int scale = -std::ilogb(largest) - 1;
    for (int k = 0; k < 3; ++k) {
      n[k] = std::ldexp(n[k], scale);
      good = good && (n[k] == 0.0 || std::abs(n[k]) >= least_component);
    }
  }
  double offset = 0.0;
  for (int k = 0; k < 3; ++k)
    offset -= n[k] * std::ldexp(a[k] - origin_[k], exponent_);
  x_[row] = good ? static_cast<float>(n.x) : nan_plane;
  y_[row] = good ? static_cast<float>(n.y) : nan_plane;
  z_[row] = good ? static_cast<float>(n.z) : nan_plane;
  w_[row] = good ? static_cast<float>(offset) : nan_plane;
}

void FaceSigns::fixUndecided(std::size_t word, std::uint64_t undecided, const Viewpoint& viewpoint, std::uint64_t& pos,
                             std::uint64_t& neg) const {
  for (; undecided != 0; undecided &= undecided - 1) {
    const int k = std::countr_zero(undecided);
    const auto [a, b, c] = corners(64 * word + static_cast<std::size_t>(k));
    const int s = mesh::orientViewpoint(mesh_.points[a], mesh_.points[b], mesh_.points[c], viewpoint);
    pos |= static_cast<std::uint64_t>(s > 0) << k;
    neg |= static_cast<std::uint64_t>(s < 0) << k;
  }
}

void FaceSigns::operator()(const Viewpoint& viewpoint) {
  SignQuery query;
  query.relative = relative_bound;
  Vec3 v(viewpoint);
  double w = 0.0;
  if (viewpoint.w != 0.0) {
    for (int k = 0; k < 3; ++k)
      v[k] = std::ldexp(v[k] - origin_[k], exponent_);
    w = 1.0;
  }
  // Scaled by a power of two to a largest component of about one, so that floats neither overflow nor vanish.
  double largest = w;
  for (int k = 0; k < 3; ++k)
    largest = std::max(largest, std::abs(v[k]));
  const bool usable = largest > 0.0 && std::isfinite(largest);
  const int scale = usable ? -std::ilogb(largest) : 0;
  for (int k = 0; k < 3; ++k)
    v[k] = std::ldexp(v[k], scale);
  w = std::ldexp(w, scale);
  query.absolute = w == 0.0 ? 0.0F : absolute_bound * static_cast<float>(w) + 0x1p-60F;
  for (int k = 0; k < 3; ++k) {
    if (v[k] != 0.0 && std::abs(v[k]) < least_component) {  // left out of the float's view, so it counts as error
      v[k] = 0.0;
      query.absolute += 0x1p-49F;
    }
  }
  query.x = static_cast<float>(v.x);
  query.y = static_cast<float>(v.y);
  query.z = static_cast<float>(v.z);
  query.w = static_cast<float>(w);
  if (!usable && viewpoint.w != 0.0) query.absolute = std::numeric_limits<float>::infinity();

  std::atomic<std::size_t> exact_calls{0};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, whole_ / 64, 64),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      constexpr std::size_t block = 64;
                      std::uint64_t pos[block], neg[block], undecided[block];
                      for (std::size_t begin = range.begin(); begin < range.end(); begin += block) {
                        const std::size_t count = std::min(block, range.end() - begin);
                        const std::size_t row = 64 * begin;
                        signWords(x_.data() + row, y_.data() + row, z_.data() + row, w_.data() + row, count, query, pos,
                                  neg, undecided);
                        std::size_t calls = 0;
                        for (std::size_t i = 0; i < count; ++i) {
                          // Rows of padding hold no triangle: they are zero and, in perspective, undecided.
                          if (undecided[i] != 0) {
                            const std::size_t at = 64 * (begin + i);
                            const std::size_t rows =
                                at < first_ ? triangles_ : (at < second_ ? first_ : second_) + mesh_.quad_count();
                            if (rows - at < 64) undecided[i] &= (std::uint64_t{1} << (rows - at)) - 1;
                            calls += static_cast<std::size_t>(std::popcount(undecided[i]));
                            fixUndecided(begin + i, undecided[i], viewpoint, pos[i], neg[i]);
                          }
                          bits_[2 * (begin + i)] = spread(pos[i]) | (spread(neg[i]) << 1);
                          bits_[2 * (begin + i) + 1] = spread(pos[i] >> 32) | (spread(neg[i] >> 32) << 1);
                        }
                        if (calls != 0) exact_calls.fetch_add(calls, std::memory_order_relaxed);
                      }
                    });
  exact_calls_ = exact_calls.load();
  joinHalves(viewpoint);
  keepInterior();
}

void FaceSigns::joinHalves(const Viewpoint& viewpoint) {
  constexpr std::size_t block = 256;  // words of 32 quadrilaterals, whose problems are kept together
  const std::size_t words = (end_ - whole_) / 32, blocks = (words + block - 1) / block;
  found_.resize(blocks);
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) {
    found_[b].clear();
    joinHalves(b * block, std::min(words, (b + 1) * block), viewpoint, found_[b]);
  });
  problems_.clear();
  for (const auto& found : found_)
    problems_.insert(problems_.end(), found.begin(), found.end());
}

void FaceSigns::joinHalves(std::size_t begin, std::size_t end, const Viewpoint& viewpoint,
                           std::vector<mesh::Id>& problems) {
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint64_t first = bits_[first_ / 32 + i], second = bits_[second_ / 32 + i], any = first | second;
    bits_[whole_ / 32 + i] = any;
    for (std::uint64_t both = any & (any >> 1) & 0x5555555555555555U; both != 0; both &= both - 1) {
      const int at = std::countr_zero(both);
      const std::size_t quad = 32 * i + static_cast<std::size_t>(at) / 2;
      const unsigned halves = seenHalves(quad, viewpoint);
      const std::uint64_t pair = std::uint64_t{3} << at;
      if (halves == 3) {
        problems.push_back(static_cast<mesh::Id>(triangles_ + quad));
      } else {
        bits_[whole_ / 32 + i] &= ~pair | (halves == 1 ? first : halves == 2 ? second : 0);
      }
    }
  }
}

void FaceSigns::settle(mesh::Id problem, unsigned side) {
  const std::size_t at = 2 * row(problem) + (1U - side);
  interior_bits_[at >> 6] &= ~(std::uint64_t{1} << (at & 63U));
}

// Bit 0: the first half is seen, bit 1: the second.
unsigned FaceSigns::seenHalves(std::size_t quad, const Viewpoint& viewpoint) const {
  Vec3 p[4];
  for (std::size_t k = 0; k < 4; ++k)
    p[k] = mesh_.points[mesh_.quad[quad][k]];
  const double tolerance = sliver(p);
  const Vec3 first[3] = {p[0], p[1], p[2]}, second[3] = {p[0], p[2], p[3]};
  const auto half = [&](const Vec3(&triangle)[3]) {
    return wide(triangle, viewpoint, tolerance) || seen(triangle, viewpoint, tolerance);
  };
  return (half(first) ? 1U : 0U) | (half(second) ? 2U : 0U);
}

std::size_t FaceSigns::bytes() const {
  return 4 * x_.capacity() * sizeof(float) +
         (bits_.capacity() + interior_bits_.capacity() + interior_.capacity()) * sizeof(std::uint64_t) +
         problems_.capacity() * 2 * sizeof(mesh::Id);  // and as they were found
}

}  // namespace spillikin::sort
