#include "bench/suite.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "spillikin/io/read.h"
#include "spillikin/render/defaults.h"

namespace spillikin::bench {

namespace fs = std::filesystem;

integrate::TransferFunction lookOf(const render::Session& session, const char* preset) {
  return render::typicalLook(session.mesh(), session.field(), preset);
}

std::vector<View> views(const render::Session& session, int size) {
  std::vector<View> all(3, session.defaultView(size, size));
  render::turnView(all[1], {37.0, 23.0, 1.2});
  const render::Box box = render::boundingBox(session.mesh());
  all[2].parallel_scale = render::fittingParallelScale(box, size, size);
  render::turnView(all[2], {-61.0, 41.0, 1.3});
  return all;
}

namespace {

bool isMesh(const fs::path& path) {
  static const std::array<const char*, 15> suffixes{".vtu", ".pvtu", ".vtk",  ".vts",  ".vtr",
                                                    ".vti", ".pvd",  ".ex2",  ".e",    ".exo",
                                                    ".g",   ".case", ".cgns", ".foam", "xyz.bin"};
  const std::string name = path.filename().string();
  return std::any_of(suffixes.begin(), suffixes.end(), [&](const std::string& s) { return name.ends_with(s); });
}

}  // namespace

mesh::Source read(const fs::path& path) {
  mesh::Source source = io::readMesh(path.string());
  if (!source.arrays.empty() || source.points.empty()) return source;
  Vec3 lo = source.points[0], hi = lo;
  for (const Vec3& p : source.points) {
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  }
  mesh::Array made{made_field, mesh::Association::points, 1, {}};
  const double size = glm::length(hi - lo);
  for (const Vec3& p : source.points) {
    const Vec3 q = (p - lo) / size;
    made.values.push_back(q.x + 0.5 * q.y * q.y - 0.3 * q.z + q.x * q.z);
  }
  source.arrays.push_back(std::move(made));
  return source;
}

std::vector<fs::path> meshes(const fs::path& folder) {
  std::vector<fs::path> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (isMesh(entry.path())) all.push_back(entry.path());
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::string withoutFolder(std::string message, const fs::path& path) {
  const std::string folder = path.parent_path().string() + "/";
  for (std::size_t at = message.find(folder); at != std::string::npos; at = message.find(folder))
    message.erase(at, folder.size());
  return message;
}

}  // namespace spillikin::bench
