#include "spillikin/mesh/refit.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "spillikin/base/error.h"

namespace spillikin::mesh {

namespace {

// FNV-1a over 64-bit words, the tail padded with zeros.
class Hash {
 public:
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.size());
    const auto bytes = std::as_bytes(std::span(values));
    for (std::size_t i = 0; i < bytes.size(); i += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data() + i, std::min<std::size_t>(8, bytes.size() - i));
      add(word);
    }
  }
  void add(std::uint64_t word) { state_ = (state_ ^ word) * 0x100000001b3ULL ^ (state_ >> 29U); }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

bool allPositive(const Mesh& mesh, const std::vector<Vec3>& points) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.cell_count(), 4096), true,
      [&](const auto& range, bool good) {
        Surface scratch;
        for (std::size_t c = range.begin(); good && c < range.end(); ++c) {
          surface(mesh, static_cast<Id>(c), scratch);
          good = enclosedVolume(points, scratch) > 0.0;
        }
        return good;
      },
      [](bool a, bool b) { return a && b; });
}

bool finite(const Vec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

}  // namespace

std::uint64_t topologyFingerprint(const Source& source) {
  Hash hash;
  hash.add(source.points.size());
  hash.add(source.types);
  hash.add(source.offsets);
  hash.add(source.connectivity);
  hash.add(source.left_out);
  return hash.value();
}

bool refit(Mesh& mesh, const BuildReport& report, const Source& source) {
  const bool depends_on_places =
      report.merged_points + report.coincident_points + report.degenerate + report.quadratic + report.unclosed > 0;
  if (depends_on_places) return false;
  // The hull of a convex point set may have other faces when its points have moved.
  if (std::find(source.types.begin(), source.types.end(), vtk_cell::convex_point_set) != source.types.end())
    return false;
  std::vector<Vec3> points(mesh.points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3& p = source.points.at(mesh.point_file_id[v]);
    if (!finite(p)) return false;  // build() says which and how many
    points[v] = p;
  }
  if (!allPositive(mesh, points)) return false;
  mesh.points = std::move(points);
  return true;
}

void warp(Source& source, const std::string& array, double scale) {
  const auto usable = [](const Array& a) { return a.association == Association::points && a.components == 3; };
  const auto found = std::find_if(source.arrays.begin(), source.arrays.end(),
                                  [&](const Array& a) { return a.name == array && usable(a); });
  if (found == source.arrays.end()) {
    std::string names;
    for (const Array& a : source.arrays) {
      if (usable(a)) names += (names.empty() ? "" : ", ") + a.name;
    }
    throw Error(fmt::format("{}: no point array of three components is called '{}' at step {}; {}", source.name, array,
                            source.step, names.empty() ? "the file has none" : "there are " + names));
  }
  for (std::size_t p = 0; p < source.points.size(); ++p) {
    const double* d = found->values.data() + 3 * p;
    source.points[p] += scale * Vec3(d[0], d[1], d[2]);
  }
}

}  // namespace spillikin::mesh
