// A transfer function as the shaders read it.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "spillikin/integrate/transfer_function.h"

namespace spillikin::composite {

// Scalars in the shaders run from 0 at `lo` to 1 at `hi`, so that a small variation on a large value keeps its digits.
// A constant field is 0 throughout.
struct ScalarMap {
  double lo = 0.0, hi = 0.0;
  float operator()(double value) const;
};

// Between two neighbouring breakpoints colour and extinction are linear. The first piece begins below and the last ends
// above every scalar, so that a search always finds one.
struct TransferPiece {
  std::array<float, 4> domain{};  // begin, end, reference, 1 / width
  std::array<float, 4> low{};     // colour and extinction at the reference
  std::array<float, 4> rise{};    // to the other end
};

// The pieces that the field's range reaches, ascending, never none. Extinction is multiplied by `unit`, the length that
// the shaders count in. Breakpoints are mapped as the scalars are, so that a value at a jump stays there.
std::vector<TransferPiece> transferPieces(const integrate::TransferFunction& tf, const ScalarMap& map, double unit);

// For each of `bins` equal parts of [0, 1], as the first of four floats, the number of a piece from which the search
// upwards for a scalar in that part may start.
inline constexpr std::size_t transfer_bins = 256;
std::vector<std::array<float, 4>> searchStarts(const std::vector<TransferPiece>& pieces, std::size_t bins);

}  // namespace spillikin::composite
