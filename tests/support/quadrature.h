// Adaptive Gauss-Kronrod quadrature in long double: the judge of the closed forms.
#pragma once

#include <array>
#include <cmath>

namespace spillikin::test {

// The integral of f over [a, b] by the pair of 7 and 15 points, halved until each part is good to `relative` of
// itself halved 40 times. What is reached is far better than `relative`, which is the two rules' difference.
template <class F>
long double kronrod(const F& f, long double a, long double b, long double relative, int depth = 0) {
  static constexpr std::array<long double, 8> node = {
      0.991455371120812639206854697526329L, 0.949107912342758524526189684047851L,
      0.864864423359769072789712788640926L, 0.741531185599394439863864773280788L,
      0.586087235467691130294144691693013L, 0.405845151377397166906606412076961L,
      0.207784955007898467600689403773245L, 0.0L};
  static constexpr std::array<long double, 8> k15 = {
      0.022935322010529224963732008058970L, 0.063092092629978553290700663189204L, 0.104790010322250183839876322541518L,
      0.140653259715525918745189590510238L, 0.169004726639267902826583426598550L, 0.190350578064785409913256402421014L,
      0.204432940075298892414161999234649L, 0.209482141084727828012999174891714L};
  static constexpr std::array<long double, 4> g7 = {
      0.129484966168869693270611432679082L, 0.279705391489276667901467771423780L, 0.381830050505118944950369775488975L,
      0.417959183673469387755102040816327L};
  const long double middle = (a + b) / 2;
  const long double half = (b - a) / 2;
  const long double centre = f(middle);
  long double fine = k15[7] * centre;
  long double coarse = g7[3] * centre;
  for (std::size_t i = 0; i < 7; ++i) {
    const long double pair = f(middle - half * node[i]) + f(middle + half * node[i]);
    fine += k15[i] * pair;
    if (i % 2 == 1) coarse += g7[i / 2] * pair;
  }
  if (std::fabs(fine - coarse) <= relative * std::fabs(fine) || depth == 40) return fine * half;
  return kronrod(f, a, middle, relative, depth + 1) + kronrod(f, middle, b, relative, depth + 1);
}

// The same over [0, 1] for an integrand that may live in a thin layer at 0: parts that shrink by half towards it.
template <class F>
long double layered(const F& f, long double relative) {
  long double sum = 0.0L;
  long double end = 1.0L;
  for (int k = 0; k < 48; ++k, end /= 2)
    sum += kronrod(f, end / 2, end, relative);
  return sum + kronrod(f, 0.0L, end, relative);
}

}  // namespace spillikin::test
