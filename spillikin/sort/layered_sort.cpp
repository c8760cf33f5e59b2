#include "spillikin/sort/layered_sort.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>

#include "spillikin/base/error.h"
#include "spillikin/sort/tetrahedron_states.h"

namespace spillikin::sort {
namespace {

using Range = tbb::blocked_range<std::size_t>;

// Layers of at least this many cells are worth counting down by atomic operations, which cost several times as much as
// plain ones, and a look at every mark. The same on any machine: the order must not depend on the number of threads.
constexpr std::size_t large_layer = 65536;
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
  tbb::parallel_for(Range(0, slots, 1 << 14), [&](const Range& range) {
    for (std::size_t k = range.begin(); k < range.end(); ++k)
      neighbour_[k] = mesh.neighbour(mesh.cell_face[k]);
  });
  if (tetrahedral_) {
    state_.resize(cells);
    return;
  }
  after_.resize((slots + 63) / 64 + 1);
  count_.resize(cells);
  for (std::size_t c = 0; c < cells; ++c) {
    if (mesh.cell_face_offset[c + 1] - mesh.cell_face_offset[c] >= std::numeric_limits<std::uint16_t>::max()) {
      throw Error(mesh.name + ": cell " + std::to_string(mesh.cell_file_id[c]) +
                  " has more than 65534 faces; cut it into smaller cells");
    }
  }
}

void LayeredSort::countTetrahedra(const FaceSigns& signs) {
  tbb::parallel_for(Range(0, mesh_.cell_count(), 1 << 13), [&](const Range& range) {
    tetrahedronStates(signs.interiorBits(), mesh_.cell_face.data(), range.begin(), range.end(), state_.data());
  });
}

void LayeredSort::countCells(const FaceSigns& signs) {
  const std::uint64_t* bits = signs.interiorBits();
  const auto triangle_bits = static_cast<mesh::Id>(2 * mesh_.triangle_count());
  const std::size_t shift = 2 * signs.quadShift();
  std::fill(after_.begin(), after_.end(), 0);
  tbb::parallel_for(Range(0, mesh_.cell_count(), 4096), [&](const Range& range) {
    std::uint64_t word = 0;
    // Words at the ends of a range are shared with the ranges beside it.
    const auto write = [&](std::size_t w) {
      std::atomic_ref<std::uint64_t>(after_[w]).fetch_or(word, std::memory_order_relaxed);
      word = 0;
    };
    std::size_t k = mesh_.cell_face_offset[range.begin()];
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      unsigned count = 0;
      for (const std::size_t end = mesh_.cell_face_offset[c + 1]; k < end; ++k) {
        const mesh::Id packed = mesh_.cell_face[k].packed;
        const std::size_t at = packed < triangle_bits ? packed : packed + shift;
        // Both bits of the face: this cell comes first, its neighbour does.
        const auto pair = static_cast<unsigned>(bits[at >> 6] >> (at & 62U)) & 3U;
        const unsigned side = at & 1U;
        count += (pair >> (side ^ 1U)) & 1U;
        word |= std::uint64_t{(pair >> side) & 1U} << (k & 63U);
        if ((k & 63U) == 63U) write(k >> 6);
      }
      count_[c] = static_cast<std::uint16_t>(count);
    }
    if ((k & 63U) != 0) write(k >> 6);
  });
}

void LayeredSort::countParted() {
  count_.resize(parted_->nodes());
  std::fill(count_.begin() + static_cast<std::ptrdiff_t>(mesh_.cell_count()), count_.end(), std::uint16_t{0});
  parted_->forEachEdge([&](mesh::Id to) { ++count_[to]; });
}

// Every part of a cell comes before all of another that lies before it across a gap.
void LayeredSort::countExtra(const ExtraEdges& extra) {
  extra_count_.assign(mesh_.cell_count(), 0);
  for (mesh::Id c = 0; c < mesh_.cell_count(); ++c) {
    const auto parts = static_cast<std::uint32_t>(1 + (parted_ == nullptr ? 0 : parted_->slivers(c).size()));
    for (const mesh::Id next : extra.after(c))
      extra_count_[next] += parts;
  }
  for (std::size_t c = 0; c < extra_count_.size(); ++c) {
    if (extra_count_[c] == 0) continue;
    if (tetrahedral_) {
      ++state_[c];
    } else {
      ++count_[c];
    }
  }
}

// Counts cell `cell` off what comes after it and emits those that nothing holds back any more.
template <bool tetrahedral, bool parallel, bool turns, class Emit>
void LayeredSort::release(mesh::Id cell, const Emit& emit) {
  const Turn turn = turns ? turn_[cell] : Turn{0};
  const auto passOn = [&](mesh::Id next) {
    if constexpr (turns && parallel) {
      raise(turn_[next], turn);
    } else if constexpr (turns) {
      turn_[next] = std::max(turn_[next], turn);
    }
  };
  const auto freed = [&](mesh::Id next) {
    if constexpr (tetrahedral) {
      return (decrement<parallel>(state_[next]) & state_count) == 0;
    } else {
      return decrement<parallel>(count_[next]) == 0;
    }
  };
  const auto count = [&](mesh::Id next) {
    passOn(next);
    if (freed(next)) emit(next);
  };
  if constexpr (tetrahedral) {
    for (unsigned after = state_[cell] >> 4U; after != 0; after &= after - 1)
      count(neighbour_[4 * std::size_t{cell} + static_cast<unsigned>(std::countr_zero(after))]);
  } else {
    forEachAfter(cell, count);
  }
  if (extra_ == nullptr) return;
  for (const mesh::Id next : extra_->after(this->cell(cell))) {
    passOn(next);
    if (decrement<parallel>(extra_count_[next]) == 0 && freed(next)) emit(next);
  }
}

