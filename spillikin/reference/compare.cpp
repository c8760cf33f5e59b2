#include "spillikin/reference/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "spillikin/base/error.h"
#include "spillikin/integrate/transfer_function.h"

namespace spillikin::reference {
namespace {

void check(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) {
    throw Error(fmt::format("pictures of {}x{} and {}x{} pixels cannot be compared: render both at one size", a.width,
                            a.height, b.width, b.height));
  }
  if (a.width < 1 || a.height < 1) throw Error("pictures without pixels cannot be compared");
}

// |a - b|; 1 where only one of them, or a different one, is not finite.
double difference(float a, float b, bool& not_finite) {
  const double d = std::abs(static_cast<double>(a) - static_cast<double>(b));
  if (std::isfinite(d)) return d;
  if ((std::isnan(a) && std::isnan(b)) || a == b) return 0.0;
  not_finite = true;
  return 1.0;
}

struct PixelError {
  std::array<double, 4> channel{};
  double worst = 0.0;
  bool not_finite = false;
};

PixelError pixelError(const Image& a, const Image& b, int x, int y) {
  PixelError out;
  for (std::size_t c = 0; c < 4; ++c) {
    out.channel[c] = difference(a.pixel(x, y)[c], b.pixel(x, y)[c], out.not_finite);
    out.worst = std::max(out.worst, out.channel[c]);
  }
  return out;
}

ChannelError summarize(std::vector<double>& errors) {
  ChannelError out;
  if (errors.empty()) return out;
  std::sort(errors.begin(), errors.end());
  double sum = 0.0, squares = 0.0;
  for (const double e : errors) {
    sum += e;
    squares += e * e;
  }
  const auto count = static_cast<double>(errors.size());
  out.max = errors.back();
  out.mean = sum / count;
  out.rms = std::sqrt(squares / count);
  for (std::size_t p = 0; p < percentiles.size(); ++p) {
    const auto per_mille = static_cast<std::size_t>(std::lround(10.0 * percentiles[p]));
    const std::size_t rank = (errors.size() * per_mille + 999) / 1000;  // in integers: 99.9 has no exact double
    out.percentile[p] = errors[std::max<std::size_t>(rank, 1) - 1];
  }
  return out;
}

// One channel of doubles with the picture's size.
struct Plane {
  int width, height;
  std::vector<double> value;
  double& at(int x, int y) { return value[index(x, y)]; }
  double at(int x, int y) const { return value[index(x, y)]; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

Plane makePlane(int width, int height) {
  return {width, height, std::vector<double>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
}

Plane luma(const Image& image) {
  Plane out = makePlane(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float* p = image.pixel(x, y);
      const double l =
          0.2126 * static_cast<double>(p[0]) + 0.7152 * static_cast<double>(p[1]) + 0.0722 * static_cast<double>(p[2]);
      out.at(x, y) = std::isfinite(l) ? l : 0.0;
    }
  }
  return out;
}

constexpr int window_radius = 5;
constexpr double window_sigma = 1.5;

// Where the weight of the neighbour n pixels away is kept.
std::size_t slot(int n) {
  const int index = n + window_radius;
  return static_cast<std::size_t>(index);
}

// Gaussian mean along one axis (dx, dy), cut at the border and renormalized.
Plane blurAlong(const Plane& in, int dx, int dy) {
  std::array<double, 2 * window_radius + 1> window{};
  for (int n = -window_radius; n <= window_radius; ++n) {
    window[slot(n)] = std::exp(-0.5 * n * n / (window_sigma * window_sigma));
  }
  Plane out = makePlane(in.width, in.height);
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < in.width; ++x) {
      double sum = 0.0, weights = 0.0;
      for (int n = -window_radius; n <= window_radius; ++n) {
        const int px = x + n * dx, py = y + n * dy;
        if (px < 0 || py < 0 || px >= in.width || py >= in.height) continue;
        const double weight = window[slot(n)];
        sum += weight * in.at(px, py);
        weights += weight;
      }
      out.at(x, y) = sum / weights;
    }
  }
  return out;
}

Plane blur(const Plane& in) {
  return blurAlong(blurAlong(in, 1, 0), 0, 1);
}

Plane product(const Plane& a, const Plane& b) {
  Plane out = a;
  for (std::size_t n = 0; n < out.value.size(); ++n)
    out.value[n] *= b.value[n];
  return out;
}

double similarity(const Image& a, const Image& b) {
  const Plane la = luma(a), lb = luma(b);
  const Plane ma = blur(la), mb = blur(lb);
  const Plane aa = blur(product(la, la)), bb = blur(product(lb, lb)), ab = blur(product(la, lb));
  constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  double sum = 0.0;
  for (std::size_t n = 0; n < la.value.size(); ++n) {
    const double x = ma.value[n], y = mb.value[n];
    const double vx = aa.value[n] - x * x, vy = bb.value[n] - y * y, vxy = ab.value[n] - x * y;
    sum += (2.0 * x * y + c1) * (2.0 * vxy + c2) / ((x * x + y * y + c1) * (vx + vy + c2));
  }
  return sum / static_cast<double>(la.value.size());
}

}  // namespace

