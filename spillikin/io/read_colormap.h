// Transfer functions from files.
#pragma once

#include <string>

#include "spillikin/integrate/transfer_function.h"

namespace spillikin::io {

// ParaView's colour spaces and curved opacities are followed by added points, right to 1/1024 in colour and in opacity
// over the unit distance; of several maps in one file the first is taken; a map without Points gets an extinction that
// rises linearly from 0 to 1 / unit_distance.
//
// Reads the project's JSON ({"points":[{"value","color","extinction"}, ...]}) or ParaView's colour-map JSON (RGBPoints,
// Points; opacity a becomes extinction -ln(1 - a) / unit_distance, a = 1 is capped at 1 - 2^-24).
// Throws Error that names the file, the entry and the remedy.
integrate::TransferFunction readTransferFunction(const std::string& path, double unit_distance = 1.0);

}  // namespace spillikin::io
