#include "spillikin/sort/radix_sort.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstring>

namespace spillikin::sort {
namespace {

constexpr unsigned passes = 3, digit_bits = radix_key_bits / passes;
static_assert(digit_bits * passes == radix_key_bits);
constexpr std::size_t digits = std::size_t{1} << digit_bits;
// Part boundaries depend on the number of cells alone; a part's histogram is worth its cost from here on.
constexpr std::size_t least_part = 1 << 16, most_parts = 64;

std::size_t digit(std::uint64_t pair, unsigned pass) {
  return (pair >> (32 + digit_bits * pass)) & (digits - 1);
}

// Moves pairs to where their digit's run goes on. They pass through a cache line for each digit, so that memory sees
// whole lines and few pages at a time.
void scatter(const std::uint64_t* from, const std::uint64_t* end, unsigned pass, std::uint32_t* next,
             std::uint64_t* to) {
  constexpr std::size_t line = 8;
  alignas(64) std::uint64_t lines[digits][line];
  std::uint8_t held[digits] = {};
  for (; from != end; ++from) {
    const std::size_t d = digit(*from, pass);
    lines[d][held[d]++] = *from;
    if (held[d] < line) continue;
    std::memcpy(to + next[d], lines[d], sizeof(lines[d]));
    next[d] += line;
    held[d] = 0;
  }
  for (std::size_t d = 0; d < digits; ++d)
    std::memcpy(to + next[d], lines[d], held[d] * sizeof(std::uint64_t));
}

}  // namespace

void RadixSort::operator()(std::size_t count, const Fill& fill, std::vector<mesh::Id>& out) {
  const std::size_t parts = std::clamp<std::size_t>(count / least_part, 1, most_parts);
  const std::size_t part_size = (count + parts - 1) / parts;
  out.resize(count);
  pairs_.resize(count);
  other_.resize(count);
  histogram_.resize(parts * digits);
  const auto forEachPart = [&](auto&& f) {
    tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
      f(histogram_.data() + part * digits, std::min(count, part * part_size), std::min(count, (part + 1) * part_size));
    });
  };
  // From other_ to pairs_ and back; the third pass ends in pairs_.
  forEachPart([&](std::uint32_t* histogram, std::size_t begin, std::size_t end) {
    std::fill(histogram, histogram + digits, 0U);
    std::uint32_t keys[range];
    for (std::size_t first = begin; first < end; first += range) {
      const std::size_t last = std::min(end, first + range);
      fill(first, last, keys);
      for (std::size_t i = first; i < last; ++i) {
        const std::uint64_t pair = std::uint64_t{keys[i - first]} << 32U | i;
        other_[i] = pair;
        ++histogram[digit(pair, 0)];
      }
    }
  });
  for (unsigned pass = 0; pass < passes; ++pass) {
    const std::uint64_t* from = pass % 2 == 0 ? other_.data() : pairs_.data();
    std::uint64_t* to = pass % 2 == 0 ? pairs_.data() : other_.data();
    if (pass > 0) {
      forEachPart([&](std::uint32_t* histogram, std::size_t begin, std::size_t end) {
        std::fill(histogram, histogram + digits, 0U);
        for (std::size_t i = begin; i < end; ++i)
          ++histogram[digit(from[i], pass)];
      });
    }
    std::uint32_t sum = 0;
    for (std::size_t d = 0; d < digits; ++d) {
      for (std::size_t part = 0; part < parts; ++part) {
        const std::uint32_t here = histogram_[part * digits + d];
        histogram_[part * digits + d] = sum;
        sum += here;
      }
    }
    forEachPart([&](std::uint32_t* next, std::size_t begin, std::size_t end) {
      scatter(from + begin, from + end, pass, next, to);
    });
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1 << 15), [&](const tbb::blocked_range<std::size_t>& r) {
    for (std::size_t i = r.begin(); i < r.end(); ++i)
      out[i] = static_cast<mesh::Id>(pairs_[i]);
  });
}

std::size_t RadixSort::bytes() const {
  return 8 * (pairs_.capacity() + other_.capacity()) + 4 * histogram_.capacity();
}

}  // namespace spillikin::sort
