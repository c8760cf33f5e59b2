// The ways to a right picture of one mesh: an exact order, or a quicker one whose wrong pixels are sorted again.
#pragma once

#include <cstddef>
#include <string>

namespace spillikin::bench {

// Draws made meshes and those of the folder `data` (left out where there is none), at most `most` cells, behind several
// orders and from several viewpoints, and returns the table of it as Markdown.
std::string roadsSection(const std::string& data, std::size_t most, int frames);

}  // namespace spillikin::bench
