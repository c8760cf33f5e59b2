#include "spillikin/sort/layered_sort.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>

#include "spillikin/base/error.h"

namespace spillikin::sort {
namespace {

// Layers of at least this many cells are worth the barrier of a parallel loop and a look at every mark.
constexpr std::size_t large_layer = 4096;
constexpr std::size_t block_words = 256;  // of marks, counted and written by one task
constexpr std::size_t ahead = 12;         // cells between asking for a row of neighbours and using it

inline void prefetch(const void* p) {
  __builtin_prefetch(p);
}

template <bool parallel, class T>
T decrement(T& value) {
  if constexpr (parallel) {
    return static_cast<T>(std::atomic_ref<T>(value).fetch_sub(1, std::memory_order_relaxed) - 1);
  } else {
    return --value;
  }
}

}  // namespace

LayeredSort::LayeredSort(const mesh::Mesh& mesh) : mesh_(mesh), tetrahedral_(mesh.tetrahedral()) {
  const std::size_t slots = mesh.cell_face.size(), cells = mesh.cell_count();
  neighbour_.resize(slots);
  after_.resize((slots + 63) / 64 + 1);
  count_.resize(cells);
  marked_.resize((cells + 63) / 64);
  block_count_.resize((marked_.size() + block_words - 1) / block_words);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, slots, 1 << 14), [&](const tbb::blocked_range<std::size_t>& r) {
    for (std::size_t k = r.begin(); k < r.end(); ++k)
      neighbour_[k] = mesh.neighbour(mesh.cell_face[k]);
  });
  for (std::size_t c = 0; c < cells; ++c) {
    if (mesh.cell_face_offset[c + 1] - mesh.cell_face_offset[c] >= std::numeric_limits<std::uint16_t>::max()) {
      throw Error(mesh.name + ": cell " + std::to_string(mesh.cell_file_id[c]) +
                  " has more than 65534 faces; cut it into smaller cells");
    }
  }
}

void LayeredSort::countEdges(const FaceSigns& signs, const ExtraEdges* extra) {
  const std::uint64_t* bits = signs.bits();
  const auto triangle_bits = static_cast<mesh::Id>(2 * mesh_.triangle_count());
  const std::size_t shift = 2 * signs.quadShift();
  const auto bit = [bits](std::size_t i) { return static_cast<unsigned>(bits[i >> 6] >> (i & 63U)) & 1U; };
  // Tasks own whole words of `after_`: a word is 64 slots, so a task begins at the cell whose first slot is a multiple
  // of 64 for tetrahedra, and writes by atomic or otherwise.
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, (mesh_.cell_count() + 15) / 16, 256),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      const std::size_t last = std::min(16 * range.end(), mesh_.cell_count());
                      if (tetrahedral_) {
                        std::uint64_t word = 0;
                        for (std::size_t c = 16 * range.begin(); c < last; ++c) {
                          unsigned count = 0, after = 0;
                          for (unsigned k = 0; k < 4; ++k) {
                            const std::size_t packed = mesh_.cell_face[4 * c + k].packed;
                            const unsigned inner = neighbour_[4 * c + k] != mesh::none ? 1U : 0U;
                            after |= (bit(packed) & inner) << k;
                            count += bit(packed ^ 1U) & inner;
                          }
                          count_[c] = static_cast<std::uint16_t>(count);
                          word |= std::uint64_t{after} << (4 * (c % 16));
                          if (c % 16 == 15 || c + 1 == last) {
                            after_[c / 16] = word;
                            word = 0;
                          }
                        }
                        return;
                      }
                      for (std::size_t c = 16 * range.begin(); c < last; ++c) {
                        unsigned count = 0;
                        for (std::size_t k = mesh_.cell_face_offset[c]; k < mesh_.cell_face_offset[c + 1]; ++k) {
                          if (neighbour_[k] == mesh::none) continue;
                          const mesh::Id packed = mesh_.cell_face[k].packed;
                          const std::size_t at = packed < triangle_bits ? packed : packed + shift;
                          count += bit(at ^ 1U);
                          if (bit(at) != 0) {
                            std::atomic_ref<std::uint64_t>(after_[k >> 6])
                                .fetch_or(std::uint64_t{1} << (k & 63U), std::memory_order_relaxed);
                          }
                        }
                        count_[c] = static_cast<std::uint16_t>(count);
                      }
                    });
  if (extra == nullptr || extra->empty()) return;
  extra_count_.assign(mesh_.cell_count(), 0);
  for (const mesh::Id cell : extra->successor)
    ++extra_count_[cell];
  for (std::size_t c = 0; c < extra_count_.size(); ++c)
    count_[c] = static_cast<std::uint16_t>(count_[c] + (extra_count_[c] != 0));
}

