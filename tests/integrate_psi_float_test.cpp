// The weights in single precision, plain and in vectors, against those in double.
#include <gtest/gtest.h>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "spillikin/integrate/psi_float.h"
#include "spillikin/integrate/segment.h"
#include "spillikin/integrate/segment_batch.h"
#include "spillikin/integrate/segment_glsl.h"

// The shader's text as C++: what is tested is what is sent.
namespace spillikin::integrate::glsl {
namespace {

using glm::vec3;
using std::abs, std::exp, std::min, std::sqrt;
#define SPILLIKIN_GLSL(...) __VA_ARGS__
#include "spillikin/integrate/segment_glsl.inc"
#undef SPILLIKIN_GLSL

}  // namespace
}  // namespace spillikin::integrate::glsl

namespace spillikin::integrate {
namespace {

constexpr double bound = 6e-6;  // relative, of each weight; what psi_float.h states

struct Ends {
  std::vector<float> x, y;
};

// Every depth from 1e-7 to 1e6, every difference from none to all, and both ends at 0.
Ends sweep() {
  Ends ends;
  const auto add = [&](double x, double y) {
    ends.x.push_back(static_cast<float>(x));
    ends.y.push_back(static_cast<float>(y));
  };
  for (double depth = 1e-7; depth < 1.1e6; depth *= 1.013) {
    for (double r = 1.0; r > 1e-8; r *= 0.71) {
      add(depth * (1.0 - r), depth * (1.0 + r));
      add(depth * (1.0 + r), depth * (1.0 - r));
    }
    add(depth, depth);
    add(depth, 1e-30);
    add(1e-30, depth);
  }
  add(0.0, 0.0);
  add(1e-30, 1e-30);
  add(1e20, 1.0);
  add(1.0, 1e20);
  add(1e20, 1e20);
  return ends;
}

double relative(double value, double truth) {
  return truth == 0.0 ? std::abs(value) : std::abs(value / truth - 1.0);
}

struct Worst {
  double error = 0.0;
  float x = 0.0F, y = 0.0F;
  void take(double e, float at_x, float at_y) {
    if (!(e <= error)) *this = {e, at_x, at_y};
  }
};

void expectClose(const Ends& ends, const std::vector<float>& front, const std::vector<float>& back,
                 const std::vector<float>& alpha) {
  Worst worst[3];
  for (std::size_t i = 0; i < ends.x.size(); ++i) {
    const float x = ends.x[i];
    const float y = ends.y[i];
    const Weights truth = weights(static_cast<double>(x), static_cast<double>(y));
    worst[0].take(relative(front[i], truth.front), x, y);
    // Beyond `most` a back weight near 1e-20 is not followed; it adds nothing to a picture.
    if (x <= psi::most && y <= psi::most) worst[1].take(relative(back[i], truth.back), x, y);
    worst[2].take(relative(alpha[i], truth.alpha), x, y);
  }
  const char* names[] = {"front", "back", "alpha"};
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(worst[k].error, bound) << names[k] << " at x " << worst[k].x << ", y " << worst[k].y;
    testing::Test::RecordProperty(std::string(names[k]) + "_error", std::to_string(worst[k].error * 1e6) + "e-6");
  }
}

TEST(PsiFloat, ReachesDoubleForAnyDepthAndDifference) {
  const Ends ends = sweep();
  std::vector<float> front, back, alpha;
  for (std::size_t i = 0; i < ends.x.size(); ++i) {
    const psi::Weights<float> w = psi::weights(ends.x[i], ends.y[i]);
    front.push_back(w.front);
    back.push_back(w.back);
    alpha.push_back(w.alpha);
  }
  expectClose(ends, front, back, alpha);
}

TEST(PsiFloat, AsAShaderReachesDoubleToo) {
  const Ends ends = sweep();
  std::vector<float> front, back, alpha;
  for (std::size_t i = 0; i < ends.x.size(); ++i) {
    const glm::vec3 w = glsl::segmentWeights(ends.x[i], ends.y[i]);
    front.push_back(w.x);
    back.push_back(w.y);
    alpha.push_back(w.z);
    const double depth = 0.5 * ends.x[i] + 0.5 * ends.y[i];
    EXPECT_NEAR(glsl::segmentOpacity(static_cast<float>(depth)), -std::expm1(-depth), bound * -std::expm1(-depth));
  }
  expectClose(ends, front, back, alpha);
  EXPECT_NE(std::string(segment_glsl).find("vec3 segmentWeights(float x, float y) {"), std::string::npos);
}

TEST(PsiFloat, InVectorsReachesDoubleToo) {
  // Sorted as swept (whole vectors thin or thick) and shuffled (mixed).
  Ends ends = sweep();
  for (int round = 0; round < 2; ++round) {
    const std::size_t n = ends.x.size();
    std::vector<float> front(n), back(n), alpha(n);
    weights(ends.x, ends.y, front, back, alpha);
    expectClose(ends, front, back, alpha);
    std::mt19937 random(3);
    for (std::size_t i = n; i-- > 1;) {
      const std::size_t j = std::uniform_int_distribution<std::size_t>(0, i)(random);
      std::swap(ends.x[i], ends.x[j]);
      std::swap(ends.y[i], ends.y[j]);
    }
  }
}

TEST(PsiFloat, DoesNotJumpAtTheBorderOfItsBranches) {
  for (float x = 0.0F; x <= 2.0F * psi::thin; x += 1.0F / 64.0F) {
    const float y = 2.0F * psi::thin - x;
    const auto thin = psi::thinWeights(psi::ScalarOps{}, x, y);
    const auto thick = psi::thickWeights(psi::ScalarOps{}, x, y);
    EXPECT_NEAR(thin.front, thick.front, 1e-5F * thick.front) << x;
    EXPECT_NEAR(thin.back, thick.back, 1e-5F * thick.back) << x;
    EXPECT_NEAR(thin.alpha, thick.alpha, 1e-6F) << x;
  }
}

TEST(PsiFloat, TakesAnyNumberOfSegments) {
  for (std::size_t n = 0; n < 70; ++n) {
    std::vector<float> x(n), y(n), front(n, -1.0F), back(n, -1.0F), alpha(n, -1.0F);
    for (std::size_t i = 0; i < n; ++i) {
      x[i] = 0.01F * static_cast<float>(i);
      y[i] = 0.07F * static_cast<float>(i);
    }
    weights(x, y, front, back, alpha);
    for (std::size_t i = 0; i < n; ++i)
      EXPECT_NEAR(front[i] + back[i], alpha[i], 1e-6F) << n << " " << i;
  }
}

}  // namespace
}  // namespace spillikin::integrate
