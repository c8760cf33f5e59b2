#include "bench/peers/subjects.h"

#include <filesystem>

#include "spillikin/io/read.h"
#include "tests/support/meshes.h"

namespace spillikin::bench {

std::vector<Subject> subjects(const std::string& folder) {
  constexpr std::uint64_t seed = 7;
  const auto cube = [](std::size_t points) { return [points] { return tests::delaunayCube(points, seed); }; };
  std::vector<Subject> all{
      {"cube, 10k random tetrahedra", {10, 70, 200}, cube(1'600), 10'000},
      {"cube, 100k random tetrahedra", {12, 50, 400}, cube(15'000), 100'000},
      {"thick shell with an opening", {10, 35, 150}, [] { return tests::shell(23); }, 100'000},
      {"interlocked tori", {10, 35, 150}, [] { return tests::interlockedTori(10); }, 100'000},
      {"50k hexahedra projected whole", {10, 30, 0}, [] { return tests::hexahedronGrid(37, 0.15); }, 50'000},
      {"cube, 1M random tetrahedra", {20, 70, 400}, cube(149'000), 1'000'000},
  };
  const auto file = [&](const char* name, Targets targets, std::size_t weight) {
    const auto path = std::filesystem::path(folder) / name;
    if (std::filesystem::exists(path))
      all.push_back({name, targets, [path] { return io::readMesh(path.string()); }, weight});
  };
  file("bf_tet5.vtu", {10, 30, 200}, 190'000);
  file("bracket_refined8.vtu", {15, 40, 0}, 1'650'000);
  return all;
}

}  // namespace spillikin::bench
