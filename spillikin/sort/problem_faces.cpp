#include "spillikin/sort/problem_faces.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>

#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {

ProblemFaces::ProblemFaces(const mesh::Mesh& mesh, const FaceSigns& signs) : mesh_(mesh), signs_(signs) {
  if (mesh.quad_count() == 0) return;
  valley_.resize((mesh.quad_count() + 31) / 32);
  problem_.resize(valley_.size());
  count_.resize(mesh.cell_count());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, valley_.size(), 256), [&](const auto& range) {
    for (std::size_t word = range.begin(); word < range.end(); ++word) {
      const std::size_t last = std::min(mesh.quad_count(), 32 * word + 32);
      for (std::size_t q = 32 * word; q < last; ++q) {
        const auto& [a, b, c, d] = mesh.quad[q];
        const int s = mesh::orient3d(mesh.points[a], mesh.points[b], mesh.points[c], mesh.points[d]);
        // The normal points away from the cell on side 0: a fourth corner out there makes a valley.
        const std::uint64_t bits = s > 0 ? 1U : s < 0 && mesh.quad_cells[q][1] != mesh::none ? 2U : 0U;
        valley_[word] |= bits << (2 * (q % 32));
      }
    }
  });
}

void ProblemFaces::update() {
  touched_.clear();
  changed_.clear();
  const std::uint64_t *first = signs_.firstHalves(), *second = signs_.secondHalves();
  for (std::size_t word = 0; word < problem_.size(); ++word) {
    const std::uint64_t f = first[word], s = second[word];
    constexpr std::uint64_t even = 0x5555555555555555U;
    const std::uint64_t apart = ((f & (s >> 1)) | ((f >> 1) & s)) & even;
    const std::uint64_t now = (apart | (apart << 1)) & valley_[word];
    std::uint64_t changes = now ^ problem_[word];
    problem_[word] = now;
    for (; changes != 0; changes &= changes - 1) {
      const auto at = static_cast<std::size_t>(std::countr_zero(changes));
      const bool begins = ((now >> at) & 1U) != 0;
      const mesh::Id cell = mesh_.quad_cells[32 * word + at / 2][at % 2];
      faces_ += begins ? 1U : std::size_t{0} - 1U;
      count_[cell] += begins ? 1U : 0U - 1U;
      touched_.push_back(cell);
    }
  }
  for (const mesh::Id cell : touched_) {
    const bool was = (count_[cell] & was_problem) != 0, is = (count_[cell] & count_mask) != 0;
    if (was == is) continue;
    count_[cell] ^= was_problem;
    cells_ += is ? 1U : std::size_t{0} - 1U;
    changed_.push_back(cell);
  }
}

std::size_t ProblemFaces::bytes() const {
  return 8 * (valley_.capacity() + problem_.capacity()) + 4 * count_.capacity() +
         sizeof(mesh::Id) * (touched_.capacity() + changed_.capacity());
}

}  // namespace spillikin::sort