template <bool parallel, class Emit>
void LayeredSort::release(mesh::Id cell, const ExtraEdges* extra, const Emit& emit) {
  if (tetrahedral_) {
    for (auto after = static_cast<unsigned>(after_[cell / 16] >> (4 * (cell % 16))) & 15U; after != 0;
         after &= after - 1) {
      const mesh::Id next = neighbour_[4 * std::size_t{cell} + static_cast<unsigned>(std::countr_zero(after))];
      if (decrement<parallel>(count_[next]) == 0) emit(next);
    }
  } else {
    forEachAfter(cell, [&](mesh::Id next) {
      if (decrement<parallel>(count_[next]) == 0) emit(next);
    });
  }
  if (extra == nullptr) return;
  for (const mesh::Id next : extra->after(cell)) {
    if (decrement<parallel>(extra_count_[next]) == 0 && decrement<parallel>(count_[next]) == 0) emit(next);
  }
}

void LayeredSort::serialLayer(std::size_t begin, std::size_t end, const ExtraEdges* extra, Order& order) {
  for (std::size_t i = begin; i < end; ++i) {
    if (i + ahead < order.cells.size()) prefetch(&neighbour_[mesh_.cell_face_offset[order.cells[i + ahead]]]);
    release<false>(order.cells[i], extra, [&](mesh::Id next) { order.cells.push_back(next); });
  }
}

void LayeredSort::parallelLayer(std::size_t begin, std::size_t end, const ExtraEdges* extra, Order& order) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 1024),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        if (i + ahead < end) prefetch(&neighbour_[mesh_.cell_face_offset[order.cells[i + ahead]]]);
                        release<true>(order.cells[i], extra, [&](mesh::Id next) {
                          std::atomic_ref<std::uint64_t>(marked_[next >> 6])
                              .fetch_or(std::uint64_t{1} << (next & 63U), std::memory_order_relaxed);
                        });
                      }
                    });
  appendMarked(order);
}

// Lists the marked cells by ascending id and clears the marks.
void LayeredSort::appendMarked(Order& order) {
  const std::size_t blocks = block_count_.size();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks, 8), [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      std::uint32_t marks = 0;
      const std::size_t last = std::min(marked_.size(), (b + 1) * block_words);
      for (std::size_t w = b * block_words; w < last; ++w)
        marks += static_cast<std::uint32_t>(std::popcount(marked_[w]));
      block_count_[b] = marks;
    }
  });
  std::size_t size = order.cells.size();
  for (auto& count : block_count_) {
    const std::uint32_t marks = count;
    count = static_cast<std::uint32_t>(size);
    size += marks;
  }
  order.cells.resize(size);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks, 8), [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      mesh::Id* out = order.cells.data() + block_count_[b];
      const std::size_t last = std::min(marked_.size(), (b + 1) * block_words);
      for (std::size_t w = b * block_words; w < last; ++w) {
        for (std::uint64_t bits = marked_[w]; bits != 0; bits &= bits - 1) {
          *out++ = static_cast<mesh::Id>(64 * w + static_cast<std::size_t>(std::countr_zero(bits)));
        }
        marked_[w] = 0;
      }
    }
  });
}

std::size_t LayeredSort::operator()(const FaceSigns& signs, Order& order, const ExtraEdges* extra) {
  if (extra != nullptr && extra->empty()) extra = nullptr;
  if (!tetrahedral_) std::fill(after_.begin(), after_.end(), 0);
  countEdges(signs, extra);
  order.cells.clear();
  order.cells.reserve(mesh_.cell_count());
  order.layer_offset.clear();
  order.layer_offset.push_back(0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, marked_.size(), 256),
                    [&](const tbb::blocked_range<std::size_t>& r) {
                      for (std::size_t w = r.begin(); w < r.end(); ++w) {
                        std::uint64_t bits = 0;
                        const std::size_t last = std::min<std::size_t>(64, mesh_.cell_count() - 64 * w);
                        for (std::size_t k = 0; k < last; ++k)
                          bits |= std::uint64_t{count_[64 * w + k] == 0} << k;
                        marked_[w] = bits;
                      }
                    });
  appendMarked(order);
  for (std::size_t begin = 0; begin < order.cells.size();) {
    const std::size_t end = order.cells.size();
    order.layer_offset.push_back(static_cast<std::uint32_t>(end));
    if (end - begin < large_layer) {
      serialLayer(begin, end, extra, order);
    } else {
      parallelLayer(begin, end, extra, order);
    }
    begin = end;
  }
  return order.cells.size();
}

std::size_t LayeredSort::bytes() const {
  return neighbour_.capacity() * sizeof(mesh::Id) + after_.capacity() * 8 + count_.capacity() * 2 +
         extra_count_.capacity() * 4 + marked_.capacity() * 8 + block_count_.capacity() * 4;
}

}  // namespace spillikin::sort
