#include "spillikin/io/read_colormap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "spillikin/base/error.h"
#include "spillikin/io/paraview_colormap.h"

namespace spillikin::io {
namespace {

using integrate::ControlPoint;
using integrate::TransferFunction;
using Json = nlohmann::json;

// The file being read, for messages.
class Context {
 public:
  explicit Context(std::string path) : path_(std::move(path)) {}
  [[noreturn]] void fail(const std::string& what, const std::string& remedy) const {
    throw Error(fmt::format("transfer function '{}': {}; {}", path_, what, remedy));
  }

 private:
  std::string path_;
};

Json parse(const std::string& path, const Context& context) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) context.fail("there is no such file", "check the name");
  if (std::filesystem::is_directory(path, error)) context.fail("it is a folder", "name a file in it");
  std::ifstream in(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in.eof() && in.fail()) context.fail("it cannot be read", "check its permissions");
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) context.fail("it is empty", "write it again");
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& e) {
    const std::size_t at = std::min(e.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    context.fail(fmt::format("it is not JSON from line {} on (byte {})", line, e.byte), "correct it there");
  } catch (const Json::exception&) {
    context.fail("it holds a number that cannot be represented", "correct it");
  }
}

double number(const Json& value, const std::string& entry, const Context& context) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) {
    context.fail(fmt::format("{} is not a number", entry), "give it a finite number");
  }
  return value.get<double>();
}

const Json& member(const Json& object, const char* key, const std::string& entry, const Context& context) {
  if (!object.is_object()) context.fail(fmt::format("{} is not an object", entry), "write {\"value\": ...} there");
  const auto found = object.find(key);
  if (found == object.end()) {
    context.fail(fmt::format("{} has no \"{}\"", entry, key), "a point needs value, color and extinction");
  }
  return *found;
}

// ---- The project's own form -----------------------------------------------------------------------------------------

TransferFunction own(const Json& points, const Context& context) {
  if (!points.is_array() || points.empty()) context.fail("\"points\" is not a list of points", "give at least one");
  std::vector<ControlPoint> out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string entry = fmt::format("points[{}]", i);
    const Json& color = member(points[i], "color", entry, context);
    if (!color.is_array() || color.size() != 3) {
      context.fail(fmt::format("{}.color is not a list of three numbers", entry), "write [r, g, b] in [0, 1]");
    }
    ControlPoint point;
    point.value = number(member(points[i], "value", entry, context), fmt::format("{}.value", entry), context);
    for (std::size_t c = 0; c < 3; ++c) {
      point.color[c] = number(color[c], fmt::format("{}.color[{}]", entry, c), context);
      if (point.color[c] < 0.0 || point.color[c] > 1.0) {
        context.fail(fmt::format("{}.color[{}] is {}", entry, c, point.color[c]), "colours lie in [0, 1]");
      }
    }
    point.extinction =
        number(member(points[i], "extinction", entry, context), fmt::format("{}.extinction", entry), context);
    if (point.extinction < 0.0) {
      context.fail(fmt::format("{}.extinction is {}", entry, point.extinction), "extinction is at least 0");
    }
    if (!out.empty() && point.value < out.back().value) {
      context.fail(fmt::format("{}.value {} is below the one before it, {}", entry, point.value, out.back().value),
                   "order the points by value");
    }
    out.push_back(point);
  }
  try {
    return TransferFunction(std::move(out));
  } catch (const Error& error) {
    context.fail(error.what(), "correct the points");
  }
}

// ---- ParaView's -----------------------------------------------------------------------------------------------------

// A flat list of numbers, `width` for each node, ascending in the first.
std::vector<double> flat(const Json& list, const char* key, std::size_t width, const Context& context) {
  if (!list.is_array() || list.empty() || list.size() % width != 0) {
    context.fail(fmt::format("\"{}\" is not a list of {} numbers for each node", key, width), "export it again");
  }
  std::vector<double> values;
  for (std::size_t i = 0; i < list.size(); ++i) {
    values.push_back(number(list[i], fmt::format("{}[{}]", key, i), context));
    if (i % width == 0 && i > 0 && values[i] < values[i - width]) {
      context.fail(fmt::format("{}[{}] is below the node before it", key, i), "order the nodes by value");
    }
  }
  return values;
}

