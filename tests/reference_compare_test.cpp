// Comparing pictures whose difference is known.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "spillikin/base/error.h"
#include "spillikin/reference/compare.h"

namespace spillikin::tests {
namespace {

using reference::compare;
using reference::Comparison;

Image gradient(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 4; ++c)
        image.pixel(x, y)[c] = static_cast<float>(x + 2 * y + c) / 1024.0F;
    }
  }
  return image;
}

TEST(Compare, EqualPictures) {
  const Image a = gradient(40, 30);
  const Comparison c = compare(a, a);
  EXPECT_EQ(c.worst.max, 0.0);
  EXPECT_EQ(c.over, 0U);
  EXPECT_TRUE(std::isinf(c.psnr));
  EXPECT_DOUBLE_EQ(c.ssim, 1.0);
  EXPECT_EQ(c.pixels, 1200U);
}

TEST(Compare, OnePixelOff) {
  const Image a = gradient(20, 10);
  Image b = a;
  b.pixel(7, 3)[1] += 0.25F;
  const Comparison c = compare(a, b);
  EXPECT_NEAR(c.channel[1].max, 0.25, 1e-7);
  EXPECT_NEAR(c.channel[1].mean, 0.25 / 200, 1e-9);
  EXPECT_NEAR(c.channel[1].rms, 0.25 / std::sqrt(200.0), 1e-8);
  EXPECT_EQ(c.channel[0].max, 0.0);
  EXPECT_EQ(c.over, 1U);
  EXPECT_EQ(c.worst_x, 7);
  EXPECT_EQ(c.worst_y, 3);
  EXPECT_NEAR(c.psnr, 10.0 * std::log10(800.0 / (0.25 * 0.25)), 1e-5);
  EXPECT_LT(c.ssim, 1.0);
  EXPECT_EQ(c.channel[1].percentile[0], 0.0);
  EXPECT_NEAR(c.channel[1].percentile[3], 0.25, 1e-7);  // 99.9 % of 200 pixels is all of them
}

TEST(Compare, Percentiles) {
  Image a(1000, 1), b(1000, 1);
  for (int x = 0; x < 1000; ++x)
    b.pixel(x, 0)[0] = static_cast<float>((x * 7 + 3) % 1000 + 1) / 1024.0F;
  const Comparison c = compare(a, b);
  EXPECT_EQ(c.channel[0].percentile[0], 500.0 / 1024);
  EXPECT_EQ(c.channel[0].percentile[1], 950.0 / 1024);
  EXPECT_EQ(c.channel[0].percentile[2], 990.0 / 1024);
  EXPECT_EQ(c.channel[0].percentile[3], 999.0 / 1024);
}

// For two constant pictures SSIM has only its luminance term: (2 x y + c1) / (x^2 + y^2 + c1).
TEST(Compare, SimilarityOfConstants) {
  Image a(16, 16), b(16, 16);
  for (int n = 0; n < 256; ++n) {
    for (int c = 0; c < 4; ++c) {
      a.rgba[static_cast<std::size_t>(4 * n + c)] = 0.25F;
      b.rgba[static_cast<std::size_t>(4 * n + c)] = 0.5F;
    }
  }
  const double c1 = 1e-4;
  EXPECT_NEAR(compare(a, b).ssim, (2 * 0.25 * 0.5 + c1) / (0.25 * 0.25 + 0.5 * 0.5 + c1), 1e-12);
}

TEST(Compare, CountsApart) {
  const Image a = gradient(8, 8);
  Image b = a;
  b.pixel(2, 5)[0] += 0.5F;
  b.pixel(3, 5)[0] += 0.125F;
  reference::CompareOptions options;
  options.apart.assign(64, 0);
  options.apart[5 * 8 + 2] = 1;
  const Comparison c = compare(a, b, options);
  EXPECT_EQ(c.apart, 1U);
  EXPECT_NEAR(c.apart_max, 0.5, 1e-6);
  EXPECT_EQ(c.pixels, 63U);
  EXPECT_NEAR(c.worst.max, 0.125, 1e-6);
  EXPECT_EQ(c.over, 1U);
}

TEST(Compare, NotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  Image a(4, 1), b(4, 1);
  a.pixel(0, 0)[0] = nan;
  a.pixel(1, 0)[0] = nan;
  b.pixel(1, 0)[0] = nan;
  a.pixel(2, 0)[0] = inf;
  b.pixel(2, 0)[0] = -inf;
  const Comparison c = compare(a, b);
  EXPECT_EQ(c.not_finite, 2U);
  EXPECT_EQ(c.worst.max, 1.0);
  EXPECT_EQ(c.over, 2U);
}

TEST(Compare, RefusesOtherSizes) {
  EXPECT_THROW(compare(Image(4, 3), Image(3, 4)), Error);
  EXPECT_THROW(compare(Image(), Image()), Error);
  reference::CompareOptions options;
  options.apart.assign(3, 0);
  EXPECT_THROW(compare(Image(2, 2), Image(2, 2), options), Error);
  EXPECT_THROW(reference::differencePicture(Image(4, 3), Image(3, 4)), Error);
}

TEST(Compare, DifferencePicture) {
  Image a(200, 50), b(200, 50);
  for (int x = 0; x < 200; ++x)
    b.pixel(x, 10)[2] = static_cast<float>(x) / 400.0F;
  b.pixel(3, 3)[0] = std::numeric_limits<float>::quiet_NaN();
  const Image d = reference::differencePicture(a, b);
  ASSERT_EQ(d.width, 200);
  ASSERT_EQ(d.height, 50 + reference::legend_height);
  // The same colours run along row 10 and along the scale below, margin apart.
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(d.pixel(0, 10)[c], d.pixel(2, 54)[c], 1e-6);
    EXPECT_NEAR(d.pixel(199, 10)[c], d.pixel(197, 54)[c], 1e-6);
    EXPECT_NEAR(d.pixel(100, 10)[c], d.pixel(100, 54)[c], 0.02);
    EXPECT_EQ(d.pixel(3, 3)[c], c == 1 ? 0.0F : 1.0F);
  }
  for (int y = 0; y < d.height; ++y) {
    for (int x = 0; x < d.width; ++x)
      ASSERT_EQ(d.pixel(x, y)[3], 1.0F);
  }
  // The figures are there: some white dots below the scale on both sides.
  const auto white = [&](int from, int to) {
    int count = 0;
    for (int y = 63; y < d.height; ++y) {
      for (int x = from; x < to; ++x)
        count += d.pixel(x, y)[0] == 1.0F && d.pixel(x, y)[1] == 1.0F ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(white(0, 10), 12);
  EXPECT_GT(white(150, 200), 40);
  EXPECT_EQ(reference::differencePicture(Image(5, 5), Image(5, 5)).width, 96);
}

}  // namespace
}  // namespace spillikin::tests
