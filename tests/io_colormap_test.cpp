// Transfer functions from JSON.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "io_samples.h"
#include "spillikin/base/error.h"
#include "spillikin/io/read_colormap.h"

namespace {

using namespace spillikin;
using integrate::ControlPoint;
using integrate::Optical;
using integrate::TransferFunction;
using tests::TempFolder;

TransferFunction read(const std::string& json, double unit_distance = 1.0) {
  const TempFolder folder;
  tests::writeText(folder / "map.json", json);
  return io::readTransferFunction(folder / "map.json", unit_distance);
}

std::string refusal(const std::string& json) {
  const TempFolder folder;
  tests::writeText(folder / "map.json", json);
  try {
    io::readTransferFunction(folder / "map.json");
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(folder / "map.json"), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    EXPECT_NE(text.find(';'), std::string::npos) << "no remedy: " << text;
    return text;
  }
  ADD_FAILURE() << "was read: " << json;
  return {};
}

void expectColor(const Optical& optical, double r, double g, double b, double tolerance = 1e-12) {
  EXPECT_NEAR(optical.color[0], r, tolerance);
  EXPECT_NEAR(optical.color[1], g, tolerance);
  EXPECT_NEAR(optical.color[2], b, tolerance);
}

TEST(OwnJson, PointsAsWritten) {
  const TransferFunction tf = read(R"({"points": [{"value": -1, "color": [0, 0.5, 1], "extinction": 0},
      {"value": 2, "color": [1, 1, 1], "extinction": 3e2}, {"value": 2, "color": [0, 0, 0], "extinction": 0}]})");
  ASSERT_EQ(tf.points().size(), 3U);
  EXPECT_EQ(tf.points()[0].value, -1.0);
  EXPECT_EQ(tf.points()[0].color, (std::array<double, 3>{0, 0.5, 1}));
  EXPECT_EQ(tf.points()[1].extinction, 300.0);
  EXPECT_EQ(tf.points()[2].extinction, 0.0);
}

TEST(OwnJson, RefusesAndNamesTheEntry) {
  const auto says = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const std::string good = R"({"value": 0, "color": [0, 0, 0], "extinction": 0})";
  says(refusal(""), "empty");
  says(refusal("{\n\"points\": [,]}"), "line 2");
  says(refusal("{}"), "RGBPoints");
  says(refusal("[]"), "RGBPoints");
  says(refusal("3"), "RGBPoints");
  says(refusal(R"({"points": []})"), "points");
  says(refusal(R"({"points": [)" + good + R"(, {"value": 1, "color": [0, 0, 0]}]})"),
       "points[1] has no \"extinction\"");
  says(refusal(R"({"points": [{"value": "a", "color": [0, 0, 0], "extinction": 0}]})"), "points[0].value");
  says(refusal(R"({"points": [{"value": 0, "color": [0, 0], "extinction": 0}]})"), "points[0].color");
  says(refusal(R"({"points": [{"value": 0, "color": [0, 0, 2], "extinction": 0}]})"), "points[0].color[2]");
  says(refusal(R"({"points": [{"value": 0, "color": [0, 0, 0], "extinction": -1}]})"), "points[0].extinction");
  says(refusal(R"({"points": [{"value": 1, "color": [0, 0, 0], "extinction": 1}, )" + good + "]}"), "points[1].value");
  says(refusal(R"({"points": [)" + good + "," + good + "," + good + "]}"), "");
  says(refusal(R"({"points": [{"value": 1e999, "color": [0, 0, 0], "extinction": 1}]})"), "number");
  says(refusal(R"({"points": 3})"), "list");
  says(refusal(R"({"points": [3]})"), "points[0]");
}

TEST(OwnJson, MissingFileAndFolder) {
  const TempFolder folder;
  EXPECT_THROW(io::readTransferFunction(folder / "no.json"), Error);
  EXPECT_THROW(io::readTransferFunction(folder.path().string()), Error);
}

constexpr const char* linear = R"([{"ColorSpace": "RGB", "Name": "x", "NanColor": [1, 1, 0],
    "RGBPoints": [0, 0, 0, 1, 10, 1, 0, 0], "Points": [0, 0, 0.5, 0, 10, 0.75, 0.5, 0]}])";

// The opacity is linear in the value, so that extinction is not: -ln(1 - a) / unit everywhere.
TEST(ParaView, OpacityBecomesExtinction) {
  for (const double unit : {1.0, 0.125}) {
    const TransferFunction tf = read(linear, unit);
    EXPECT_DOUBLE_EQ(tf.points().front().extinction, 0.0);
    EXPECT_DOUBLE_EQ(tf.points().back().extinction, -std::log(0.25) / unit);
    for (int i = 0; i <= 1000; ++i) {
      const double v = i / 100.0;
      expectColor(tf(v), v / 10, 0, 1 - v / 10);
      EXPECT_NEAR(1.0 - std::exp(-tf(v).extinction * unit), 0.075 * v, 1.0 / 1024);
    }
    EXPECT_LT(tf.points().size(), 40U);
  }
}

TEST(ParaView, ASingleObjectIsReadToo) {
  const std::string list = linear;
  const std::string object = list.substr(1, list.size() - 2);
  EXPECT_EQ(read(object).points().size(), read(list).points().size());
}

TEST(ParaView, FullOpacityIsCapped) {
  const TransferFunction tf = read(R"({"RGBPoints": [0, 1, 1, 1], "Points": [0, 1, 0.5, 0]})");
  EXPECT_NEAR(tf(0.0).extinction, 24.0 * std::log(2.0), 1e-6);
}

