#include "spillikin/sort/tetgen_filling.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numeric>
#include <utility>

#define TETLIBRARY
#include <tetgen.h>

#include "spillikin/mesh/place.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

// The exterior in TetGen's terms: its vertices alone, numbered from 0.
struct Shell {
  std::vector<mesh::Id> vertex;                   // of the mesh, ascending
  std::vector<std::array<mesh::Id, 3>> triangle;  // places in `vertex`
};

Shell shellOf(const mesh::Mesh& mesh, const std::vector<ExteriorTriangle>& exterior) {
  Shell shell;
  for (const auto& t : exterior) {
    for (const mesh::Id v : t.corner)
      shell.vertex.push_back(mesh::place(mesh, v));
  }
  std::sort(shell.vertex.begin(), shell.vertex.end());
  shell.vertex.erase(std::unique(shell.vertex.begin(), shell.vertex.end()), shell.vertex.end());
  for (const auto& t : exterior) {
    auto& corners = shell.triangle.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = std::lower_bound(shell.vertex.begin(), shell.vertex.end(), mesh::place(mesh, t.corner[k]));
      corners[k] = static_cast<mesh::Id>(at - shell.vertex.begin());
    }
  }
  return shell;
}

// --- In the child process.

bool writeAll(int to, const void* data, std::size_t bytes) {
  const char* p = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = write(to, p, bytes);
    if (n <= 0) return false;
    p += n;
    bytes -= static_cast<std::size_t>(n);
  }
  return true;
}

void tetrahedralizeShell(const mesh::Mesh& mesh, const Shell& shell, tetgenio& out) {
  tetgenio in;
  in.firstnumber = 0;
  in.numberofpoints = static_cast<int>(shell.vertex.size());
  in.pointlist = new REAL[3 * shell.vertex.size()];
  for (std::size_t i = 0; i < shell.vertex.size(); ++i) {
    for (int k = 0; k < 3; ++k)
      in.pointlist[3 * i + static_cast<std::size_t>(k)] = mesh.points[shell.vertex[i]][k];
  }
  in.numberoffacets = static_cast<int>(shell.triangle.size());
  in.facetlist = new tetgenio::facet[shell.triangle.size()];
  for (std::size_t i = 0; i < shell.triangle.size(); ++i) {
    auto& facet = in.facetlist[i];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(&facet.polygonlist[0]);
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3];
    for (std::size_t k = 0; k < 3; ++k)
      facet.polygonlist[0].vertexlist[k] = static_cast<int>(shell.triangle[i][k]);
  }
  char switches[] = "pYYQc";
  tetrahedralize(switches, &in, &out);
}

[[noreturn]] void child(const mesh::Mesh& mesh, const Shell& shell, int to, unsigned most_seconds) {
  alarm(most_seconds);
  // What TetGen says on its way is of no use to anybody here.
  if (std::freopen("/dev/null", "w", stdout) == nullptr || std::freopen("/dev/null", "w", stderr) == nullptr) _exit(1);
  bool done = false;
  try {
    tetgenio out;
    tetrahedralizeShell(mesh, shell, out);
    const std::int32_t counts[2] = {out.numberofpoints, out.numberoftetrahedra};
    done = out.numberofcorners == 4 && writeAll(to, counts, sizeof(counts)) &&
           writeAll(to, out.pointlist, sizeof(double) * 3 * static_cast<std::size_t>(counts[0])) &&
           writeAll(to, out.tetrahedronlist, sizeof(int) * 4 * static_cast<std::size_t>(counts[1]));
  } catch (...) {  // TetGen throws ints
    _exit(3);
  }
  _exit(done ? 0 : 1);
}

// --- In the parent.

bool readAll(int from, void* data, std::size_t bytes) {
  char* p = static_cast<char*>(data);
  while (bytes > 0) {
    const ssize_t n = read(from, p, bytes);
    if (n <= 0) return false;
    p += n;
    bytes -= static_cast<std::size_t>(n);
  }
  return true;
}

struct Result {
  std::vector<double> points;
  std::vector<std::int32_t> corners;
};

// Returns what went wrong, or an empty string.
std::string runChild(const mesh::Mesh& mesh, const Shell& shell, unsigned most_seconds, Result& result) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe could be opened to TetGen";
  const pid_t pid = fork();
  if (pid < 0) {
    close(ends[0]);
    close(ends[1]);
    return "no process could be started for TetGen";
  }
  if (pid == 0) {
    close(ends[0]);
    child(mesh, shell, ends[1], most_seconds);
  }
  close(ends[1]);
  std::int32_t counts[2] = {0, 0};
  bool whole = readAll(ends[0], counts, sizeof(counts)) && counts[0] >= 0 && counts[1] >= 0;
  if (whole) {
    result.points.resize(3 * static_cast<std::size_t>(counts[0]));
    result.corners.resize(4 * static_cast<std::size_t>(counts[1]));
    whole = readAll(ends[0], result.points.data(), result.points.size() * sizeof(double)) &&
            readAll(ends[0], result.corners.data(), result.corners.size() * sizeof(std::int32_t));
  }
  close(ends[0]);
  int status = 0;
  waitpid(pid, &status, 0);
  if (WIFSIGNALED(status)) {
    return WTERMSIG(status) == SIGALRM ? "TetGen took longer than " + std::to_string(most_seconds) + " s"
                                       : "TetGen crashed on its exterior, which probably crosses or overlaps itself";
  }
  if (WEXITSTATUS(status) == 3) return "TetGen gave up on its exterior, which touches or crosses itself";
  return whole && WEXITSTATUS(status) == 0 ? "" : "TetGen ended early";
}

using Corners = std::array<mesh::Id, 3>;

