#include "spillikin/reference/samples.h"

#include <cmath>
#include <cstdint>

namespace spillikin::reference {
namespace {

// SplitMix64 (Steele, Lea, Flood 2014), to [0, 1).
double hashed(std::uint64_t key) {
  key += 0x9e3779b97f4a7c15ULL;
  key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9ULL;
  key = (key ^ (key >> 27)) * 0x94d049bb133111ebULL;
  key ^= key >> 31;
  return static_cast<double>(key >> 11) * 0x1p-53;
}

}  // namespace

std::array<double, 2> samplePosition(int x, int y, int width, int n, int count) {
  if (count == 1) return {x + 0.5, y + 0.5};
  // Row r holds the samples start(r) .. start(r + 1) - 1 and is as high as its share of them, so that all strata have
  // one area.
  const int rows = static_cast<int>(std::lround(std::sqrt(static_cast<double>(count))));
  const auto start = [&](int r) { return static_cast<int>(static_cast<std::int64_t>(r) * count / rows); };
  int r = static_cast<int>(static_cast<std::int64_t>(n) * rows / count);
  while (start(r + 1) <= n)
    ++r;
  const int first = start(r), last = start(r + 1);
  const auto pixel = static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(width) + static_cast<std::uint64_t>(x);
  const std::uint64_t key = (pixel * static_cast<std::uint64_t>(count) + static_cast<std::uint64_t>(n)) * 2;
  const double across = (n - first + hashed(key)) / (last - first);
  const double down = (first + (last - first) * hashed(key + 1)) / count;
  return {x + across, y + down};
}

}  // namespace spillikin::reference
