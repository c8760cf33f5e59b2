// Faces and adjacency: every face of every cell is filed under its smallest vertex, and what meets there is matched.
// Linear time; per cell some 10 bytes besides the mesh. Cells numbered along their smallest vertex make it a walk
// through memory.
#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <limits>

#include "spillikin/base/error.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/cell_faces.h"
#include "spillikin/mesh/parallel.h"

namespace spillikin::mesh {
namespace {

constexpr std::size_t vertices_per_chunk = 1024;

// A face as one cell sees it, without its smallest place (the bucket it lies in). Of a triangle: 0, the lower and the
// higher of the other two. Of a quadrilateral (m, a, b, c): b, the lower and the higher of a and c, so that both sides
// agree; b cannot be 0, which only a smallest place can.
struct HalfFace {
  std::uint64_t opposite_and_lower;
  Id higher;
  Id cell;
  Id slot;       // in Mesh::cell_face
  bool forward;  // the cell sees the lower before the higher

  static HalfFace make(Id a, Id opposite, Id c, Id cell, Id slot) {
    const std::uint64_t key = static_cast<std::uint64_t>(opposite) << 32 | std::min(a, c);
    return {key, std::max(a, c), cell, slot, a < c};
  }
  Id opposite() const { return static_cast<Id>(opposite_and_lower >> 32); }
  Id lower() const { return static_cast<Id>(opposite_and_lower); }
  bool triangle() const { return opposite() == 0; }
  bool sameFace(const HalfFace& other) const {
    return opposite_and_lower == other.opposite_and_lower && higher == other.higher;
  }
  bool operator<(const HalfFace& other) const {
    if (opposite_and_lower != other.opposite_and_lower) return opposite_and_lower < other.opposite_and_lower;
    return higher != other.higher ? higher < other.higher : slot < other.slot;
  }
};

// Vertices at one point have neighbouring ids; the first of them stands for their place. Empty: no two coincide.
std::vector<Id> places(const std::vector<Vec3>& points) {
  std::atomic<bool> coincident{false};
  parallelFor(points.size(), [&](std::size_t v) {
    if (v > 0 && points[v] == points[v - 1]) coincident.store(true, std::memory_order_relaxed);
  });
  std::vector<Id> place;
  if (!coincident) return place;
  place.resize(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    place[v] = v > 0 && points[v] == points[v - 1] ? place[v - 1] : static_cast<Id>(v);
  }
  return place;
}

class Matcher {
 public:
  explicit Matcher(Mesh& mesh) : mesh_(mesh), place_(places(mesh.points)) {}

  std::size_t run() {
    countSlots();
    fileCells();
    const std::size_t chunks = (mesh_.points.size() + vertices_per_chunk - 1) / vertices_per_chunk;
    Counts none_yet;
    std::vector<Counts> counts(chunks + 1, none_yet);
    refused_.assign(chunks, {});
    eachChunk(chunks, [&](std::size_t k, Scratch& scratch) { counts[k + 1] = matchChunk(k, scratch, nullptr); });
    for (const std::string& message : refused_) {
      if (!message.empty()) throw Error(message);
    }
    for (std::size_t k = 0; k < chunks; ++k)
      counts[k + 1].add(counts[k]);
    allocate(counts[chunks]);
    eachChunk(chunks, [&](std::size_t k, Scratch& scratch) { matchChunk(k, scratch, &counts[k]); });
    return counts[chunks].folded;
  }

 private:
  struct Counts {
    std::size_t triangles = 0, quads = 0, folded = 0;
    void add(const Counts& other) {
      triangles += other.triangles;
      quads += other.quads;
      folded += other.folded;
    }
  };
  using Scratch = std::vector<HalfFace>;

  Id place(Id vertex) const { return place_.empty() ? vertex : place_[vertex]; }

  // Faces as they are stored: calls visit(face) with 3 or 4 vertices, the smallest first.
  template <class Visit>
  void eachFace(Id cell, const Visit& visit) const {
    if (mesh_.cell_type[cell] == CellType::tetrahedron) return eachFaceOfTetrahedron(cell, visit);
    forEachPolygon(mesh_, cell, [&](std::span<const Id> polygon) {
      if (polygon.size() == 3) {
        visit(fromSmallest(polygon[0], polygon[1], polygon[2]));
      } else if (polygon.size() == 4) {
        const std::size_t s = smallestCorner(polygon);
        visit(std::array<Id, 4>{polygon[s], polygon[(s + 1) & 3U], polygon[(s + 2) & 3U], polygon[(s + 3) & 3U]});
      } else {
        forEachTriangle(polygon, [&](Id a, Id b, Id c) { visit(std::array<Id, 4>{a, b, c, none}); });
      }
    });
  }

