// Transfer functions from files.
#pragma once

#include <string>

#include "spillikin/integrate/transfer_function.h"

namespace spillikin::io {

// Reads the project's JSON ({"points":[{"value","color","extinction"}, ...]}) or ParaView's colour-map JSON (RGBPoints,
// Points; opacity a becomes extinction -ln(1 - a) / unit_distance, a = 1 is capped at 1 - 2^-24).
// Throws Error that names the file, the entry and the remedy.
integrate::TransferFunction readTransferFunction(const std::string& path, double unit_distance = 1.0);

}  // namespace spillikin::io
