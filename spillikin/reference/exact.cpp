#include "spillikin/reference/exact.h"

#include <array>
#include <cmath>

namespace spillikin::reference {
namespace {

// The exact sum of its terms, which are nonoverlapping, ascending in magnitude and never zero.
template <int N>
struct Expansion {
  std::array<double, N> term;
  int size = 0;

  void push(double value) {
    if (value != 0.0) term[static_cast<std::size_t>(size++)] = value;
  }
  double estimate() const {
    double sum = 0.0;
    for (int n = 0; n < size; ++n)
      sum += term[static_cast<std::size_t>(n)];
    return sum;
  }
};

struct Pair {
  double high, low;
};

Pair twoSum(double a, double b) {
  const double sum = a + b;
  const double part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}

Pair twoProduct(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

Expansion<2> difference(double a, double b) {
  const Pair d = twoSum(a, -b);
  Expansion<2> e;
  e.push(d.low);
  e.push(d.high);
  return e;
}

// Adds one double in place (GROW-EXPANSION): what is written never overtakes what is still to be read.
template <int N>
void grow(Expansion<N>& e, double value) {
  const int terms = e.size;
  double q = value;
  e.size = 0;
  for (int n = 0; n < terms; ++n) {
    const Pair s = twoSum(q, e.term[static_cast<std::size_t>(n)]);
    e.push(s.low);
    q = s.high;
  }
  e.push(q);
}

// e += scale * f, f of any length; every product is split into two doubles without error.
template <int N, int M>
void addScaled(Expansion<N>& e, const Expansion<M>& f, double scale) {
  for (int n = 0; n < f.size; ++n) {
    const Pair p = twoProduct(f.term[static_cast<std::size_t>(n)], scale);
    grow(e, p.low);
    grow(e, p.high);
  }
}

// e += sign * a * b.
template <int N>
void addProduct(Expansion<N>& e, const Expansion<2>& a, const Expansion<2>& b, double sign) {
  for (int n = 0; n < b.size; ++n)
    addScaled(e, a, sign * b.term[static_cast<std::size_t>(n)]);
}

// a_m b_n - a_n b_m, of 16 terms at most.
Expansion<20> minor(const std::array<Expansion<2>, 3>& a, const std::array<Expansion<2>, 3>& b, std::size_t m,
                    std::size_t n) {
  Expansion<20> e;
  addProduct(e, a[m], b[n], 1.0);
  addProduct(e, a[n], b[m], -1.0);
  return e;
}

// The sign of det[by, q - p, d].
int movedSign(const Line& line, const Vec3& p, const Vec3& q, const Vec3& by) {
  Expansion<60> sum;
  for (int m = 0; m < 3; ++m) {
    const int n = (m + 1) % 3, o = (m + 2) % 3;
    const Pair one = twoProduct(line.d[n], by[o]), other = twoProduct(line.d[o], -by[n]);
    Expansion<6> across;
    for (const double term : {one.low, one.high, other.low, other.high})
      grow(across, term);
    const Expansion<2> edge = difference(q[m], p[m]);
    for (int t = 0; t < edge.size; ++t)
      addScaled(sum, across, edge.term[static_cast<std::size_t>(t)]);
  }
  if (sum.size == 0) return 0;
  return sum.term[static_cast<std::size_t>(sum.size - 1)] > 0.0 ? 1 : -1;
}

}  // namespace

Line::Line(const Vec3& origin, const Vec3& direction) : o(origin), d(direction) {
  k = 0;
  if (std::abs(d[1]) > std::abs(d[k])) k = 1;
  if (std::abs(d[2]) > std::abs(d[k])) k = 2;
  i = (k + 1) % 3;
  j = (k + 2) % 3;
  sx = d[i] / d[k];
  sy = d[j] / d[k];
  const double dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  inverse_dd = 1.0 / dd;
  length = std::sqrt(dd);
  first[i] = 1.0;
  second[j] = 1.0;
}

Line::Line(const Vec3& origin, const Vec3& direction, const Vec3& first_move, const Vec3& second_move)
    : Line(origin, direction) {
  first = first_move;
  second = second_move;
}

double exactEdge(const Line& line, const Vec3& p, const Vec3& q) {
  // det[p - o, q - o, d] = d_k (x_p y_q - x_q y_p), the axes permuted evenly to (i, j, k).
  std::array<Expansion<2>, 3> a, b;
  const std::array<int, 3> axes{line.i, line.j, line.k};
  for (std::size_t n = 0; n < 3; ++n) {
    a[n] = difference(p[axes[n]], line.o[axes[n]]);
    b[n] = difference(q[axes[n]], line.o[axes[n]]);
  }
  Expansion<110> det;
  addScaled(det, minor(a, b, 1, 2), line.d[line.i]);
  addScaled(det, minor(a, b, 2, 0), line.d[line.j]);
  addScaled(det, minor(a, b, 0, 1), line.d[line.k]);
  return det.estimate() / line.d[line.k];
}

int perturbedSide(const Line& line, const Vec3& p, const Vec3& q, double& value) {
  value = exactEdge(line, p, q);
  if (value != 0.0) return value > 0.0 ? 1 : -1;
  // Moving o by v takes det[v, q - p, d] from det[p - o, q - o, d].
  int moved = movedSign(line, p, q, line.first);
  if (moved == 0) moved = movedSign(line, p, q, line.second);
  return line.d[line.k] > 0.0 ? -moved : moved;
}

}  // namespace spillikin::reference
