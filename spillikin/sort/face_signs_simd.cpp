// The linear pass over the planes, for every SIMD target (Highway, chosen at run time).
#include <cstring>

#include "spillikin/sort/face_signs.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/sort/face_signs_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spillikin::sort {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 64>;

template <class M>
std::uint64_t maskBits(D d, M mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  std::uint64_t bits = 0;
  std::memcpy(&bits, bytes, sizeof(bits));
  return bits;
}

void SignWords(const float* x, const float* y, const float* z, const float* w, std::size_t words,
               const SignQuery& query, std::uint64_t* pos, std::uint64_t* neg, std::uint64_t* undecided) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const auto vx = hn::Set(d, query.x), vy = hn::Set(d, query.y), vz = hn::Set(d, query.z), vw = hn::Set(d, query.w);
  const auto ax = hn::Abs(vx), ay = hn::Abs(vy), az = hn::Abs(vz);
  const auto relative = hn::Set(d, query.relative), absolute = hn::Set(d, query.absolute);
  const auto zero = hn::Zero(d);
  for (std::size_t word = 0; word < words; ++word) {
    std::uint64_t p = 0, n = 0, sure = 0;
    for (std::size_t k = 0; k < 64; k += lanes) {
      const std::size_t i = 64 * word + k;
      const auto px = hn::LoadU(d, x + i), py = hn::LoadU(d, y + i), pz = hn::LoadU(d, z + i);
      auto value = hn::Mul(px, vx);
      value = hn::MulAdd(py, vy, value);
      value = hn::MulAdd(pz, vz, value);
      value = hn::MulAdd(hn::LoadU(d, w + i), vw, value);
      auto size = hn::Mul(hn::Abs(px), ax);
      size = hn::MulAdd(hn::Abs(py), ay, size);
      size = hn::MulAdd(hn::Abs(pz), az, size);
      const auto bound = hn::MulAdd(size, relative, absolute);
      // A plane that the floats cannot hold is NaN and falls through every comparison.
      p |= maskBits(d, hn::Gt(value, bound)) << k;
      n |= maskBits(d, hn::Lt(value, hn::Neg(bound))) << k;
      sure |= maskBits(d, hn::Eq(bound, zero)) << k;
    }
    pos[word] = p;
    neg[word] = n;
    undecided[word] = ~(p | n | sure);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::sort
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::sort {
HWY_EXPORT(SignWords);

void signWords(const float* x, const float* y, const float* z, const float* w, std::size_t words,
               const SignQuery& query, std::uint64_t* pos, std::uint64_t* neg, std::uint64_t* undecided) {
  HWY_DYNAMIC_DISPATCH(SignWords)(x, y, z, w, words, query, pos, neg, undecided);
}
}  // namespace spillikin::sort
#endif
