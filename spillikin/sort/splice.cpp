#include "spillikin/sort/splice.h"

namespace spillikin::sort {

void appendUnlisted(const Order& whole, const std::vector<std::uint8_t>& listed, Order& order) {
  std::size_t cut = 0;
  for (std::uint32_t i = 0; i < whole.cells.size(); ++i) {
    const bool has_cut = cut < whole.cuts.size() && whole.cuts[cut].entry == i;
    if (listed[whole.cells[i]] == 0) {
      if (has_cut) order.cuts.add(static_cast<std::uint32_t>(order.cells.size()), whole.cuts[cut].keep);
      order.cells.push_back(whole.cells[i]);
    }
    if (has_cut) ++cut;
  }
  order.cycles = whole.cycles;
  order.problems = whole.problems;
  order.exact = order.exact && whole.exact;
}

}  // namespace spillikin::sort