  // The same faces in the same order, some three times faster: most meshes consist of them.
  template <class Visit>
  void eachFaceOfTetrahedron(Id cell, const Visit& visit) const {
    const Id* v = mesh_.cell_vertex.data() + mesh_.cell_vertex_offset[cell];
    visit(fromSmallest(v[0], v[1], v[3]));
    visit(fromSmallest(v[1], v[2], v[3]));
    visit(fromSmallest(v[2], v[0], v[3]));
    visit(fromSmallest(v[0], v[2], v[1]));
  }

  static std::array<Id, 4> fromSmallest(Id a, Id b, Id c) {
    if (a < b && a < c) return {a, b, c, none};
    return b < c ? std::array<Id, 4>{b, c, a, none} : std::array<Id, 4>{c, a, b, none};
  }

  void countSlots() {
    const std::size_t n = mesh_.cell_count();
    mesh_.cell_face_offset.assign(n + 1, 0);
    std::size_t total = 0;
    for (std::size_t c = 0; c < n; ++c) {
      mesh_.cell_face_offset[c] = static_cast<Id>(total);
      total += storedFaces(static_cast<Id>(c));
    }
    if (total > std::numeric_limits<std::uint32_t>::max() - 1) {
      throw Error(fmt::format("{}: {} cells have {} faces, more than the 2^32 that ids can count; take a part of it",
                              mesh_.name.empty() ? "mesh" : mesh_.name, n, total));
    }
    mesh_.cell_face_offset[n] = static_cast<Id>(total);
    mesh_.cell_face.resize(total);
  }

  std::size_t storedFaces(Id cell) const {
    constexpr std::array<std::uint8_t, cell_type_count> fixed{4, 5, 5, 6, 11, 14, 0};
    const CellType type = mesh_.cell_type[cell];
    if (type != CellType::polyhedron) return fixed[static_cast<std::size_t>(type)];
    std::size_t count = 0;
    forEachPolygon(mesh_, cell, [&](std::span<const Id> p) { count += p.size() <= 4 ? 1 : p.size() - 2; });
    return count;
  }

  // Every cell is filed once under each vertex that is the smallest of some of its faces.
  void fileCells() {
    const std::size_t n = mesh_.points.size();
    file_offset_.assign(n + 1, 0);
    eachSmallest(
        [&](Id vertex, Id) { std::atomic_ref<Id>(file_offset_[vertex]).fetch_add(1, std::memory_order_relaxed); });
    std::size_t total = 0;
    for (std::size_t v = 0; v <= n; ++v) {
      const Id count = file_offset_[v];
      file_offset_[v] = static_cast<Id>(total);
      total += count;
    }
    file_.resize(total);
    // The offsets move to the end of their bucket while it fills, which is where the next one begins.
    eachSmallest([&](Id vertex, Id cell) {
      file_[std::atomic_ref<Id>(file_offset_[vertex]).fetch_add(1, std::memory_order_relaxed)] = cell;
    });
  }

  template <class Visit>
  void eachSmallest(const Visit& visit) const {
    parallelFor(mesh_.cell_count(), [&](std::size_t c) {
      std::array<Id, 16> seen;  // of the cell's smallest places; a polyhedron with more is filed twice at no harm
      std::size_t count = 0;
      eachFace(static_cast<Id>(c), [&](const std::array<Id, 4>& face) {
        const Id smallest = place(face[0]);
        if (std::find(seen.begin(), seen.begin() + count, smallest) != seen.begin() + count) return;
        if (count < seen.size()) seen[count++] = smallest;
        visit(smallest, static_cast<Id>(c));
      });
    });
  }

  template <class Work>
  void eachChunk(std::size_t chunks, const Work& work) const {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, chunks, 1), [&](const tbb::blocked_range<std::size_t>& range) {
      Scratch scratch;
      for (std::size_t k = range.begin(); k != range.end(); ++k)
        work(k, scratch);
    });
  }

  void gather(Id vertex, Scratch& scratch) const {
    scratch.clear();
    const std::size_t begin = vertex == 0 ? 0 : file_offset_[vertex - 1];
    for (std::size_t i = begin; i < file_offset_[vertex]; ++i) {
      const Id cell = file_[i];
      Id slot = mesh_.cell_face_offset[cell];
      eachFace(cell, [&](const std::array<Id, 4>& face) {
        if (place(face[0]) == vertex) {
          const bool triangle = face[3] == none;
          const Id a = place(face[1]), c = place(triangle ? face[2] : face[3]);
          scratch.push_back(HalfFace::make(a, triangle ? 0 : place(face[2]), c, cell, slot));
        }
        ++slot;
      });
    }
    std::sort(scratch.begin(), scratch.end());
    // A polyhedron that was filed twice.
    scratch.erase(std::unique(scratch.begin(), scratch.end(),
                              [](const HalfFace& p, const HalfFace& q) { return p.slot == q.slot; }),
                  scratch.end());
  }

