// Loops over ids on all cores, and the stable radix sort that orders points and cells; results never depend on the
// number of threads.
#pragma once

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace spillikin::mesh {

// f(i) for every i in [0, n), in chunks of at least `grain`.
template <class F>
void parallelFor(std::size_t n, const F& f, std::size_t grain = 4096) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, grain), [&f](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      f(i);
  });
}

// f(block, begin, end) for [0, n) cut into blocks whose bounds depend on n alone.
inline constexpr std::size_t block_size = std::size_t{1} << 14;
inline std::size_t blockCount(std::size_t n) {
  return (n + block_size - 1) / block_size;
}
template <class F>
void parallelBlocks(std::size_t n, const F& f) {
  parallelFor(
      blockCount(n), [&](std::size_t b) { f(b, b * block_size, std::min(n, (b + 1) * block_size)); }, 1);
}

// Sorts `keys` ascending and carries `ids` along; equal keys keep their order. Digits in which all keys agree cost one
// look. Scratch: as large as the input.
void radixSort(std::vector<std::uint64_t>& keys, std::vector<std::uint32_t>& ids);

}  // namespace spillikin::mesh
