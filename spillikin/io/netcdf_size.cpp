#include "spillikin/io/netcdf_size.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <vector>

namespace spillikin::io {
namespace {

constexpr std::uint64_t streaming = 0xFFFFFFFFU;  // as the number of records: not known

constexpr std::uint64_t beyond = std::numeric_limits<std::uint64_t>::max();

// Sums and products that stop at the largest number.
std::uint64_t plus(std::uint64_t a, std::uint64_t b) {
  return a > beyond - b ? beyond : a + b;
}
std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > beyond / b ? beyond : a * b;
}

std::uint64_t padded(std::uint64_t bytes) {
  return (bytes + 3) / 4 * 4;
}

// Bytes of one value of a NetCDF type; 0 for an unknown type.
std::uint64_t typeSize(std::uint64_t type) {
  constexpr std::array<std::uint64_t, 12> sizes = {0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
  return type < sizes.size() ? sizes[type] : 0;
}

// Big-endian numbers of the header. `good` is false from the first that is missing on.
class Header {
 public:
  explicit Header(const std::string& path) : in_(path, std::ios::binary) {
    std::array<char, 4> magic{};
    in_.read(magic.data(), 4);
    version_ = static_cast<unsigned char>(magic[3]);
    good_ = in_.gcount() == 4 && magic[0] == 'C' && magic[1] == 'D' && magic[2] == 'F' &&
            (version_ == 1 || version_ == 2 || version_ == 5);
  }

  bool good() const { return good_; }
  std::uint64_t word() { return number(4); }
  std::uint64_t count() { return number(version_ == 5 ? 8 : 4); }   // NON_NEG of the specification
  std::uint64_t offset() { return number(version_ == 1 ? 4 : 8); }  // OFFSET
  void skip(std::uint64_t bytes) {
    constexpr std::uint64_t longest = std::uint64_t{1} << 40;
    if (bytes > longest || !in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur)) good_ = false;
  }

  // The number of entries of a list, 0 where it is absent.
  std::uint64_t list() {
    word();  // the list's tag
    return count();
  }
  void skipName() { skip(padded(count())); }
  void skipAttributes() {
    for (std::uint64_t left = list(); good_ && left > 0; --left) {
      skipName();
      const std::uint64_t size = typeSize(word());
      skip(padded(times(count(), size)));
    }
  }

 private:
  std::uint64_t number(int bytes) {
    std::array<unsigned char, 8> raw{};
    if (!good_ || !in_.read(reinterpret_cast<char*>(raw.data()), bytes)) good_ = false;
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i)
      value = value << 8 | raw[static_cast<std::size_t>(i)];
    return good_ ? value : 0;
  }

  std::ifstream in_;
  int version_ = 0;
  bool good_ = false;
};

struct Variable {
  std::uint64_t begin = 0, bytes = 0;  // of all values, or of one record's
  bool record = false;
};

Variable readVariable(Header& header, const std::vector<std::uint64_t>& dimensions) {
  Variable variable;
  header.skipName();
  std::uint64_t values = 1;
  const std::uint64_t rank = header.count();
  for (std::uint64_t d = 0; header.good() && d < rank; ++d) {
    const std::uint64_t id = header.count();
    const std::uint64_t length = id < dimensions.size() ? dimensions[id] : 1;
    if (d == 0 && length == 0) {
      variable.record = true;
    } else {
      values = times(values, length);
    }
  }
  header.skipAttributes();
  variable.bytes = times(values, typeSize(header.word()));
  header.count();  // the size as stored, which overflows for large variables
  variable.begin = header.offset();
  return variable;
}

}  // namespace

std::optional<std::uint64_t> netcdfSize(const std::string& path) {
  Header header(path);
  if (!header.good()) return std::nullopt;
  const std::uint64_t records = header.count();
  std::vector<std::uint64_t> dimensions;
  for (std::uint64_t left = header.list(); header.good() && left > 0; --left) {
    header.skipName();
    dimensions.push_back(header.count());
  }
  header.skipAttributes();
  std::vector<Variable> variables;
  for (std::uint64_t left = header.list(); header.good() && left > 0; --left) {
    variables.push_back(readVariable(header, dimensions));
  }
  if (!header.good()) return beyond;

  // All record variables of one step stand together, each padded unless it is the only one.
  std::uint64_t record_bytes = 0;
  const auto record_count = std::count_if(variables.begin(), variables.end(), [](const auto& v) { return v.record; });
  for (const Variable& v : variables) {
    if (v.record) record_bytes = plus(record_bytes, record_count == 1 ? v.bytes : padded(v.bytes));
  }
  std::uint64_t end = 0;
  for (const Variable& v : variables) {
    const bool empty = v.record && (records == 0 || records == streaming);
    if (empty) continue;
    const std::uint64_t steps_before = v.record ? times(records - 1, record_bytes) : 0;
    end = std::max(end, plus(plus(v.begin, v.bytes), steps_before));
  }
  return end;
}

}  // namespace spillikin::io