  // Counts the chunk's faces, and stores them from `start` on when it is given.
  Counts matchChunk(std::size_t chunk, Scratch& scratch, const Counts* start) {
    const std::size_t begin = chunk * vertices_per_chunk;
    const std::size_t end = std::min(mesh_.points.size(), begin + vertices_per_chunk);
    Counts found;
    for (std::size_t v = begin; v < end; ++v) {
      gather(static_cast<Id>(v), scratch);
      for (std::size_t i = 0; i < scratch.size();) {
        std::size_t j = i + 1;
        while (j < scratch.size() && scratch[j].sameFace(scratch[i]))
          ++j;
        if (j - i > 2 || (j - i == 2 && sameCell(scratch[i], scratch[i + 1]))) refuse(scratch, i, j, refused_[chunk]);
        if (j - i == 2 && scratch[i].forward != scratch[i + 1].forward) {
          store(static_cast<Id>(v), scratch[i], &scratch[i + 1], found, start);
        } else {
          // Two cells on one side of their face overlap: neither lies behind it, so each keeps it as its own.
          if (j - i == 2) ++found.folded;
          for (std::size_t k = i; k < j; ++k)
            store(static_cast<Id>(v), scratch[k], nullptr, found, start);
        }
        i = j;
      }
    }
    return found;
  }

  // A cell that stands in the file twice.
  bool sameCell(const HalfFace& p, const HalfFace& q) const {
    if (p.forward != q.forward) return false;
    const auto sorted = [&](Id cell) {
      const std::span<const Id> vertices = mesh_.vertices(cell);
      std::vector<Id> result(vertices.begin(), vertices.end());
      for (Id& v : result)
        v = place(v);
      std::sort(result.begin(), result.end());
      return result;
    };
    return sorted(p.cell) == sorted(q.cell);
  }

  // The first refusal of each chunk is kept, so that the message does not depend on which thread came first.
  void refuse(const Scratch& scratch, std::size_t begin, std::size_t end, std::string& message) const {
    if (!message.empty()) return;
    std::string cells;
    for (std::size_t i = begin; i < end && i < begin + 8; ++i) {
      cells += fmt::format("{}{}", i == begin ? "" : ", ", mesh_.cell_file_id[scratch[i].cell]);
    }
    message = fmt::format(
        "{}: cells {}{} share one face and overlap: at most two cells, one on each side, can; remove the "
        "doubled cells",
        mesh_.name.empty() ? "mesh" : mesh_.name, cells, end > begin + 8 ? ", ..." : "");
  }

  void store(Id smallest, const HalfFace& front, const HalfFace* back, Counts& found, const Counts* start) {
    const bool triangle = front.triangle();
    const std::size_t index = triangle ? found.triangles++ : found.quads++;
    if (start == nullptr) return;
    const std::size_t at = index + (triangle ? start->triangles : start->quads);
    const Id face = static_cast<Id>(triangle ? at : mesh_.triangle.size() + at);
    const std::array<Id, 4> vertices = place_.empty() ? faceFromKey(smallest, front) : faceOfSlot(front);
    const std::array<Id, 2> cells{front.cell, back == nullptr ? none : back->cell};
    if (triangle) {
      mesh_.triangle[at] = {vertices[0], vertices[1], vertices[2]};
      mesh_.triangle_cells[at] = cells;
    } else {
      mesh_.quad[at] = vertices;
      mesh_.quad_cells[at] = cells;
    }
    mesh_.cell_face[front.slot] = FaceUse{face << 1};
    if (back != nullptr) mesh_.cell_face[back->slot] = FaceUse{(face << 1) | 1U};
  }

  // Where places are vertices, the key has them all.
  static std::array<Id, 4> faceFromKey(Id smallest, const HalfFace& half) {
    const Id second = half.forward ? half.lower() : half.higher, last = half.forward ? half.higher : half.lower();
    if (half.triangle()) return {smallest, second, last, none};
    return {smallest, second, half.opposite(), last};
  }

  std::array<Id, 4> faceOfSlot(const HalfFace& half) const {
    std::array<Id, 4> vertices{};
    Id slot = mesh_.cell_face_offset[half.cell];
    eachFace(half.cell, [&](const std::array<Id, 4>& face) {
      if (slot++ == half.slot) vertices = face;
    });
    return vertices;
  }

  void allocate(const Counts& total) {
    const std::size_t faces = total.triangles + total.quads;
    if (faces > std::size_t{1} << 31) {
      throw Error(fmt::format("{}: {} faces, more than the 2^31 that ids can count; take a part of the mesh",
                              mesh_.name.empty() ? "mesh" : mesh_.name, faces));
    }
    mesh_.triangle.resize(total.triangles);
    mesh_.triangle_cells.resize(total.triangles);
    mesh_.quad.resize(total.quads);
    mesh_.quad_cells.resize(total.quads);
  }

  Mesh& mesh_;
  std::vector<Id> place_;
  std::vector<Id> file_offset_, file_;
  std::vector<std::string> refused_;
};

}  // namespace

std::size_t matchFaces(Mesh& mesh) {
  return Matcher(mesh).run();
}

}  // namespace spillikin::mesh