std::vector<ColorNode> colorNodes(const Json& map, const Context& context) {
  const std::vector<double> values = flat(map.at("RGBPoints"), "RGBPoints", 4, context);
  std::vector<ColorNode> nodes;
  for (std::size_t i = 0; i < values.size(); i += 4) {
    for (std::size_t c = 1; c < 4; ++c) {
      if (values[i + c] < 0.0 || values[i + c] > 1.0) {
        context.fail(fmt::format("RGBPoints[{}] is {}", i + c, values[i + c]), "colours lie in [0, 1]");
      }
    }
    nodes.push_back({values[i], {values[i + 1], values[i + 2], values[i + 3]}});
  }
  return nodes;
}

std::vector<OpacityNode> opacityNodes(const Json& map, const Context& context) {
  const std::vector<double> values = flat(map.at("Points"), "Points", 4, context);
  std::vector<OpacityNode> nodes;
  for (std::size_t i = 0; i < values.size(); i += 4) {
    if (values[i + 1] < 0.0 || values[i + 1] > 1.0) {
      context.fail(fmt::format("Points[{}] is {}", i + 1, values[i + 1]), "opacities lie in [0, 1]");
    }
    nodes.push_back({values[i], values[i + 1], values[i + 2], values[i + 3]});
  }
  return nodes;
}

// A colour map without opacities: extinction rises linearly from 0 to 1 over the unit distance.
std::vector<ControlPoint> withRamp(std::vector<ControlPoint> points, double unit_distance) {
  const double lo = points.front().value, hi = points.back().value;
  for (ControlPoint& point : points) {
    point.extinction = (hi > lo ? (point.value - lo) / (hi - lo) : 1.0) / unit_distance;
  }
  return points;
}

TransferFunction paraview(const Json& map, double unit_distance, const Context& context) {
  std::string name = "RGB";
  if (const auto found = map.find("ColorSpace"); found != map.end()) {
    if (!found->is_string()) context.fail("\"ColorSpace\" is not a name", "use RGB");
    name = found->get<std::string>();
  }
  const std::optional<ColorSpace> space = colorSpaceOf(name);
  if (!space) {
    context.fail(fmt::format("ColorSpace '{}' is not known", name), "use RGB, HSV, Lab, Diverging or Step");
  }
  const std::vector<ColorNode> colors = colorNodes(map, context);
  std::vector<ControlPoint> points;
  if (map.contains("Points")) {
    points = controlPoints(colors, *space, opacityNodes(map, context), unit_distance);
  } else {
    points =
        withRamp(controlPoints(colors, *space, {{colors.front().value, 0.0, 0.5, 0.0}}, unit_distance), unit_distance);
  }
  try {
    return TransferFunction(std::move(points));
  } catch (const Error& error) {
    context.fail(error.what(), "export it again");
  }
}

}  // namespace

TransferFunction readTransferFunction(const std::string& path, double unit_distance) {
  const Context context(path);
  if (!(unit_distance > 0.0) || !std::isfinite(unit_distance)) {
    context.fail(fmt::format("the unit distance is {}", unit_distance), "give a positive length");
  }
  const Json json = parse(path, context);
  const Json* map = &json;
  if (json.is_array() && !json.empty()) map = &json.front();
  if (map->is_object() && map->contains("points")) return own(map->at("points"), context);
  if (map->is_object() && map->contains("RGBPoints")) return paraview(*map, unit_distance, context);
  if (map->is_object() && map->contains("IndexedColors")) {
    context.fail("it is a map of categories", "choose one with RGBPoints");
  }
  context.fail("it has neither \"points\" nor ParaView's \"RGBPoints\"",
               "write {\"points\": [{\"value\": v, \"color\": [r, g, b], \"extinction\": t}, ...]}");
}

}  // namespace spillikin::io
