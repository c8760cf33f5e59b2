// Sorting cells by short keys: one pass through memory, then one within the caches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// A radix sort, the upper digit first, stable, on all cores: cells by ascending key, equal keys by ascending id.
// Buckets of cells with one upper digit fit into a core's own cache, where the lower digit sorts them. The lower digit
// travels with the cell in one word (32 bits up to two million cells, 64 beyond). Keeps its scratch space; the result
// does not depend on the number of threads.
class KeySort {
 public:
  static constexpr unsigned low_bits = 11;
  // Bits of the keys that are worth their cost for so many cells: 20, or 22 beyond two million.
  static unsigned keyBits(std::size_t count);

  // Fills `out` with the cells 0 .. count - 1 by keys below 2^keyBits(count). `fill(begin, end)` writes keys[begin ..
  // end) and is called for disjoint ranges from several threads.
  static constexpr std::size_t range = 4096;
  using Fill = std::function<void(std::size_t begin, std::size_t end)>;
  void operator()(std::size_t count, const Fill& fill, const std::uint32_t* keys, std::vector<mesh::Id>& out);

  // After a call: out[bucketBegin(d) .. bucketBegin(d + 1)) have the upper digit d = key >> low_bits.
  std::size_t bucketBegin(std::size_t digit) const { return bucket_[digit]; }
  std::size_t bytes() const;

 private:
  template <class Word>
  void run(std::size_t count, const Fill& fill, const std::uint32_t* keys, std::vector<Word>& words,
           std::vector<mesh::Id>& out);

  std::vector<std::uint32_t> narrow_;  // lower digit and cell, by upper digit
  std::vector<std::uint64_t> wide_;
  std::vector<std::uint32_t> histogram_, bucket_;
};

}  // namespace spillikin::sort
