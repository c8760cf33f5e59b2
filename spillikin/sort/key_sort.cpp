#include "spillikin/sort/key_sort.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

namespace spillikin::sort {
namespace {

constexpr std::size_t low_digits = std::size_t{1} << KeySort::low_bits;
// Part boundaries depend on the number of cells alone; a part's histogram is worth its cost from here on.
constexpr std::size_t least_part = 1 << 16, most_parts = 32;
constexpr std::size_t narrow_cells = std::size_t{1} << (32 - KeySort::low_bits);
constexpr std::size_t few = 192;  // sorted by comparing: counting would spend its time on empty digits

// Words of one bucket, the lower digit on top, to their cells in order. Equal digits keep their order.
template <class Word>
void sortBucket(Word* words, std::size_t count, mesh::Id* out) {
  constexpr unsigned id_bits = 8 * sizeof(Word) - KeySort::low_bits;
  constexpr Word id = (Word{1} << id_bits) - 1;
  if (count < few) {
    std::sort(words, words + count);
    for (std::size_t i = 0; i < count; ++i)
      out[i] = static_cast<mesh::Id>(words[i] & id);
    return;
  }
  std::uint32_t next[low_digits] = {};
  for (std::size_t i = 0; i < count; ++i)
    ++next[words[i] >> id_bits];
  std::uint32_t sum = 0;
  for (std::uint32_t& n : next) {
    const std::uint32_t here = n;
    n = sum;
    sum += here;
  }
  for (std::size_t i = 0; i < count; ++i)
    out[next[words[i] >> id_bits]++] = static_cast<mesh::Id>(words[i] & id);
}

}  // namespace

unsigned KeySort::keyBits(std::size_t count) {
  return low_bits + (count <= narrow_cells ? 9 : 11);
}

template <class Word>
void KeySort::run(std::size_t count, const Fill& fill, const std::uint32_t* keys, std::vector<Word>& words,
                  std::vector<mesh::Id>& out) {
  constexpr unsigned id_bits = 8 * sizeof(Word) - low_bits;
  const std::size_t digits = std::size_t{1} << (keyBits(count) - low_bits);
  const std::size_t parts = std::clamp<std::size_t>(count / least_part, 1, most_parts);
  const std::size_t part_size = (count + parts - 1) / parts;
  out.resize(count);
  words.resize(count);
  histogram_.resize(parts * digits);
  bucket_.resize(digits + 1);
  const auto forEachPart = [&](auto&& f) {
    tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
      f(histogram_.data() + part * digits, std::min(count, part * part_size), std::min(count, (part + 1) * part_size));
    });
  };
  forEachPart([&](std::uint32_t* histogram, std::size_t begin, std::size_t end) {
    std::fill(histogram, histogram + digits, 0U);
    for (std::size_t first = begin; first < end; first += range) {
      const std::size_t last = std::min(end, first + range);
      fill(first, last);
      for (std::size_t i = first; i < last; ++i)
        ++histogram[keys[i] >> low_bits];
    }
  });
  std::uint32_t sum = 0;
  for (std::size_t d = 0; d < digits; ++d) {
    bucket_[d] = sum;
    for (std::size_t part = 0; part < parts; ++part) {
      const std::uint32_t here = histogram_[part * digits + d];
      histogram_[part * digits + d] = sum;
      sum += here;
    }
  }
  bucket_[digits] = sum;
  forEachPart([&](std::uint32_t* next, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t key = keys[i];
      words[next[key >> low_bits]++] = static_cast<Word>(static_cast<Word>(key & (low_digits - 1)) << id_bits | i);
    }
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, digits, 8), [&](const tbb::blocked_range<std::size_t>& r) {
    for (std::size_t d = r.begin(); d < r.end(); ++d)
      sortBucket(words.data() + bucket_[d], bucket_[d + 1] - bucket_[d], out.data() + bucket_[d]);
  });
}

void KeySort::operator()(std::size_t count, const Fill& fill, const std::uint32_t* keys, std::vector<mesh::Id>& out) {
  if (count <= narrow_cells)
    run(count, fill, keys, narrow_, out);
  else
    run(count, fill, keys, wide_, out);
}

std::size_t KeySort::bytes() const {
  return 8 * wide_.capacity() + 4 * (narrow_.capacity() + histogram_.capacity() + bucket_.capacity());
}

}  // namespace spillikin::sort
