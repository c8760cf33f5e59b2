#include "spillikin/composite/peaks.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace spillikin::composite {

namespace {

constexpr double peak_rounding = 1e-6;  // of the field's range: that of a scalar in float, interpolated
constexpr std::size_t grain = 4096;     // pixels

class PeakColor {
 public:
  explicit PeakColor(const Frame& frame)
      : tf_(frame.transfer_function), lo_(frame.field.lo), span_(frame.field.hi - frame.field.lo) {}

  std::array<double, 3> operator()(float peak) const {
    double value = lo_ + span_ * static_cast<double>(peak);
    const auto& points = tf_.points();
    const double reach = peak_rounding * span_;
    const auto near = std::lower_bound(points.begin(), points.end(), value - reach,
                                       [](const integrate::ControlPoint& p, double v) { return p.value < v; });
    if (near != points.end() && std::abs(near->value - value) <= reach) value = near->value;
    return tf_(value).color;
  }

 private:
  const integrate::TransferFunction& tf_;
  double lo_, span_;
};

}  // namespace

void colorPeaks(const Frame& frame, Image& image) {
  const PeakColor color(frame);
  using Range = tbb::blocked_range<std::size_t>;
  tbb::parallel_for(Range(0, image.rgba.size() / 4, grain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      float* pixel = image.rgba.data() + 4 * i;
      if (pixel[3] == 0.0F) continue;
      const std::array<double, 3> c = color(pixel[0]);
      for (std::size_t k = 0; k < 3; ++k)
        pixel[k] = static_cast<float>(c[k]);
      pixel[3] = 1.0F;
    }
  });
}

}  // namespace spillikin::composite
