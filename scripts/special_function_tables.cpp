// Prints the coefficient tables of spillikin/integrate/special_functions.cpp, computed in quadruple precision:
//   g++ -O2 -std=gnu++20 scripts/special_function_tables.cpp -lquadmath -o tables && ./tables
// Each piece is a Chebyshev interpolant, rewritten in powers of the piece's own variable in [-1, 1].
#include <quadmath.h>

#include <cstdio>
#include <functional>
#include <vector>

using Quad = __float128;
using Function = std::function<Quad(Quad)>;

// Dawson's function: all terms of the series are positive, so that it loses nothing.
static Quad dawson(Quad x) {
  if (x > 40) {
    Quad term = 1, sum = 1;  // 2 x F(x) = sum (2n-1)!! / (2 x^2)^n
    for (int n = 1; n < 60; ++n)
      sum += term *= (2 * n - 1) / (2 * x * x);
    return sum / (2 * x);
  }
  Quad power = x, sum = x;
  for (int n = 1; n < 8000; ++n) {
    power *= x * x / n;
    sum += power / (2 * n + 1);
    if (power < sum * 1e-36Q) break;
  }
  return sum * expq(-x * x);
}

static Quad erfcx(Quad x) {
  if (x > 40) {
    Quad term = 1, sum = 1;
    for (int n = 1; n < 60; ++n)
      sum += term *= -(2 * n - 1) / (2 * x * x);
    return sum / (x * sqrtq(M_PIq));
  }
  return expq(x * x) * erfcq(x);
}

static void piece(const char* name, const Function& f, Quad lo, Quad hi, int terms) {
  std::vector<Quad> c(terms), power(terms, 0), t0(terms, 0), t1(terms, 0);
  const int n = 80;
  for (int k = 0; k < terms; ++k) {
    for (int j = 0; j < n; ++j) {
      const Quad angle = M_PIq * (j + 0.5Q) / n;
      c[k] += f((lo + hi) / 2 + (hi - lo) / 2 * cosq(angle)) * cosq(k * angle) * 2 / n;
    }
  }
  c[0] /= 2;
  t0[0] = 1;
  t1[1] = 1;
  for (int k = 0; k < terms; ++k) {
    for (int j = 0; j < terms; ++j)
      power[j] += c[k] * t0[j];
    std::vector<Quad> t2(terms, 0);
    for (int j = 0; j < terms; ++j)
      t2[j] = (j ? 2 * t1[j - 1] : 0) - t0[j];
    t0 = t1;
    t1 = t2;
  }
  std::printf("    // %s; the last Chebyshev coefficient is %.0e\n    {{", name, static_cast<double>(c[terms - 1]));
  for (int j = 0; j < terms; ++j)
    std::printf("%s%.17g", j ? ", " : "", static_cast<double>(power[j]));
  std::printf("}},\n");
}

int main() {
  const int terms = 18;
  std::printf("dawson(x) / x\n");
  const Function f = [](Quad x) { return x == 0 ? 1 : dawson(x) / x; };
  const double cuts[] = {0, 1, 2, 3, 4, 5};
  for (int k = 0; k < 5; ++k) {
    char name[64];
    std::snprintf(name, sizeof name, "%g <= x < %g", cuts[k], cuts[k + 1]);
    piece(name, f, cuts[k], cuts[k + 1], terms);
  }
  piece(
      "2 x F(x) over 1 / x^2 <= 1 / 25", [](Quad r) { return r == 0 ? 1 : 2 / sqrtq(r) * dawson(1 / sqrtq(r)); }, 0,
      1 / 25.0Q, 26);
  std::printf("erfcx(x)\n");
  for (int k = 0; k < 5; ++k) {
    char name[64];
    std::snprintf(name, sizeof name, "%g <= x < %g", cuts[k], cuts[k + 1]);
    piece(name, erfcx, cuts[k], cuts[k + 1], terms);
  }
  piece(
      "sqrt(pi) x erfcx(x) over 1 / x^2 <= 1 / 25",
      [](Quad r) { return r == 0 ? 1 : sqrtq(M_PIq) / sqrtq(r) * erfcx(1 / sqrtq(r)); }, 0, 1 / 25.0Q, 26);
}
