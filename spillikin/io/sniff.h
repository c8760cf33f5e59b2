// What a file is, by its first bytes. Private to io.
#pragma once

#include <string>
#include <string_view>

namespace spillikin::io {

// A short name such as "VTK XML UnstructuredGrid", "legacy VTK", "NetCDF", "HDF5"; empty when it is not recognised.
std::string sniff(std::string_view head);

// The suffix that content of that name should have, ".vtu" for "VTK XML UnstructuredGrid"; empty when there is none.
std::string suffixFor(const std::string& content);

}  // namespace spillikin::io
