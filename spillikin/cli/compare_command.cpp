#include "spillikin/reference/compare.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "spillikin/base/error.h"
#include "spillikin/cli/commands.h"
#include "spillikin/io/write_image.h"

namespace spillikin::cli {

namespace {

constexpr std::array<const char*, 4> channel_names{"red", "green", "blue", "alpha"};

struct CompareOptions {
  std::string a, b, diff, json;
  std::optional<double> max;
  double threshold = 1.0 / 255.0;
};

nlohmann::ordered_json toJson(const reference::ChannelError& e) {
  nlohmann::ordered_json j{{"max", e.max}, {"mean", e.mean}, {"rms", e.rms}};
  for (std::size_t i = 0; i < reference::percentiles.size(); ++i) {
    j[fmt::format("p{}", reference::percentiles[i])] = e.percentile[i];
  }
  return j;
}

nlohmann::ordered_json toJson(const reference::Comparison& c) {
  nlohmann::ordered_json j{{"width", c.width},     {"height", c.height},       {"max", c.worst.max},
                           {"mean", c.worst.mean}, {"rms", c.worst.rms},       {"pixels", c.pixels},
                           {"over", c.over},       {"threshold", c.threshold}, {"not_finite", c.not_finite},
                           {"ssim", c.ssim}};
  j["psnr"] = std::isfinite(c.psnr) ? nlohmann::ordered_json(c.psnr) : nlohmann::ordered_json(nullptr);  // null: equal
  j["worst_pixel"] = {c.worst_x, c.worst_y};
  j["worst"] = toJson(c.worst);
  for (std::size_t k = 0; k < channel_names.size(); ++k)
    j["channels"][channel_names[k]] = toJson(c.channel[k]);
  return j;
}

void print(const reference::Comparison& c) {
  fmt::print("{:<8} {:>10} {:>10} {:>10} {:>10} {:>10}\n", "", "max", "mean", "rms", "p99", "p99.9");
  const auto row = [](const char* label, const reference::ChannelError& e) {
    fmt::print("{:<8} {:>10.3e} {:>10.3e} {:>10.3e} {:>10.3e} {:>10.3e}\n", label, e.max, e.mean, e.rms,
               e.percentile[2], e.percentile[3]);
  };
  for (std::size_t k = 0; k < channel_names.size(); ++k)
    row(channel_names[k], c.channel[k]);
  row("worst", c.worst);
  fmt::print("{} of {} pixels differ by more than {:.6f}; the largest difference is at {},{}\n", c.over, c.pixels,
             c.threshold, c.worst_x, c.worst_y);
  fmt::print("PSNR {:.2f} dB, SSIM {:.6f}\n", c.psnr, c.ssim);
  if (c.not_finite > 0) fmt::print("{} pixels are not finite in one picture\n", c.not_finite);
}

int run(const CompareOptions& o) {
  if (!o.diff.empty()) io::checkImagePath(o.diff);
  const Image a = io::readImage(o.a);
  const Image b = io::readImage(o.b);
  reference::CompareOptions options;
  options.threshold = o.max.value_or(o.threshold);
  const reference::Comparison c = reference::compare(a, b, options);
  print(c);
  if (!o.diff.empty()) io::writeImage(o.diff, reference::differencePicture(a, b));
  if (!o.json.empty()) {
    const std::string text = toJson(c).dump(2) + "\n";
    io::writeFile(o.json, text.data(), text.size());
  }
  if (o.max && !(c.worst.max <= *o.max)) {
    throw Error(fmt::format(
        "{} and {} differ by {:.6f} at pixel {},{}, more than --max {}; spillikin compare --diff shows where", o.a, o.b,
        c.worst.max, c.worst_x, c.worst_y, *o.max));
  }
  return 0;
}

}  // namespace

Command addCompare(CLI::App& app) {
  auto* sub = app.add_subcommand("compare", "tell how far two images are apart");
  auto o = std::make_shared<CompareOptions>();
  sub->add_option("IMAGE_A", o->a, ".png, .exr or .npy")->required();
  sub->add_option("IMAGE_B", o->b, "of the same size")->required();
  sub->add_option("--diff", o->diff, "write a picture of the differences, with its colour scale")->type_name("IMAGE");
  sub->add_option("--max", o->max, "exit with 1 when a pixel differs by more")
      ->type_name("E")
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--threshold", o->threshold, "count the pixels that differ by more (default 1/255, or --max)")
      ->type_name("E")
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--json", o->json, "write the figures as JSON")->type_name("FILE");
  sub->footer("Example:\n  spillikin compare a.exr b.exr --max 0.00392 --diff difference.png\n");
  return [o] { return run(*o); };
}

}  // namespace spillikin::cli