Comparison compare(const Image& a, const Image& b, const CompareOptions& options) {
  check(a, b);
  const std::size_t count = static_cast<std::size_t>(a.width) * static_cast<std::size_t>(a.height);
  if (!options.apart.empty() && options.apart.size() != count) {
    throw Error(fmt::format("mask of {} pixels for a picture of {}", options.apart.size(), count));
  }
  Comparison out;
  out.width = a.width;
  out.height = a.height;
  out.threshold = options.threshold;
  std::array<std::vector<double>, 5> errors;
  double largest = -1.0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      const PixelError error = pixelError(a, b, x, y);
      const std::size_t n =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(a.width) + static_cast<std::size_t>(x);
      if (!options.apart.empty() && options.apart[n] != 0) {
        ++out.apart;
        out.apart_max = std::max(out.apart_max, error.worst);
        continue;
      }
      for (std::size_t c = 0; c < 4; ++c)
        errors[c].push_back(error.channel[c]);
      errors[4].push_back(error.worst);
      ++out.pixels;
      if (error.worst > options.threshold) ++out.over;
      if (error.not_finite) ++out.not_finite;
      if (error.worst <= largest) continue;
      largest = error.worst;
      out.worst_x = x;
      out.worst_y = y;
    }
  }
  double squares = 0.0;
  for (std::size_t c = 0; c < 4; ++c) {
    out.channel[c] = summarize(errors[c]);
    squares += out.channel[c].rms * out.channel[c].rms / 4.0;
  }
  out.worst = summarize(errors[4]);
  out.psnr = squares > 0.0 ? -10.0 * std::log10(squares) : std::numeric_limits<double>::infinity();
  out.ssim = similarity(a, b);
  return out;
}

namespace {

using Color = std::array<float, 3>;

void put(Image& image, int x, int y, const Color& color) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  float* p = image.pixel(x, y);
  std::copy(color.begin(), color.end(), p);
  p[3] = 1.0F;
}

Color scaleColor(const integrate::TransferFunction& map, double part) {
  const integrate::Optical optical = map(std::clamp(part, 0.0, 1.0));
  return {static_cast<float>(optical.color[0]), static_cast<float>(optical.color[1]),
          static_cast<float>(optical.color[2])};
}

// Figures of 3 x 5 dots, rows from the top, three bits each.
struct Glyph {
  char character;
  std::array<unsigned, 5> row;
};
constexpr std::array<Glyph, 14> glyphs{{{'0', {7, 5, 5, 5, 7}},
                                        {'1', {2, 6, 2, 2, 7}},
                                        {'2', {7, 1, 7, 4, 7}},
                                        {'3', {7, 1, 7, 1, 7}},
                                        {'4', {5, 5, 7, 1, 1}},
                                        {'5', {7, 4, 7, 1, 7}},
                                        {'6', {7, 4, 7, 5, 7}},
                                        {'7', {7, 1, 1, 2, 2}},
                                        {'8', {7, 5, 7, 5, 7}},
                                        {'9', {7, 5, 7, 1, 7}},
                                        {'.', {0, 0, 0, 0, 2}},
                                        {'-', {0, 0, 7, 0, 0}},
                                        {'+', {0, 2, 7, 2, 0}},
                                        {'e', {0, 7, 7, 4, 7}}}};
constexpr int glyph_advance = 4;

void write(Image& image, int x, int y, const std::string& text, const Color& color) {
  for (const char character : text) {
    const auto glyph =
        std::find_if(glyphs.begin(), glyphs.end(), [character](const Glyph& g) { return g.character == character; });
    for (int row = 0; glyph != glyphs.end() && row < 5; ++row) {
      for (int column = 0; column < 3; ++column) {
        if ((glyph->row[static_cast<std::size_t>(row)] >> (2 - column)) & 1U) put(image, x + column, y + row, color);
      }
    }
    x += glyph_advance;
  }
}

// Below the picture: the scale from left to right, and under it 0 and its largest value.
void drawLegend(Image& image, int top, double scale, const integrate::TransferFunction& map) {
  constexpr Color white{1.0F, 1.0F, 1.0F};
  constexpr int margin = 2, bar_height = 9;
  for (int y = top; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x)
      put(image, x, y, {0.0F, 0.0F, 0.0F});
  }
  const int last = image.width - 2 * margin - 1;
  for (int y = 0; y < bar_height; ++y) {
    for (int x = 0; x <= last; ++x) {
      put(image, margin + x, top + margin + y, scaleColor(map, static_cast<double>(x) / last));
    }
  }
  const int line = top + margin + bar_height + margin;
  const std::string figure = fmt::format("{:.2e}", scale);
  write(image, margin, line, "0", white);
  write(image, image.width - margin - glyph_advance * static_cast<int>(figure.size()), line, figure, white);
}

}  // namespace

Image differencePicture(const Image& a, const Image& b, double scale) {
  check(a, b);
  constexpr int least_width = 96;  // so that the figures fit
  constexpr Color magenta{1.0F, 0.0F, 1.0F};
  if (!(scale > 0.0)) {
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) {
        const PixelError error = pixelError(a, b, x, y);
        if (!error.not_finite) scale = std::max(scale, error.worst);
      }
    }
  }
  const integrate::TransferFunction map = integrate::preset(integrate::default_preset);
  Image out(std::max(a.width, least_width), a.height + legend_height);
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      const PixelError error = pixelError(a, b, x, y);
      put(out, x, y, error.not_finite ? magenta : scaleColor(map, scale > 0.0 ? error.worst / scale : 0.0));
    }
    for (int x = a.width; x < out.width; ++x)
      put(out, x, y, {0.0F, 0.0F, 0.0F});
  }
  drawLegend(out, a.height, scale, map);
  return out;
}

}  // namespace spillikin::reference
