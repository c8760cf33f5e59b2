// Parts of one order put into another.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Where every cell comes in an order, so that some can be taken out of it. The order must outlive its use.
class Excerpts {
 public:
  // Cost: linear.
  void read(const Order& whole, std::size_t cell_count);
  // Appends the entries of these cells to `order` as they stand in the whole, cuts included. What is appended before
  // must lie behind these cells on every ray that meets both, what comes later in front of them; then the result is
  // right where the whole is.
  void append(std::span<const mesh::Id> cells, Order& order);

 private:
  const Order* whole_ = nullptr;
  std::vector<std::uint32_t> first_, entry_;  // by cell, and the end; indices into the whole
  std::vector<std::uint32_t> taken_;
};

}  // namespace spillikin::sort
