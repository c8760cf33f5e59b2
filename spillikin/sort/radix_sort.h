// Sorting cells by one number each.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

inline constexpr unsigned radix_key_bits = 27;

// Keys that keep the order of numbers, largest first, and tell most of them apart: half of all keys, evenly spaced, for
// the middle of the range, which a sample finds, a quarter on either side, spaced as floats, for what lies beyond it.
class Ladder {
 public:
  // `number(c)` for c in [0, count); some two thousand of them are looked at.
  template <class Number>
  Ladder(std::size_t count, const Number& number) {
    constexpr std::size_t samples = 2048, tail = 64;
    std::vector<double> sample;
    for (std::size_t c = 0; c < count; c += std::max<std::size_t>(1, count / samples))
      sample.push_back(number(c));
    if (sample.empty()) return;
    std::sort(sample.begin(), sample.end());
    low_ = sample[sample.size() / tail];
    high_ = sample[sample.size() - 1 - sample.size() / tail];
    if (high_ > low_) scale_ = (2.0 * quarter - 1.0) / (high_ - low_);
  }
  // Each step rounds or cuts off, and so keeps order.
  std::uint32_t operator()(double number) const {
    if (number > high_) return quarter - 1 - tailKey(number - high_);
    if (number < low_) return 3 * quarter + tailKey(low_ - number);
    return quarter + static_cast<std::uint32_t>((high_ - number) * scale_);
  }

 private:
  static constexpr std::uint32_t quarter = 1U << (radix_key_bits - 2);
  static std::uint32_t tailKey(double positive) {
    return __builtin_bit_cast(std::uint32_t, static_cast<float>(positive)) >> (31 - (radix_key_bits - 2));
  }
  double low_ = 0.0, high_ = 0.0, scale_ = 0.0;
};

// A radix sort from the least significant digit, stable, on all cores: cells by ascending key, equal keys by ascending
// id. Three passes over 8 bytes a cell, of digits
// small enough that the places written to stay in the caches. Keeps its scratch space; the
// result does not depend on the number of threads.
class RadixSort {
 public:
  // Fills `out` with the cells 0 .. count - 1. `fill(begin, end, keys)` writes the keys of cells [begin, end) to
  // keys[0], keys[1], ...; it is called for disjoint ranges of at most `range` cells, from several threads.
  static constexpr std::size_t range = 4096;
  using Fill = std::function<void(std::size_t begin, std::size_t end, std::uint32_t* keys)>;
  void operator()(std::size_t count, const Fill& fill, std::vector<mesh::Id>& out);

  // The key of the i-th of the sorted cells, after a call.
  std::uint32_t sortedKey(std::size_t i) const { return static_cast<std::uint32_t>(pairs_[i] >> 32U); }
  std::size_t bytes() const;

 private:
  std::vector<std::uint64_t> pairs_, other_;  // key, cell
  std::vector<std::uint32_t> histogram_;      // by part, pass and digit
};

}  // namespace spillikin::sort