TEST(ParaView, WithoutOpacitiesExtinctionRises) {
  const TransferFunction tf = read(R"([{"ColorSpace": "RGB", "RGBPoints": [2, 0, 0, 0, 4, 1, 1, 1]}])", 0.5);
  EXPECT_DOUBLE_EQ(tf(2.0).extinction, 0.0);
  EXPECT_DOUBLE_EQ(tf(3.0).extinction, 1.0);
  EXPECT_DOUBLE_EQ(tf(4.0).extinction, 2.0);
}

TEST(ParaView, SharpOpacityIsAStepAtTheMidpoint) {
  const TransferFunction tf =
      read(R"({"RGBPoints": [0, 1, 1, 1, 10, 1, 1, 1], "Points": [0, 0, 0.25, 1, 10, 0.5, 0.5, 0]})");
  EXPECT_EQ(tf(2.499).extinction, 0.0);
  EXPECT_NEAR(tf(2.501).extinction, std::log(2.0), 1e-12);
  EXPECT_LE(tf.points().size(), 5U);
}

TEST(ParaView, MidpointBendsOpacity) {
  const TransferFunction tf =
      read(R"({"RGBPoints": [0, 1, 1, 1, 10, 1, 1, 1], "Points": [0, 0, 0.25, 0, 10, 0.5, 0.5, 0]})");
  EXPECT_NEAR(1.0 - std::exp(-tf(2.5).extinction), 0.25, 1e-3);
  EXPECT_NEAR(1.0 - std::exp(-tf(6.25).extinction), 0.375, 1e-3);
}

TEST(ParaView, JumpsInColour) {
  const TransferFunction tf = read(
      R"({"RGBPoints": [0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 2, 1, 1, 1], "Points": [0, 0.5, 0.5, 0, 2, 0.5, 0.5, 0]})");
  expectColor(tf(0.999999), 0, 0, 0);
  expectColor(tf(1.0), 1, 1, 1);
}

std::string mapOf(const char* space, const char* points) {
  return std::string(R"({"Points": [0, 0.5, 0.5, 0, 1, 0.5, 0.5, 0], "ColorSpace": ")") + space +
         R"(", "RGBPoints": [)" + points + "]}";
}

TEST(ParaView, HsvGoesRoundTheShortWay) {
  // Red to blue: through magenta where the hue may wrap, through green where it may not.
  expectColor(read(mapOf("HSV", "0, 1, 0, 0, 1, 0, 0, 1"))(0.5), 1, 0, 1, 1e-3);
  expectColor(read(mapOf("HsvNoWrap", "0, 1, 0, 0, 1, 0, 0, 1"))(0.5), 0, 1, 0, 1e-3);
}

TEST(ParaView, LabIsUniformInLightness) {
  // The grey of L* = 50 is sRGB 0.466.
  expectColor(read(mapOf("Lab", "0, 0, 0, 0, 1, 1, 1, 1"))(0.5), 0.4663, 0.4663, 0.4663, 2e-3);
}

TEST(ParaView, DivergingPassesThroughNearWhite) {
  // Moreland's cool to warm, whose published middle is 0.865, 0.865, 0.865.
  const TransferFunction tf = read(mapOf("Diverging", "0, 0.23, 0.299, 0.754, 1, 0.706, 0.016, 0.15"));
  expectColor(tf(0.0), 0.23, 0.299, 0.754);
  expectColor(tf(0.5), 0.865, 0.865, 0.865, 5e-3);
  expectColor(tf(1.0), 0.706, 0.016, 0.15);
  // Published: 0.2 of the way, (0.483, 0.621, 0.974) to three digits at 57/256 of the table.
  EXPECT_GT(tf(0.22).color[2], 0.95);
}

TEST(ParaView, StepTakesTheColourAtTheEndOfEachInterval) {
  const TransferFunction tf = read(mapOf("Step", "0, 0, 0, 0, 0.5, 1, 0, 0, 1, 0, 1, 0"));
  expectColor(tf(0.25), 1, 0, 0);
  expectColor(tf(0.75), 0, 1, 0);
}

TEST(ParaView, RefusesAndNamesTheEntry) {
  const auto says = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says(refusal(R"({"RGBPoints": [0, 0, 0]})"), "RGBPoints");
  says(refusal(R"({"RGBPoints": []})"), "RGBPoints");
  says(refusal(R"({"RGBPoints": [1, 0, 0, 0, 0, 0, 0, 0]})"), "RGBPoints[4]");
  says(refusal(R"({"RGBPoints": [0, 0, 3, 0]})"), "RGBPoints[2]");
  says(refusal(R"({"RGBPoints": [0, 0, null, 0]})"), "RGBPoints[2]");
  says(refusal(R"({"RGBPoints": [0, 0, 0, 0], "Points": [0, 2, 0.5, 0]})"), "Points[1]");
  says(refusal(R"({"RGBPoints": [0, 0, 0, 0], "Points": [0, 1]})"), "Points");
  says(refusal(R"({"RGBPoints": [0, 0, 0, 0], "ColorSpace": "CMYK"})"), "CMYK");
  says(refusal(R"({"RGBPoints": [0, 0, 0, 0], "ColorSpace": 1})"), "ColorSpace");
  says(refusal(R"([{"IndexedColors": [1, 0, 0]}])"), "categories");
}

}  // namespace
