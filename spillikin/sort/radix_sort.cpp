#include "spillikin/sort/radix_sort.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

namespace spillikin::sort {
namespace {

constexpr unsigned digit_bits = 11, passes = 3;
constexpr std::size_t digits = std::size_t{1} << digit_bits;
// Part boundaries depend on the number of cells alone; a part's histogram is worth its cost from here on.
constexpr std::size_t least_part = 1 << 16, most_parts = 64;

std::size_t digit(std::uint32_t key, unsigned pass) {
  return (key >> (digit_bits * pass)) & (digits - 1);
}

}  // namespace

void RadixSort::operator()(std::vector<mesh::Id>& out) {
  const std::size_t n = keys_.size();
  const std::size_t parts = std::clamp<std::size_t>(n / least_part, 1, most_parts);
  const std::size_t part_size = (n + parts - 1) / parts;
  out.resize(n);
  other_keys_.resize(n);
  other_ids_.resize(n);
  histogram_.resize(parts * digits);
  const auto forEachPart = [&](auto&& f) {
    tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
      f(histogram_.data() + part * digits, part * part_size, std::min(n, (part + 1) * part_size));
    });
  };
  for (unsigned pass = 0; pass < passes; ++pass) {
    // Three passes, an odd number: ids end where the last writes, so the first writes to `out`.
    const bool to_out = pass % 2 == 0;
    const std::uint32_t* keys = to_out ? keys_.data() : other_keys_.data();
    std::uint32_t* next_keys = to_out ? other_keys_.data() : keys_.data();
    const mesh::Id* ids = to_out ? other_ids_.data() : out.data();
    mesh::Id* next_ids = to_out ? out.data() : other_ids_.data();
    forEachPart([&](std::uint32_t* count, std::size_t begin, std::size_t end) {
      std::fill(count, count + digits, 0U);
      for (std::size_t i = begin; i < end; ++i)
        ++count[digit(keys[i], pass)];
    });
    std::uint32_t sum = 0;
    for (std::size_t d = 0; d < digits; ++d) {
      for (std::size_t part = 0; part < parts; ++part) {
        const std::uint32_t count = histogram_[part * digits + d];
        histogram_[part * digits + d] = sum;
        sum += count;
      }
    }
    forEachPart([&](std::uint32_t* next, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t at = next[digit(keys[i], pass)]++;
        next_keys[at] = keys[i];
        next_ids[at] = pass == 0 ? static_cast<mesh::Id>(i) : ids[i];
      }
    });
  }
}

std::size_t RadixSort::bytes() const {
  return 4 * (keys_.capacity() + other_keys_.capacity() + other_ids_.capacity() + histogram_.capacity());
}

}  // namespace spillikin::sort
