// Small files of every format, made without the readers' library where the format is text, and with the format's own
// library where it is not.
//
// All hold the same body: the box [0, 2] x [0, 1] x [0, 1], of two hexahedra side by side; points with x fastest, then
// y, then z. Point scalar "p" = x + 10 y + 100 z, cell scalar "c" = 5, 6 (where the format has cell data).
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

namespace spillikin::tests {

// A folder that is gone when this is.
class TempFolder {
 public:
  TempFolder();
  ~TempFolder();
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void writeText(const std::string& path, const std::string& text);
std::string readText(const std::string& path);

struct Sample {
  std::string name;                              // of the file to be read, in the folder
  std::function<void(const TempFolder&)> write;  // it and what it needs
  std::vector<std::string> files;                // all files whose content matters, the first being `name`
  std::size_t steps = 0;                         // times in the file; the time of step k is k / 2
  bool cell_data = true;
};

inline void PrintTo(const Sample& sample, std::ostream* out) {
  *out << sample.name;
}

const std::vector<Sample>& samples();
const Sample& sample(const std::string& name);

// A .vtu of ASCII arrays from the text of its elements.
std::string vtu(std::size_t points, std::size_t cells, const std::string& coordinates, const std::string& connectivity,
                const std::string& offsets, const std::string& types, const std::string& more = "");

}  // namespace spillikin::tests
