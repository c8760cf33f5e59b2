#include "spillikin/mesh/parallel.h"

#include <array>

namespace spillikin::mesh {
namespace {

constexpr unsigned digit_bits = 11;
constexpr std::size_t buckets = std::size_t{1} << digit_bits;
constexpr std::size_t max_blocks = 64;  // bounds the histograms

using Histogram = std::array<std::uint32_t, buckets>;

struct Blocks {
  std::size_t n, count, length;
  explicit Blocks(std::size_t size)
      : n(size), count(std::clamp<std::size_t>(size >> 15, 1, max_blocks)), length((size + count - 1) / count) {}
  template <class F>
  void each(const F& f) const {
    parallelFor(
        count, [&](std::size_t b) { f(b, std::min(n, b * length), std::min(n, (b + 1) * length)); }, 1);
  }
};

// Turns counts per block and digit into the place where each block writes its first key of each digit.
void countsToPlaces(std::vector<Histogram>& histograms) {
  std::uint32_t place = 0;
  for (std::size_t digit = 0; digit < buckets; ++digit) {
    for (Histogram& histogram : histograms) {
      const std::uint32_t count = histogram[digit];
      histogram[digit] = place;
      place += count;
    }
  }
}

}  // namespace

void radixSort(std::vector<std::uint64_t>& keys, std::vector<std::uint32_t>& ids) {
  const std::size_t n = keys.size();
  if (n < 2) return;
  const Blocks blocks(n);
  std::vector<std::uint64_t> differs(blocks.count, 0);
  blocks.each([&](std::size_t b, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      differs[b] |= keys[i] ^ keys[0];
  });
  std::uint64_t varying = 0;
  for (const std::uint64_t d : differs)
    varying |= d;

  std::vector<std::uint64_t> other_keys(n);
  std::vector<std::uint32_t> other_ids(n);
  std::vector<Histogram> histograms(blocks.count);
  for (unsigned shift = 0; shift < 64; shift += digit_bits) {
    if (((varying >> shift) & (buckets - 1)) == 0) continue;
    blocks.each([&](std::size_t b, std::size_t begin, std::size_t end) {
      histograms[b].fill(0);
      for (std::size_t i = begin; i < end; ++i)
        ++histograms[b][(keys[i] >> shift) & (buckets - 1)];
    });
    countsToPlaces(histograms);
    blocks.each([&](std::size_t b, std::size_t begin, std::size_t end) {
      Histogram& place = histograms[b];
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t to = place[(keys[i] >> shift) & (buckets - 1)]++;
        other_keys[to] = keys[i];
        other_ids[to] = ids[i];
      }
    });
    keys.swap(other_keys);
    ids.swap(other_ids);
  }
}

}  // namespace spillikin::mesh
