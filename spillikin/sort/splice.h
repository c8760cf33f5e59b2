// One order completed from another.
#pragma once

#include <cstdint>
#include <vector>

#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// Appends to `order` what `listed` (nonzero per cell) leaves out, as it stands in `whole`, cuts and cycles included.
// What is listed must lie behind all that is not, on every ray; then the result is right where `whole` is.
void appendUnlisted(const Order& whole, const std::vector<std::uint8_t>& listed, Order& order);

}  // namespace spillikin::sort
