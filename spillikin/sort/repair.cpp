#include "spillikin/sort/repair.h"

#include <oneapi/tbb/combinable.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <queue>
#include <span>

#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

// The cells of an interior face, the one that must come first before the other; sign 0: none must.
struct Relation {
  mesh::Id first = 0, second = 0;
  bool any = false;
};

Relation relation(const mesh::Mesh& mesh, std::size_t face, const Viewpoint& viewpoint) {
  const auto& t = mesh.triangle[face];
  const auto [behind, front] = mesh.triangle_cells[face];
  const int side = mesh::orientViewpoint(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], viewpoint);
  // The face's normal points from its first cell to its second.
  return side > 0 ? Relation{behind, front, true} : Relation{front, behind, side < 0};
}

// Cells sorted by key, then by id.
class Places {
 public:
  Places(std::span<const mesh::Id> cells, const std::uint32_t* keys, const KeySort& sort)
      : cells_(cells), keys_(keys), sort_(sort) {}
  bool before(mesh::Id a, mesh::Id b) const { return keys_[a] != keys_[b] ? keys_[a] < keys_[b] : a < b; }
  std::size_t operator()(mesh::Id cell) const {
    const std::size_t digit = keys_[cell] >> KeySort::low_bits;
    const auto begin = cells_.begin() + static_cast<std::ptrdiff_t>(sort_.bucketBegin(digit));
    const auto end = cells_.begin() + static_cast<std::ptrdiff_t>(sort_.bucketBegin(digit + 1));
    const auto at = std::lower_bound(begin, end, cell, [&](mesh::Id a, mesh::Id b) { return before(a, b); });
    return static_cast<std::size_t>(at - cells_.begin());
  }

 private:
  std::span<const mesh::Id> cells_;
  const std::uint32_t* keys_;
  const KeySort& sort_;
};

}  // namespace

// Kahn's algorithm on the run, of those cells that may come next always the one that was first before.
bool Repair::rearrange(const Run& run, const std::uint32_t* keys, const Viewpoint& viewpoint, Order& order) const {
  const std::size_t count = run.end - run.begin;
  const std::vector<mesh::Id> cells(order.cells.begin() + static_cast<std::ptrdiff_t>(run.begin),
                                    order.cells.begin() + static_cast<std::ptrdiff_t>(run.end));
  const auto before = [&](mesh::Id a, mesh::Id b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; };
  const auto local = [&](mesh::Id cell) -> std::size_t {  // or `count`
    if (before(cell, cells.front()) || before(cells.back(), cell)) return count;
    return static_cast<std::size_t>(std::lower_bound(cells.begin(), cells.end(), cell, before) - cells.begin());
  };
  std::vector<std::array<std::uint32_t, 4>> after(count);
  std::vector<std::uint8_t> afters(count, 0), waits(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 4 * std::size_t{cells[i]}; k < 4 * std::size_t{cells[i]} + 4; ++k) {
      const mesh::FaceUse use = mesh_.cell_face[k];
      const mesh::Id other = mesh_.triangle_cells[use.face()][1U - use.side()];
      if (use.side() != 0 || other == mesh::none) continue;  // from its first cell alone
      const std::size_t j = local(other);
      if (j == count) continue;
      const Relation r = relation(mesh_, use.face(), viewpoint);
      if (!r.any) continue;
      const std::size_t first = r.first == other ? j : i, second = first == i ? j : i;
      after[first][afters[first]++] = static_cast<std::uint32_t>(second);
      ++waits[second];
    }
  }
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
  for (std::size_t i = 0; i < count; ++i) {
    if (waits[i] == 0) ready.push(static_cast<std::uint32_t>(i));
  }
  std::size_t at = run.begin;
  while (!ready.empty()) {
    const std::uint32_t i = ready.top();
    ready.pop();
    order.cells[at++] = cells[i];
    for (std::uint8_t k = 0; k < afters[i]; ++k) {
      if (--waits[after[i][k]] == 0) ready.push(after[i][k]);
    }
  }
  const bool whole = at == run.end;
  for (std::size_t i = 0; !whole && i < count; ++i) {
    if (waits[i] != 0) order.cells[at++] = cells[i];
  }
  return whole;
}

bool Repair::operator()(const std::vector<std::vector<mesh::Id>>& suspects, const std::uint32_t* keys,
                        const KeySort& sort, const Viewpoint& viewpoint, Order& order) {
  const Places place(order.cells, keys, sort);
  tbb::combinable<std::vector<Run>> found;
  tbb::parallel_for(std::size_t{0}, suspects.size(), [&](std::size_t part) {
    auto& runs = found.local();
    const auto& faces = suspects[part];
    for (std::size_t i = 0; i < faces.size(); ++i) {
      // Faces far apart in memory: asked for ahead, first what they name, then that.
      if (i + 8 < faces.size()) __builtin_prefetch(&mesh_.triangle[faces[i + 8]]);
      if (i + 4 < faces.size()) {
        for (const mesh::Id v : mesh_.triangle[faces[i + 4]])
          __builtin_prefetch(&mesh_.points[v]);
      }
      const Relation r = relation(mesh_, faces[i], viewpoint);
      if (r.any && !place.before(r.first, r.second)) runs.push_back({place(r.second), place(r.first) + 1});
    }
  });
  runs_.clear();
  found.combine_each([&](const std::vector<Run>& runs) { runs_.insert(runs_.end(), runs.begin(), runs.end()); });
  std::sort(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) { return a.begin < b.begin; });
  std::size_t joined = 0;
  repaired_ = 0;
  for (const Run& run : runs_) {
    if (joined > 0 && run.begin < runs_[joined - 1].end) {
      runs_[joined - 1].end = std::max(runs_[joined - 1].end, run.end);
    } else {
      runs_[joined++] = run;
    }
  }
  runs_.resize(joined);
  for (const Run& run : runs_)
    repaired_ += run.end - run.begin;
  std::atomic<bool> whole{true};
  tbb::parallel_for(std::size_t{0}, runs_.size(), [&](std::size_t i) {
    if (!rearrange(runs_[i], keys, viewpoint, order)) whole.store(false, std::memory_order_relaxed);
  });
  return whole;
}

}  // namespace spillikin::sort
