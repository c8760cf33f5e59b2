#include "spillikin/sort/lifted_distance.h"

#include <CGAL/Exact_rational.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace spillikin::sort {
namespace {

using Range = tbb::blocked_range<std::size_t>;

// Of 1024 cells how many may be wild for their size: the fewer, the coarser the bound for all others.
constexpr std::size_t wild_of_1024 = 10;
constexpr double epsilon = 0x1p-53;
constexpr std::size_t padding = 64;

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec3 crossMagnitude(const Vec3& a, const Vec3& b) {
  return {std::abs(a.y * b.z) + std::abs(a.z * b.y), std::abs(a.z * b.x) + std::abs(a.x * b.z),
          std::abs(a.x * b.y) + std::abs(a.y * b.x)};
}
double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
Vec3 abs(const Vec3& a) {
  return {std::abs(a.x), std::abs(a.y), std::abs(a.z)};
}
Vec3 scaled(const Vec3& a, int exponent) {
  return {std::ldexp(a.x, exponent), std::ldexp(a.y, exponent), std::ldexp(a.z, exponent)};
}
double largest(const Vec3& a) {
  return std::max(std::abs(a.x), std::max(std::abs(a.y), std::abs(a.z)));
}

}  // namespace

struct LiftedDistance::Form {
  Vec4 coefficient{0.0};  // gradient, and value at the origin
  double error = std::numeric_limits<double>::infinity();
  double size() const { return std::max(largest(Vec3(coefficient)), std::abs(coefficient.w)); }
};

// The linear function with heights h, h + dh[k] at a, a + e[k], where each edge carries one rounding and each
// difference of heights a few. Of squared lengths the part 2 a is known beforehand. Cramer's rule; every sum of
// products is wrong by at most 32 epsilon of the products' magnitudes.
LiftedDistance::Form LiftedDistance::form(const mesh::Mesh& mesh, std::span<const double> heights,
                                          mesh::Id cell) const {
  const mesh::Id* v = mesh.cell_vertex.data() + 4 * std::size_t{cell};
  const Vec3 a = scaled(mesh.points[v[0]] - origin_, scale_.length);
  const Vec3 base = heights.empty() ? 2.0 * a : Vec3(0.0);
  const double h = heights.empty() ? dot(a, a) : std::ldexp(heights[v[0]], scale_.height);
  std::array<Vec3, 3> e;
  std::array<double, 3> dh{};
  for (std::size_t k = 0; k < 3; ++k) {
    e[k] = scaled(mesh.points[v[k + 1]] - mesh.points[v[0]], scale_.length);
    dh[k] = heights.empty() ? dot(e[k], e[k]) : std::ldexp(heights[v[k + 1]] - heights[v[0]], scale_.height);
  }
  Form form;
  const double det = dot(e[0], cross(e[1], e[2]));
  const double det_error = 32.0 * epsilon * dot(abs(e[0]), crossMagnitude(e[1], e[2]));
  if (!(std::abs(det) > 2.0 * det_error)) return form;
  const Vec3 sum = dh[0] * cross(e[1], e[2]) + dh[1] * cross(e[2], e[0]) + dh[2] * cross(e[0], e[1]);
  const Vec3 sum_error = 32.0 * epsilon *
                         (std::abs(dh[0]) * crossMagnitude(e[1], e[2]) + std::abs(dh[1]) * crossMagnitude(e[2], e[0]) +
                          std::abs(dh[2]) * crossMagnitude(e[0], e[1]));
  const Vec3 part = sum / det, gradient = base + part;
  const Vec3 error = 2.0 / std::abs(det) * (sum_error + det_error * abs(part)) +
                     8.0 * epsilon * (abs(base) + abs(part)) + Vec3(8.0 * epsilon);
  const double offset_error =
      dot(error, abs(a)) + 16.0 * epsilon * (std::abs(h) + dot(abs(gradient), abs(a)) + largest(gradient));
  if (!std::isfinite(offset_error)) return form;
  return {Vec4(gradient, h - dot(gradient, a)), std::max(largest(error), offset_error)};
}

