#include "spillikin/sort/tetrahedron_states.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/sort/tetrahedron_states_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spillikin::sort {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Two bits a face, one for each side: the cell on it comes first. A use of a face is its number and the cell's side.
void States(const std::uint64_t* bits, const mesh::FaceUse* uses, std::size_t first, std::size_t last,
            std::uint8_t* state) {
  const hn::CappedTag<std::uint32_t, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const std::size_t lanes = hn::Lanes(d);
  static_assert(sizeof(mesh::FaceUse) == sizeof(std::uint32_t));
  static_assert(state_first_after == 1U << 4U && state_count == 15U);
  const auto* packed = reinterpret_cast<const std::uint32_t*>(uses);
  const auto* words = reinterpret_cast<const std::int32_t*>(bits);  // of little ends, as all targets here are
  const auto one = hn::Set(d, 1);
  std::size_t c = first;
  for (; c + lanes <= last; c += lanes) {
    hn::Vec<decltype(d)> use[4];
    hn::LoadInterleaved4(d, packed + 4 * c, use[0], use[1], use[2], use[3]);
    auto sum = hn::Zero(d);
    for (unsigned k = 0; k < 4; ++k) {
      const auto word = hn::BitCast(d, hn::GatherIndex(di, words, hn::BitCast(di, hn::ShiftRight<5>(use[k]))));
      const auto at = hn::And(use[k], hn::Set(d, 31));
      const auto mine = hn::And(hn::Shr(word, at), one);
      const auto other = hn::And(hn::Shr(word, hn::Xor(at, one)), one);
      sum = hn::Add(sum, hn::Add(hn::Shl(mine, hn::Set(d, 4 + k)), other));
    }
    hn::StoreU(hn::DemoteTo(d8, hn::BitCast(di, sum)), d8, state + c);
  }
  for (; c < last; ++c) {
    unsigned sum = 0;
    for (unsigned k = 0; k < 4; ++k) {
      const std::uint32_t at = packed[4 * c + k];
      const auto pair = static_cast<unsigned>(bits[at >> 6] >> (at & 62U)) & 3U;
      const unsigned side = at & 1U;
      sum += (pair >> side & 1U) << (4 + k);
      sum += pair >> (side ^ 1U) & 1U;
    }
    state[c] = static_cast<std::uint8_t>(sum);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::sort
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::sort {
HWY_EXPORT(States);

void tetrahedronStates(const std::uint64_t* bits, const mesh::FaceUse* uses, std::size_t first, std::size_t last,
                       std::uint8_t* state) {
  HWY_DYNAMIC_DISPATCH(States)(bits, uses, first, last, state);
}
}  // namespace spillikin::sort
#endif
