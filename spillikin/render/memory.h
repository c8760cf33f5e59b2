// What a picture needs of the machine's memory, asked before anything is done for it.
#pragma once

#include <cstddef>

#include "spillikin/base/view.h"

namespace spillikin::render {

// Bytes that processes can still get without swapping, as the system estimates it; the largest number where it does not
// tell.
std::size_t availableBytes();

// Throws Error, with both figures, when the float image of the view alone (16 bytes a pixel) is larger than
// `available`.
void requireImageMemory(const View& view, std::size_t available);

}  // namespace spillikin::render