template <bool tetrahedral>
void LayeredSort::prefetchRow(mesh::Id cell) const {
  if constexpr (tetrahedral) {
    __builtin_prefetch(&neighbour_[4 * std::size_t{cell}]);
  } else if (cell < mesh_.cell_count()) {
    __builtin_prefetch(&neighbour_[mesh_.cell_face_offset[cell]]);
  }
}

template <bool tetrahedral, bool turns>
void LayeredSort::serialLayer(std::size_t begin, std::size_t end, Order& order) {
  mesh::Id* const cells = order.cells.data();
  mesh::Id* back = cells + end;
  for (std::size_t i = begin; i < end; ++i) {
    if (cells + i + ahead < back) prefetchRow<tetrahedral>(cells[i + ahead]);
    release<tetrahedral, false, turns>(cells[i], [&](mesh::Id next) { *back++ = next; });
  }
  listed_ = static_cast<std::size_t>(back - cells);
}

template <bool tetrahedral, bool turns>
void LayeredSort::parallelLayer(std::size_t begin, std::size_t end, Order& order) {
  tbb::parallel_for(Range(begin, end, 2048), [&](const Range& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      if (i + ahead < end) prefetchRow<tetrahedral>(order.cells[i + ahead]);
      release<tetrahedral, true, turns>(order.cells[i], [&](mesh::Id next) {
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
  tbb::parallel_for(Range(0, blocks, 8), [&](const Range& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      std::uint32_t marks = 0;
      const std::size_t last = std::min(marked_.size(), (b + 1) * block_words);
      for (std::size_t w = b * block_words; w < last; ++w)
        if (marked_[w] != 0) marks += static_cast<std::uint32_t>(std::popcount(marked_[w]));
      block_count_[b] = marks;
    }
  });
  std::size_t size = listed_;
  for (auto& count : block_count_) {
    const std::uint32_t marks = count;
    count = static_cast<std::uint32_t>(size);
    size += marks;
  }
  listed_ = size;
  tbb::parallel_for(Range(0, blocks, 8), [&](const Range& range) {
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

void LayeredSort::firstLayer(Order& order) {
  tbb::parallel_for(Range(0, marked_.size(), 256), [&](const Range& range) {
    for (std::size_t w = range.begin(); w < range.end(); ++w) {
      std::uint64_t bits = 0;
      const std::size_t last = std::min<std::size_t>(64, nodes() - 64 * w);
      for (std::size_t k = 0; k < last; ++k) {
        bits |= std::uint64_t{left(static_cast<mesh::Id>(64 * w + k)) ? 0U : 1U} << k;
      }
      marked_[w] = bits;
    }
  });
  appendMarked(order);
}

template <bool tetrahedral, bool turns>
void LayeredSort::workOff(Order& order) {
  for (std::size_t begin = 0; begin < listed_;) {
    const std::size_t end = listed_;
    order.layer_offset.push_back(static_cast<std::uint32_t>(end));
    if (end - begin < large_layer) {
      serialLayer<tetrahedral, turns>(begin, end, order);
    } else {
      parallelLayer<tetrahedral, turns>(begin, end, order);
    }
    begin = end;
  }
}

bool LayeredSort::operator()(const FaceSigns& signs, Order& order, const ExtraEdges* extra, Turn* turn,
                             const PartedCells* parted) {
  extra_ = extra != nullptr && extra->empty() ? nullptr : extra;
  turn_ = turn;
  parted_ = parted != nullptr && parted->any() ? parted : nullptr;
  tetrahedral_ ? countTetrahedra(signs) : countCells(signs);
  if (parted_ != nullptr) countParted();
  if (extra_ != nullptr) countExtra(*extra_);
  marked_.resize((nodes() + 63) / 64);
  block_count_.resize((marked_.size() + block_words - 1) / block_words);
  order.cells.resize(nodes());
  listed_ = 0;
  order.layer_offset.clear();
  order.layer_offset.push_back(0);
  firstLayer(order);
  if (start_) start_();
  if (turn == nullptr) {
    tetrahedral_ ? workOff<true, false>(order) : workOff<false, false>(order);
  } else {
    tetrahedral_ ? workOff<true, true>(order) : workOff<false, true>(order);
  }
  order.cells.resize(listed_);
  return listed_ == nodes();
}

std::size_t LayeredSort::bytes() const {
  return neighbour_.capacity() * sizeof(mesh::Id) + state_.capacity() + after_.capacity() * 8 + count_.capacity() * 2 +
         extra_count_.capacity() * 4 + marked_.capacity() * 8 + block_count_.capacity() * 4;
}

}  // namespace spillikin::sort
