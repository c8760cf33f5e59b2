// Approximate integration of a segment, for speed and for comparison: pre-integrated tables, averages, vertex colours.
// The exact integral is in segment.h. All take the scalar at both ends and a length >= 0 in world units.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "spillikin/integrate/segment.h"
#include "spillikin/integrate/transfer_function.h"

namespace spillikin::integrate {

// Pre-integration (Roettger, Kraus and Ertl 2000): the segment's integral as a table over front, back and length.
// Texel (i, j, k) stands for the scalars lo + (hi - lo) i / (n - 1) in front and j alike behind. Its fourth channel is
// T, the mean extinction between them; the first three are T times the colour that the segment shows where its optical
// depth is u / (1 - u), u = k / (layers - 1). A look-up reads T at (front, back), so that opacity is
// 1 - exp(-T length), exact in length; then colour at depth T length, where texels count by their extinction.
// Error: exact at the texels (1e-6 relative), and set by the table's resolution between them: features of the transfer
// function narrower than (hi - lo) / n are blurred. README.md has figures. Scalars outside [lo, hi] are clamped.
// Cost: n^2 layers segment integrals to make, 16 n^2 layers bytes, four and eight texels a look-up.
class Preintegrated {
 public:
  static constexpr std::size_t default_n = 128;
  static constexpr std::size_t default_layers = 16;

  // Throws Error where lo > hi or one is not finite, or n or layers is below 2 or the table passes 1 GiB.
  Preintegrated(const TransferFunction& tf, double lo, double hi, std::size_t n = default_n,
                std::size_t layers = default_layers);

  Radiance operator()(double front, double back, double length) const;

  // As a 3D texture: RGBA, front fastest, then back, then length. A shader samples it at texel centres.
  const std::vector<float>& texels() const { return texels_; }
  std::size_t n() const { return n_; }
  std::size_t layers() const { return layers_; }
  double lo() const { return lo_; }
  double hi() const { return hi_; }

 private:
  std::size_t n_, layers_;
  double lo_, hi_;
  std::vector<float> texels_;
};

// Mean extinction and mean colour of the two ends (Stein, Becker and Max 1994, with colour as extinction): what lies
// between them is not looked at. Exact where both are constant.
Radiance average(const TransferFunction& tf, double front, double back, double length);

// What the paper's hardware road computes at a vertex of a projected polygon (Max, Williams and Silva 2000, section
// II): the analytic colour divided by alpha, or the glow of the (front) scalar where there is no length, and the mean
// of the extinction at both ends. Colour and `mean_extinction` are interpolated over the polygon as is the length;
// alpha is then read from opacityTexture at (length, mean extinction).
struct VertexLook {
  std::array<double, 3> color{};
  double mean_extinction = 0.0;
};
VertexLook vertexLook(const TransferFunction& tf, double front, double back, double length);

// The 2D texture 1 - exp(-u v), size^2 values, row-major with u = largest i / (size - 1) along a row and v alike down:
// the polygon scales length and extinction so that both fit [0, largest]. Bilinear reading errs by at most
// (largest / (size - 1))^2 (2 largest^2 + 1) / 8.
std::vector<float> opacityTexture(std::size_t size, double largest);

}  // namespace spillikin::integrate
