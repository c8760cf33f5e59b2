// The weights of a linear segment in single precision, written once for plain floats and for vectors of them.
//
// With m = (x + y)/2 and e = (y - x)/2, the share of the front colour is front / alpha = 1/2 + delta(m, e), and
// m delta is nearly a polynomial of few terms: reversing the ray turns (m, e) into (-m, e) and delta into -delta, so
// that only even powers of m occur. Thin segments (m < 1.5), which most are, take that polynomial and no exponential.
// Thick ones take Moreland and Angel's closed form with erfcx (growing extinction) or Dawson's function (falling) as
// one rational function of each end. Coefficients are minimax in the relative error.
//
// Error bound: 6e-6 relative for each of front, back and alpha, for x and y from 1e-30 to 1e15 or 0, tested against
// the double-precision weights. Cost: about 30 flops thin; about 110 and three divisions where one lane is thick.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace spillikin::integrate::psi {

inline constexpr float thin = 1.5F;  // optical depth at which the branch changes

// m delta = thin_m0(e) + m^2 thin_m2(e) + m^4 thin_m4(e) + m^6 thin_m6; thin_m0 has no constant term. Error 1.2e-6.
inline constexpr std::array<float, 6> thin_m0 = {-0.166666463F,    -0.0166664217F,   -0.00118924305F,
                                                 -6.60925871e-05F, -2.85105261e-06F, -1.07240808e-07F};
inline constexpr std::array<float, 5> thin_m2 = {0.0833317488F, 0.00277453195F, 0.000395884388F, 3.08473827e-05F,
                                                 1.87454373e-06F};
inline constexpr std::array<float, 3> thin_m4 = {-0.00138425024F, -6.13918673e-05F, -9.01868952e-06F};
inline constexpr float thin_m6 = 2.95443078e-05F;

// (1 - exp(-m)) / m below `thin`. Error 4e-8.
inline constexpr std::array<float, 7> opacity = {0.99999994F,    -0.499997705F,   0.166643277F,   -0.0415750146F,
                                                 0.00815840531F, -0.00121188571F, 0.000103504142F};

// 2^f on [-1/2, 1/2]. Error 8e-8.
inline constexpr std::array<float, 6> power2 = {1.00000012F,   0.693146944F,   0.240221202F,
                                                0.0555071384F, 0.00967554003F, 0.00132763281F};

// sqrt(pi) erfcx(u) / t over t = 1 / (1 + growing_scale u). Error 3e-7.
inline constexpr float growing_scale = 0.4F;
inline constexpr std::array<float, 9> growing = {0.400000036F, 0.399988949F,  0.368391335F,
                                                 0.298734993F, 0.250671804F,  -0.0099190129F,
                                                 0.299671143F, -0.324168354F, 0.0890831202F};

// 2 F(v) / (v t) over t = 1 / (1 + falling_scale v^2), over and under. Error 2e-6.
inline constexpr float falling_scale = 0.3F;
inline constexpr std::array<float, 7> falling_over = {0.300000395F, -1.23002055F, 3.69873081F, -3.85094F,
                                                      6.79897376F,  -6.51256304F, 21.6864709F};
inline constexpr std::array<float, 7> falling_under = {1.0F,       -5.24962815F, 16.9738182F, -26.3485298F,
                                                       31.056097F, -14.9598342F, 7.97341683F};

inline constexpr float most = 1e15F;  // larger depths count as this: squares must not overflow

template <class V>
struct Weights {
  V front, back, alpha;
};

// What the formulas need of a vector of floats; segment_simd-inl.h has the same for Highway.
struct ScalarOps {
  using V = float;
  using M = bool;
  static V set(float a) { return a; }
  static V add(V a, V b) { return a + b; }
  static V sub(V a, V b) { return a - b; }
  static V mul(V a, V b) { return a * b; }
  static V mulAdd(V a, V b, V c) { return a * b + c; }
  static V reciprocal(V a) { return 1.0F / a; }
  static V sqrt(V a) { return std::sqrt(a); }
  static V abs(V a) { return std::abs(a); }
  static V min(V a, V b) { return std::min(a, b); }
  static V round(V a) { return std::nearbyint(a); }
  static V exp2i(V whole) { return std::bit_cast<float>((static_cast<std::int32_t>(whole) + 127) << 23); }
  static M less(V a, V b) { return a < b; }
  static bool all(M m) { return m; }
  static V select(M m, V yes, V no) { return m ? yes : no; }
};

#include "spillikin/integrate/psi_formulas-inl.h"

// One segment: x = front extinction * length, y = back extinction * length.
inline Weights<float> weights(float x, float y) {
  return weights(ScalarOps{}, x, y);
}

}  // namespace spillikin::integrate::psi