// The same in rationals, for cells too flat for doubles.
LiftedDistance::Form LiftedDistance::exactForm(const mesh::Mesh& mesh, std::span<const double> heights,
                                               mesh::Id cell) const {
  using Number = CGAL::Exact_rational;
  using Vector = std::array<Number, 3>;
  const auto crossed = [](const Vector& a, const Vector& b) {
    return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto dotted = [](const Vector& a, const Vector& b) -> Number {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  };
  const auto away = [](const Vec3& p, const Vec3& q) {
    return Vector{Number(p.x) - Number(q.x), Number(p.y) - Number(q.y), Number(p.z) - Number(q.z)};
  };
  const mesh::Id* v = mesh.cell_vertex.data() + 4 * std::size_t{cell};
  const Vector a = away(mesh.points[v[0]], origin_);
  std::array<Vector, 3> e;
  std::array<Number, 3> dh;
  const Number h = heights.empty() ? dotted(a, a) : Number(heights[v[0]]);
  for (std::size_t k = 0; k < 3; ++k) {
    e[k] = away(mesh.points[v[k + 1]], mesh.points[v[0]]);
    const Vector b = away(mesh.points[v[k + 1]], origin_);
    dh[k] = (heights.empty() ? dotted(b, b) : Number(heights[v[k + 1]])) - h;
  }
  const Vector yz = crossed(e[1], e[2]), zx = crossed(e[2], e[0]), xy = crossed(e[0], e[1]);
  const Number det = dotted(e[0], yz);
  if (det == 0) return {};
  Vector gradient;
  for (std::size_t k = 0; k < 3; ++k)
    gradient[k] = (dh[0] * yz[k] + dh[1] * zx[k] + dh[2] * xy[k]) / det;
  const Number offset = h - dotted(gradient, a);
  const Vec3 g(CGAL::to_double(gradient[0]), CGAL::to_double(gradient[1]), CGAL::to_double(gradient[2]));
  Form form{Vec4(scaled(g, scale_.height - scale_.length), std::ldexp(CGAL::to_double(offset), scale_.height)), 0.0};
  if (!std::isfinite(form.size())) return {};
  form.error = 2.0 * epsilon * form.size();
  return form;
}

void LiftedDistance::chooseScale(const mesh::Mesh& mesh, std::span<const double> heights) {
  if (mesh.points.empty()) return;
  Vec3 lower = mesh.points.front(), upper = lower;
  for (const Vec3& p : mesh.points) {
    lower = Vec3(std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z));
    upper = Vec3(std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z));
  }
  origin_ = 0.5 * lower + 0.5 * upper;
  const double extent = std::max(largest(upper - origin_), largest(lower - origin_));
  if (extent > 0.0 && std::isfinite(extent)) scale_.length = -std::ilogb(extent) - 1;
  scale_.height = 2 * scale_.length;  // of squared lengths
  double highest = 0.0;
  for (const double h : heights)
    highest = std::max(highest, std::abs(h));
  if (highest > 0.0 && std::isfinite(highest)) scale_.height = -std::ilogb(highest) - 1;
}

void LiftedDistance::tameForms(const mesh::Mesh& mesh, std::span<const double> heights, std::vector<mesh::Id>& wild) {
  const std::size_t padded = (count_ + padding - 1) / padding * padding;
  for (auto* coefficient : {&x_, &y_, &z_, &w_})
    coefficient->resize(padded);
  std::vector<float> size(count_), error(count_);
  tbb::parallel_for(Range(0, count_, 4096), [&](const Range& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      const Form f = form(mesh, heights, static_cast<mesh::Id>(c));
      size[c] = static_cast<float>(f.size());
      error[c] = static_cast<float>(f.error);
      x_[c] = static_cast<float>(f.coefficient.x);
      y_[c] = static_cast<float>(f.coefficient.y);
      z_[c] = static_cast<float>(f.coefficient.z);
      w_[c] = static_cast<float>(f.coefficient.w);
    }
  });
  std::vector<float> order = size;
  if (!order.empty()) {
    const auto at = order.end() - 1 - static_cast<std::ptrdiff_t>(order.size() * wild_of_1024 / 1024);
    std::nth_element(order.begin(), at, order.end());
    magnitude_ = *at;
  }
  for (std::size_t c = 0; c < count_; ++c) {
    if (size[c] <= magnitude_ && error[c] <= 0x1p-25 * magnitude_) continue;
    wild.push_back(static_cast<mesh::Id>(c));
    x_[c] = y_[c] = z_[c] = w_[c] = 0.0F;
  }
}

void LiftedDistance::wildForms(const mesh::Mesh& mesh, std::span<const double> heights,
                               const std::vector<mesh::Id>& wild) {
  std::vector<std::uint8_t> hopeless(wild.size(), 0);
  wild_.resize(wild.size());
  tbb::parallel_for(Range(0, wild.size(), 64), [&](const Range& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      Form f = form(mesh, heights, wild[i]);
      if (!(f.error <= 0x1p-25 * magnitude_)) f = exactForm(mesh, heights, wild[i]);
      hopeless[i] = f.error <= 0x1p-25 * magnitude_ ? 0 : 1;
      wild_[i] = {wild[i], f.coefficient};
    }
  });
  for (std::size_t i = 0; i < wild.size(); ++i) {
    if (hopeless[i] == 0) continue;
    for (const mesh::FaceUse use : mesh.faces(wild[i])) {
      if (!mesh.exterior(use.face())) hopeless_.push_back(use.face());
    }
  }
  std::sort(hopeless_.begin(), hopeless_.end());
  hopeless_.erase(std::unique(hopeless_.begin(), hopeless_.end()), hopeless_.end());
}

