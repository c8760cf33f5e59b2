// The linear passes over cells and faces, for every SIMD target (Highway, chosen at run time).
#include <algorithm>
#include <bit>
#include <cstring>

#include "spillikin/sort/lifted_distance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/sort/lifted_distance_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spillikin::sort {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using I = hn::RebindToSigned<D>;

// See KeyQuery. The keys beyond 1 are never closer than those within.
template <unsigned bits, class V>
hn::Vec<I> Keys(D d, V number) {
  constexpr KeyQuery query{0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F, bits};
  const I i;
  const auto one = hn::Set(d, 1.0F);
  const auto size = hn::Abs(number);
  const auto even = hn::ConvertTo(i, hn::Mul(hn::Min(size, one), hn::Set(d, static_cast<float>(query.even()))));
  const auto beyond = hn::ShiftRight<query.shift()>(hn::Sub(hn::BitCast(i, hn::Max(size, one)), hn::BitCast(i, one)));
  const auto half = hn::Min(hn::Add(even, beyond), hn::Set(i, query.half() - 1));
  const auto sign = hn::BroadcastSignBit(hn::BitCast(i, number));
  return hn::Add(hn::Set(i, query.half()), hn::Sub(hn::Xor(half, sign), sign));
}

template <unsigned bits>
void LiftedKeysOf(const float* x, const float* y, const float* z, const float* w, std::size_t count,
                  const KeyQuery& query, std::uint32_t* keys) {
  const D d;
  const hn::RebindToUnsigned<D> u;
  const std::size_t lanes = hn::Lanes(d);
  const auto vx = hn::Set(d, query.x), vy = hn::Set(d, query.y), vz = hn::Set(d, query.z), vw = hn::Set(d, query.w);
  const auto middle = hn::Set(d, query.middle), scale = hn::Set(d, query.scale);
  const auto at = [&](std::size_t k) {
    auto value = hn::Mul(hn::LoadU(d, x + k), vx);
    value = hn::MulAdd(hn::LoadU(d, y + k), vy, value);
    value = hn::MulAdd(hn::LoadU(d, z + k), vz, value);
    value = hn::MulAdd(hn::LoadU(d, w + k), vw, value);
    return hn::BitCast(u, Keys<bits>(d, hn::Mul(hn::Sub(value, middle), scale)));
  };
  std::size_t k = 0;
  for (; k + lanes <= count; k += lanes)
    hn::StoreU(at(k), u, keys + k);
  if (k < count) {  // the arrays are padded, the keys are not
    HWY_ALIGN std::uint32_t last[hn::MaxLanes(u)];
    hn::Store(at(k), u, last);
    std::memcpy(keys + k, last, (count - k) * sizeof(*keys));
  }
}

void LiftedKeys(const float* x, const float* y, const float* z, const float* w, std::size_t count,
                const KeyQuery& query, std::uint32_t* keys) {
  if (query.bits == 20)
    LiftedKeysOf<20>(x, y, z, w, count, query, keys);
  else
    LiftedKeysOf<22>(x, y, z, w, count, query, keys);
}

std::size_t CloseFaces(const std::uint32_t (*cells)[2], std::size_t begin, std::size_t end, const std::uint32_t* keys,
                       std::uint32_t least, std::vector<mesh::Id>& close) {
  const hn::ScalableTag<std::int32_t> d;
  const hn::RebindToUnsigned<decltype(d)> u;
  const std::size_t lanes = hn::Lanes(d);
  const auto* base = reinterpret_cast<const std::int32_t*>(keys);
  const auto bound = hn::Set(d, static_cast<std::int32_t>(least));
  std::size_t f = begin;
  for (; f + lanes <= end; f += lanes) {
    hn::Vec<decltype(u)> a, b;
    hn::LoadInterleaved2(u, &cells[f][0], a, b);
    const auto gap =
        hn::Abs(hn::Sub(hn::GatherIndex(d, base, hn::BitCast(d, a)), hn::GatherIndex(d, base, hn::BitCast(d, b))));
    const auto mask = hn::Lt(gap, bound);
    if (hn::AllFalse(d, mask)) continue;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    std::uint64_t bits = 0;
    std::memcpy(&bits, bytes, sizeof(bits));
    for (; bits != 0; bits &= bits - 1)
      close.push_back(static_cast<mesh::Id>(f + static_cast<std::size_t>(std::countr_zero(bits))));
  }
  return f;
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::sort
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::sort {
HWY_EXPORT(LiftedKeys);
HWY_EXPORT(CloseFaces);

void liftedKeys(const float* x, const float* y, const float* z, const float* w, std::size_t count,
                const KeyQuery& query, std::uint32_t* keys) {
  HWY_DYNAMIC_DISPATCH(LiftedKeys)(x, y, z, w, count, query, keys);
}

void closeFaces(const std::uint32_t (*cells)[2], std::size_t begin, std::size_t end, const std::uint32_t* keys,
                std::uint32_t least, std::vector<mesh::Id>& close) {
  std::size_t f = HWY_DYNAMIC_DISPATCH(CloseFaces)(cells, begin, end, keys, least, close);
  for (; f < end; ++f) {
    if (cells[f][1] == mesh::none) continue;
    const std::uint32_t a = keys[cells[f][0]], b = keys[cells[f][1]];
    if ((a > b ? a - b : b - a) < least) close.push_back(static_cast<mesh::Id>(f));
  }
}
}  // namespace spillikin::sort
#endif
