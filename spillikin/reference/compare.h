// How far two pictures are apart, in numbers and as a picture.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "spillikin/base/image.h"

namespace spillikin::reference {

// Absolute differences |a - b| of one channel over the pixels compared. Full scale is 1.
struct ChannelError {
  double max = 0.0, mean = 0.0, rms = 0.0;
  std::array<double, 4> percentile{};  // 50, 95, 99 and 99.9: the smallest value that this part of pixels does not pass
};
inline constexpr std::array<double, 4> percentiles{50.0, 95.0, 99.0, 99.9};

struct CompareOptions {
  double threshold = 1.0 / 255.0;   // pixels are over it when any channel differs by more
  std::vector<std::uint8_t> apart;  // empty, or per pixel: nonzero where a pixel is to be counted apart, not compared
};

struct Comparison {
  int width = 0, height = 0;
  std::array<ChannelError, 4> channel;  // red, green, blue (premultiplied), alpha
  ChannelError worst;                   // of the largest channel of each pixel
  double psnr = 0.0;                    // dB, peak 1, over all four channels; infinite for equal pictures
  double ssim = 1.0;                    // structural similarity of the luma, 1 for equal pictures
  double threshold = 0.0;
  std::size_t pixels = 0;        // compared
  std::size_t over = 0;          // of them, over the threshold
  std::size_t not_finite = 0;    // of them, with a NaN or an infinity that the other does not have; each counts
                                 // as an error of 1 in the figures above
  std::size_t apart = 0;         // pixels counted apart
  double apart_max = 0.0;        // and the largest error among them
  int worst_x = 0, worst_y = 0;  // first pixel of the largest error
};

// Throws Error when the sizes differ or a mask has the wrong size. SSIM: Wang, Bovik, Sheikh, Simoncelli 2004, section
// III.C (Gaussian window of 11 x 11, sigma 1.5, K1 0.01, K2 0.03), on Rec. 709 luma of the premultiplied colours, mean
// over all pixels, windows cut at the border and renormalized; pixels counted apart still take part in it.
// Cost: linear in the pixels (n log n for the percentiles).
Comparison compare(const Image& a, const Image& b, const CompareOptions& options = {});

// A picture of the largest channel's difference at each pixel, opaque, from the first colour of the scale (0) to the
// last (`scale`, or the largest difference when it is 0), not finite in magenta; below it a strip with the colour scale
// and its ends in figures. At least 96 pixels wide. Throws Error as compare.
Image differencePicture(const Image& a, const Image& b, double scale = 0.0);
inline constexpr int legend_height = 20;  // pixels added below

}  // namespace spillikin::reference
