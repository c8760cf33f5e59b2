#include "spillikin/sort/splice.h"

#include <algorithm>

namespace spillikin::sort {

void Excerpts::read(const Order& whole, std::size_t cell_count) {
  whole_ = &whole;
  first_.assign(cell_count + 1, 0);
  for (const mesh::Id c : whole.cells)
    ++first_[c + 1];
  for (std::size_t c = 0; c < cell_count; ++c)
    first_[c + 1] += first_[c];
  entry_.resize(whole.cells.size());
  for (std::uint32_t i = static_cast<std::uint32_t>(whole.cells.size()); i > 0; --i)
    entry_[--first_[whole.cells[i - 1] + 1]] = i - 1;
  // Every first has come down to where its cell begins, one place too late.
  first_.erase(first_.begin());
  first_.push_back(static_cast<std::uint32_t>(whole.cells.size()));
}

void Excerpts::append(std::span<const mesh::Id> cells, Order& order) {
  taken_.clear();
  for (const mesh::Id c : cells)
    taken_.insert(taken_.end(), entry_.begin() + first_[c], entry_.begin() + first_[c + 1]);
  std::sort(taken_.begin(), taken_.end());
  for (const std::uint32_t i : taken_) {
    const std::size_t cut = whole_->cuts.first(i);
    if (cut < whole_->cuts.size() && whole_->cuts[cut].entry == i)
      order.cuts.add(static_cast<std::uint32_t>(order.cells.size()), whole_->cuts[cut].keep);
    order.cells.push_back(whole_->cells[i]);
  }
}

}  // namespace spillikin::sort
