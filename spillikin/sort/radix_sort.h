// Sorting cells by one number each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

// The unsigned numbers of floats, in the opposite order: the largest float has the smallest number.
inline std::uint32_t descendingKey(float value) {
  const auto bits = __builtin_bit_cast(std::uint32_t, value);
  return (bits & 0x80000000U) != 0 ? bits : ~bits & 0x7FFFFFFFU;
}

// A radix sort from the least significant digit, stable, on all cores: cells by ascending key, equal keys by ascending
// id. Keeps its scratch space; the result does not depend on the number of threads.
class RadixSort {
 public:
  // One key per cell, to be written before a call; a call destroys them.
  std::vector<std::uint32_t>& keys() { return keys_; }
  void operator()(std::vector<mesh::Id>& out);
  // The keys beside `out`, after a call.
  const std::vector<std::uint32_t>& sortedKeys() const { return other_keys_; }
  std::size_t bytes() const;

 private:
  std::vector<std::uint32_t> keys_, other_keys_;
  std::vector<mesh::Id> other_ids_;
  std::vector<std::uint32_t> histogram_;
};

}  // namespace spillikin::sort
