// The camera against the formula of base/view.h, its own inverse, and every view it must refuse.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "spillikin/base/error.h"
#include "spillikin/project/camera.h"

namespace spillikin::project {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

View randomView(std::mt19937_64& random, bool parallel) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto point = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  View view;
  view.eye = 10.0 * point();
  view.target = view.eye + point();
  view.up = point();
  view.view_angle = 90.0 + 80.0 * uniform(random);
  view.parallel_scale = parallel ? 3.0 + 2.0 * uniform(random) : 0.0;
  view.width = 200 + static_cast<int>(100.0 * uniform(random));
  view.height = 150 + static_cast<int>(100.0 * uniform(random));
  return view;
}

// base/view.h written out, apart from the camera's own arithmetic.
Vec3 formula(const View& view, double x, double y, double w) {
  const Vec3 forward = glm::normalize(view.target - view.eye);
  const Vec3 right = glm::normalize(glm::cross(forward, view.up));
  const Vec3 top = glm::normalize(glm::cross(right, forward));
  const double half = view.parallel() ? view.parallel_scale : std::tan(view.view_angle * std::acos(-1.0) / 360.0);
  const Vec3 offset = half * (2.0 * (x - view.width / 2.0) / view.height) * right +
                      half * (2.0 * (view.height / 2.0 - y) / view.height) * top;
  return view.parallel() ? view.eye + offset + w * forward : view.eye + w * (forward + offset);
}

class CameraKinds : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Views, CameraKinds, testing::Bool(),
                         [](const auto& parameter) { return parameter.param ? "parallel" : "perspective"; });

TEST_P(CameraKinds, raysFollowTheFormulaOfTheView) {
  const std::uint64_t seed = 7;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 200; ++i) {
    const View view = randomView(random, GetParam());
    const Camera camera(view);
    std::uniform_real_distribution<double> x(0.0, view.width);
    std::uniform_real_distribution<double> y(0.0, view.height);
    std::uniform_real_distribution<double> w(GetParam() ? -5.0 : 0.1, 5.0);
    const double px = x(random);
    const double py = y(random);
    const double depth = w(random);
    const Vec3 ray = camera.origin(px, py) + depth * camera.direction(px, py);
    EXPECT_LT(glm::distance(ray, formula(view, px, py, depth)), 1e-11) << "view " << i;
  }
}

TEST_P(CameraKinds, toScreenInvertsTheRay) {
  const std::uint64_t seed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 200; ++i) {
    const View view = randomView(random, GetParam());
    const Camera camera(view);
    std::uniform_real_distribution<double> x(0.0, view.width);
    std::uniform_real_distribution<double> y(0.0, view.height);
    std::uniform_real_distribution<double> w(GetParam() ? -5.0 : 0.1, 5.0);
    const double px = x(random);
    const double py = y(random);
    const double depth = w(random);
    const Vec3 screen = camera.toScreen(camera.origin(px, py) + depth * camera.direction(px, py));
    const double weight = GetParam() ? 1.0 : depth;
    EXPECT_NEAR(screen.x, px * weight, 1e-9 * view.width) << "view " << i;
    EXPECT_NEAR(screen.y, py * weight, 1e-9 * view.height) << "view " << i;
    EXPECT_NEAR(screen.z, depth, 1e-11) << "view " << i;
  }
}

TEST(Camera, targetIsInTheMiddleAndUpIsUp) {
  View view;
  view.eye = {0.0, 0.0, 5.0};
  view.width = 640;
  view.height = 480;
  for (const double scale : {0.0, 2.0}) {
    view.parallel_scale = scale;
    const Camera camera(view);
    const double weight = camera.parallel() ? 1.0 : 5.0;
    EXPECT_EQ(camera.toScreen(view.target), Vec3(320.0 * weight, 240.0 * weight, 5.0));
    EXPECT_LT(camera.toScreen({0.0, 1.0, 0.0}).y, 240.0 * weight) << "row 0 is the top";
    EXPECT_GT(camera.toScreen({1.0, 0.0, 0.0}).x, 320.0 * weight) << "x runs to the right seen along -z";
  }
}