LiftedDistance::LiftedDistance(const mesh::Mesh& mesh, unsigned key_bits, std::span<const double> heights)
    : count_(mesh.cell_count()), key_bits_(key_bits) {
  chooseScale(mesh, heights);
  std::vector<mesh::Id> wild;
  tameForms(mesh, heights, wild);
  wildForms(mesh, heights, wild);
}

// A cell's distance is computed with an error of at most 2^-21 s, s = magnitude * (|v.x| + |v.y| + |v.z| + v.w). If
// tame: its coefficients are within 2^-23 of the magnitude, the viewpoint's floats within 2^-24 of themselves (and the
// little that doubles round), and each of four products adds less than 2^-24 s, or twice that where they are not fused.
// If wild: its coefficients are within 2^-25 of the magnitude, what doubles round is far less, and the result's
// rounding to float is worth less than half a key. Making a key of the distance keeps order. Keys' steps are at least
// 1 / (even scale) long, and roundings on the way, of 2^-24 of the number each, are worth less than half a step;
// cutting off is worth one: so keys differ by less than the exact distances' steps and three more.
LiftedDistance::View LiftedDistance::view(const Viewpoint& viewpoint) const {
  View view;
  const bool parallel = viewpoint.w == 0.0;
  Vec3 v = parallel ? Vec3(viewpoint) : scaled(Vec3(viewpoint) - origin_, scale_.length);
  double w = parallel ? 0.0 : 1.0;
  const double size = std::max(largest(v), w);
  const int exponent = size > 0.0 && std::isfinite(size) ? -std::ilogb(size) : 0;
  v = scaled(v, exponent);
  w = std::ldexp(w, exponent);
  view.at = Vec4(v, w);
  KeyQuery& query = view.query;
  query.bits = key_bits_;
  query.x = static_cast<float>(v.x);
  query.y = static_cast<float>(v.y);
  query.z = static_cast<float>(v.z);
  query.w = static_cast<float>(w);

  constexpr std::size_t samples = 512, tail = 128;
  std::array<float, samples> sample{};
  const std::size_t taken = std::min(samples, count_);
  for (std::size_t i = 0; i < taken; ++i) {
    const std::size_t c = i * count_ / taken;
    sample[i] = x_[c] * query.x + y_[c] * query.y + z_[c] * query.z + w_[c] * query.w;
  }
  std::sort(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(taken));
  if (taken > 0) {
    const float low = sample[taken / tail], high = sample[taken - 1 - taken / tail];
    query.middle = 0.5F * low + 0.5F * high;
    const float scale = 2.0F / (high - low);
    query.scale = std::isfinite(scale) && scale > 0.0F ? scale : 1.0F;
  }
  const double s = magnitude_ * (std::abs(v.x) + std::abs(v.y) + std::abs(v.z) + w);
  const double steps = std::ceil(2.0 * 0x1p-21 * s * static_cast<double>(query.scale) * query.even()) + 3.0;
  view.certain = steps < 0x1p22 ? static_cast<std::uint32_t>(steps) : 1U << 22;
  return view;
}

std::uint32_t liftedKey(float distance, const KeyQuery& query) {
  std::uint32_t key = 0;
  // The same function as the linear pass: padding makes up the rest of a vector.
  const KeyQuery one{1.0F, 0.0F, 0.0F, 0.0F, query.middle, query.scale, query.bits};
  const float x[padding] = {distance}, zero[padding] = {};
  liftedKeys(x, zero, zero, zero, 1, one, &key);
  return key;
}

void LiftedDistance::keys(const View& view, std::size_t begin, std::size_t end, std::uint32_t* keys) const {
  liftedKeys(x_.data() + begin, y_.data() + begin, z_.data() + begin, w_.data() + begin, end - begin, view.query,
             keys + begin);
  auto wild =
      std::lower_bound(wild_.begin(), wild_.end(), begin, [](const Wild& w, std::size_t c) { return w.cell < c; });
  for (; wild != wild_.end() && wild->cell < end; ++wild) {
    const Vec4 &f = wild->form, &v = view.at;
    const double distance = f.x * v.x + f.y * v.y + f.z * v.z + f.w * v.w, most = std::numeric_limits<float>::max();
    keys[wild->cell] = liftedKey(static_cast<float>(std::clamp(distance, -most, most)), view.query);
  }
}

std::size_t LiftedDistance::bytes() const {
  return sizeof(float) * (x_.capacity() + y_.capacity() + z_.capacity() + w_.capacity()) +
         wild_.capacity() * sizeof(Wild) + hopeless_.capacity() * sizeof(mesh::Id);
}

}  // namespace spillikin::sort
