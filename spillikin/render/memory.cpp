#include "spillikin/render/memory.h"

#include <fmt/format.h>

#include <fstream>
#include <limits>
#include <string>

#include "spillikin/base/error.h"

namespace spillikin::render {

std::size_t availableBytes() {
  std::ifstream in("/proc/meminfo");
  std::string word;
  for (std::size_t kibibytes = 0; in >> word;) {
    if (word == "MemAvailable:" && in >> kibibytes) return kibibytes * 1024;
  }
  return std::numeric_limits<std::size_t>::max();
}

void requireImageMemory(const View& view, std::size_t available) {
  if (view.width <= 0 || view.height <= 0) return;  // not an image at all: the camera says so
  constexpr double gigabyte = 1e9;
  const double bytes = 4.0 * sizeof(float) * view.width * view.height;
  if (bytes <= static_cast<double>(available)) return;
  throw Error(fmt::format(
      "an image of {} x {} pixels takes {:.1f} GB and {:.1f} GB of memory are free; make it smaller (--size)",
      view.width, view.height, bytes / gigabyte, static_cast<double>(available) / gigabyte));
}

}  // namespace spillikin::render