TEST(Camera, depthIsAlongTheLineOfSightInWorldUnits) {
  View view;
  view.eye = {3.0, -2.0, 1.0};
  view.target = {4.0, 5.0, -7.0};
  const Camera camera(view);
  const Vec3 p(8.0, 2.0, -3.0);
  EXPECT_NEAR(camera.toScreen(p).z, glm::dot(p - view.eye, glm::normalize(view.target - view.eye)), 1e-12);
}

TEST(Camera, extremeScalesSurvive) {
  for (const double scale : {1e-180, 1.0, 1e180}) {
    View view;
    view.eye = {0.0, 0.0, scale};
    view.up = {0.0, scale, 0.0};
    const Camera camera(view);
    EXPECT_EQ(camera.forward(), Vec3(0.0, 0.0, -1.0)) << scale;
    EXPECT_EQ(camera.top(), Vec3(0.0, 1.0, 0.0)) << scale;
  }
}

struct Refusal {
  const char* name;
  void (*spoil)(View&);
  const char* says;
};

class CameraRefuses : public testing::TestWithParam<Refusal> {};
INSTANTIATE_TEST_SUITE_P(
    Views, CameraRefuses,
    testing::Values(Refusal{"eyeAtTarget", [](View& v) { v.eye = v.target; }, "eye and target"},
                    Refusal{"eyeNaN", [](View& v) { v.eye.x = nan; }, "finite"},
                    Refusal{"targetInfinite", [](View& v) { v.target.y = infinity; }, "finite"},
                    Refusal{"upNaN", [](View& v) { v.up.z = nan; }, "finite"},
                    Refusal{"upZero", [](View& v) { v.up = Vec3(0.0); }, "up 0,0,0"},
                    Refusal{"upParallel",
                            [](View& v) {
                              v.up = {0.0, 0.0, 2.0};
                            },
                            "parallel to the line of sight"},
                    Refusal{"upAntiparallel",
                            [](View& v) {
                              v.up = {0.0, 0.0, -2.0};
                            },
                            "parallel to the line of sight"},
                    Refusal{"angleZero", [](View& v) { v.view_angle = 0.0; }, "view angle 0"},
                    Refusal{"angleNegative", [](View& v) { v.view_angle = -30.0; }, "view angle -30"},
                    Refusal{"angleStraight", [](View& v) { v.view_angle = 180.0; }, "view angle 180"},
                    Refusal{"angleNaN", [](View& v) { v.view_angle = nan; }, "view angle"},
                    Refusal{"scaleNegative", [](View& v) { v.parallel_scale = -1.0; }, "parallel scale -1"},
                    Refusal{"scaleInfinite", [](View& v) { v.parallel_scale = infinity; }, "parallel scale inf"},
                    Refusal{"scaleNaN", [](View& v) { v.parallel_scale = nan; }, "parallel scale"},
                    Refusal{"noColumns", [](View& v) { v.width = 0; }, "0x768"},
                    Refusal{"negativeRows", [](View& v) { v.height = -5; }, "1024x-5"},
                    Refusal{"tooManyPixels", [](View& v) { v.width = v.height = 100000; }, "100000x100000"},
                    Refusal{"clipWithoutNormal",
                            [](View& v) {
                              v.clips = {{Vec3(1.0), Vec3(0.0)}};
                            },
                            "clip plane 0"},
                    Refusal{"clipNaN",
                            [](View& v) {
                              v.clips = {{}, {Vec3(nan), Vec3(1.0)}};
                            },
                            "clip plane 1"}),
    [](const auto& parameter) { return parameter.param.name; });

TEST_P(CameraRefuses, withOneLineThatNamesIt) {
  View view;
  GetParam().spoil(view);
  try {
    const Camera camera(view);
    FAIL() << "accepted";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find(GetParam().says), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace spillikin::project
