// Putting right what is nearly sorted: runs of cells around neighbours in the wrong order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spillikin/sort/key_sort.h"
#include "spillikin/sort/sort.h"

namespace spillikin::sort {

// An order by keys in which the cells on either side of some interior faces may come the wrong way round. Every face
// that may be wrong is looked at with the exact predicate; around each that is, the run of cells from one of its two to
// the other is sorted topologically by the exact sides of its faces. Runs that meet are joined. As all relations that
// leave a run keep their sense when it is rearranged, what was right stays right.
//
// Cost: an exact predicate a suspect, a search for each wrong one, and the lengths of the runs. Keeps scratch space.
class Repair {
 public:
  explicit Repair(const mesh::Mesh& mesh) : mesh_(mesh) {}
  // `keys` by cell and `sort`, which made order.cells from them. Returns false when a run had a cycle, whose cells then
  // stay as they were.
  bool operator()(const std::vector<std::vector<mesh::Id>>& suspects, const std::uint32_t* keys, const KeySort& sort,
                  const Viewpoint& viewpoint, Order& order);
  std::size_t repaired() const { return repaired_; }  // cells in the runs of the last call

 private:
  struct Run {
    std::size_t begin, end;  // places in the order
  };
  bool rearrange(const Run& run, const std::uint32_t* keys, const Viewpoint& viewpoint, Order& order) const;

  const mesh::Mesh& mesh_;
  std::vector<Run> runs_;
  std::size_t repaired_ = 0;
};

}  // namespace spillikin::sort