struct TetFace {
  Corners key;  // ascending
  std::uint32_t tet;
  bool even;  // the outward face is an even permutation of the key
};

bool sortCorners(Corners& c) {  // returns whether the permutation was even
  bool even = true;
  const auto order = [&](std::size_t i, std::size_t j) {
    if (c[i] > c[j]) {
      std::swap(c[i], c[j]);
      even = !even;
    }
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return even;
}

// Which of TetGen's tetrahedra lie outside the mesh: those on the outer side of an exterior triangle and all that is
// reached from them without crossing one. Returns what is wrong with the result, or an empty string.
std::string keepOutside(const Shell& shell, std::vector<std::array<mesh::Id, 4>>& tetrahedra) {
  std::vector<TetFace> faces;
  faces.reserve(4 * tetrahedra.size());
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
    const auto& v = tetrahedra[t];
    // Outward faces of a tetrahedron of positive volume, det[b - a, c - a, d - a] > 0.
    for (Corners c :
         {Corners{v[0], v[2], v[1]}, Corners{v[0], v[1], v[3]}, Corners{v[1], v[2], v[3]}, Corners{v[0], v[3], v[2]}}) {
      const bool even = sortCorners(c);
      faces.push_back({c, t, even});
    }
  }
  std::sort(faces.begin(), faces.end(),
            [](const TetFace& a, const TetFace& b) { return a.key != b.key ? a.key < b.key : a.tet < b.tet; });
  enum : std::uint8_t { unknown, outside, inside };
  std::vector<std::uint8_t> label(tetrahedra.size(), unknown);
  std::vector<std::uint8_t> wall(faces.size(), 0);
  std::vector<std::uint32_t> stack;
  bool consistent = true;
  for (Corners c : shell.triangle) {
    const bool even = sortCorners(c);
    auto at =
        std::lower_bound(faces.begin(), faces.end(), c, [](const TetFace& f, const Corners& k) { return f.key < k; });
    if (at == faces.end() || at->key != c) return "TetGen lost a face of its exterior";
    for (; at != faces.end() && at->key == c; ++at) {
      wall[static_cast<std::size_t>(at - faces.begin())] = 1;
      // Outward from the mesh and outward from the tetrahedron: the same way only inside the mesh.
      const std::uint8_t want = at->even == even ? inside : outside;
      if (label[at->tet] == unknown) stack.push_back(at->tet);
      consistent = consistent && (label[at->tet] == unknown || label[at->tet] == want);
      label[at->tet] = want;
    }
  }
  std::vector<std::array<std::uint32_t, 4>> at_tet(tetrahedra.size());  // indices of its faces
  std::vector<std::uint8_t> used(tetrahedra.size(), 0);
  for (std::uint32_t i = 0; i < faces.size(); ++i)
    at_tet[faces[i].tet][used[faces[i].tet]++] = i;
  while (!stack.empty()) {
    const std::uint32_t t = stack.back();
    stack.pop_back();
    for (const std::uint32_t i : at_tet[t]) {
      if (wall[i] != 0) continue;
      for (const std::size_t j : {std::size_t{i} - 1, std::size_t{i} + 1}) {
        if (j >= faces.size() || faces[j].key != faces[i].key) continue;
        const std::uint32_t other = faces[j].tet;
        if (label[other] == unknown) {
          label[other] = label[t];
          stack.push_back(other);
        }
        consistent = consistent && label[other] == label[t];
      }
    }
  }
  if (!consistent) return "its exterior does not part inside from outside";
  std::size_t kept = 0;
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    if (label[t] == outside) tetrahedra[kept++] = tetrahedra[t];
  }
  tetrahedra.resize(kept);
  return "";
}

}  // namespace

Filling fillOutside(const mesh::Mesh& mesh, const std::vector<ExteriorTriangle>& exterior, unsigned most_seconds) {
  Filling filling;
  const Shell shell = shellOf(mesh, exterior);
  Result result;
  filling.failure = runChild(mesh, shell, most_seconds, result);
  if (!filling.failure.empty()) return filling;
  const std::size_t known = shell.vertex.size(), total = result.points.size() / 3;
  const auto fail = [&](const char* why) {
    filling.failure = why;
    filling.points.clear();
    filling.tetrahedra.clear();
    return filling;
  };
  if (total < known) return fail("TetGen lost a vertex");
  for (std::size_t i = known; i < total; ++i) {
    filling.points.emplace_back(result.points[3 * i], result.points[3 * i + 1], result.points[3 * i + 2]);
  }
  const auto point = [&](mesh::Id v) { return v < known ? mesh.points[shell.vertex[v]] : filling.points[v - known]; };
  for (std::size_t t = 0; t < result.corners.size(); t += 4) {
    std::array<mesh::Id, 4> v{};
    for (std::size_t k = 0; k < 4; ++k) {
      if (result.corners[t + k] < 0 || static_cast<std::size_t>(result.corners[t + k]) >= total) {
        return fail("TetGen named a vertex that does not exist");
      }
      v[k] = static_cast<mesh::Id>(result.corners[t + k]);
    }
    const int volume = mesh::orient3d(point(v[0]), point(v[1]), point(v[2]), point(v[3]));
    if (volume == 0) return fail("TetGen made a flat tetrahedron");
    if (volume < 0) std::swap(v[0], v[1]);
    filling.tetrahedra.push_back(v);
  }
  const std::string wrong = keepOutside(shell, filling.tetrahedra);
  if (!wrong.empty()) return fail(wrong.c_str());
  const std::size_t shift = mesh.points.size() - known;
  for (auto& tetrahedron : filling.tetrahedra) {
    for (mesh::Id& v : tetrahedron)
      v = v < known ? shell.vertex[v] : static_cast<mesh::Id>(v + shift);
  }
  return filling;
}

}  // namespace spillikin::sort
