// How long a classic NetCDF file must be. Private to io.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace spillikin::io {

// The least number of bytes that the variables of a classic NetCDF file (CDF-1, CDF-2, CDF-5) need, by its header; the
// library itself reads zeros beyond the end of a file cut short. Nothing where the file is not of that kind; the
// largest number where the header itself runs beyond the end. Follows the file format specification of the NetCDF
// user's guide, appendix B. Reads the header only.
std::optional<std::uint64_t> netcdfSize(const std::string& path);

}  // namespace spillikin::io
