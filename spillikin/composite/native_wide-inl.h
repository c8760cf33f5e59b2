// Highway's operations over two vectors at a time, each on both before the next. A fragment's arithmetic is one long
// chain of operations that wait for each other, and a core's scheduler reaches little farther than one such chain: it
// works on two vectors at once where their operations come in turn. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_WIDE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_WIDE_INL_H
#undef SPILLIKIN_NATIVE_WIDE_INL_H
#else
#define SPILLIKIN_NATIVE_WIDE_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, 16>;
using VF = hn::Vec<DF>;

// Two vectors, two masks, or two places in an array.
template <class T>
struct Two {
  T a, b;
};

// Operations on one vector or on two. An argument that is not two is the same for both.
namespace wide {

template <class T>
inline constexpr bool is_two = false;
template <class T>
inline constexpr bool is_two<Two<T>> = true;

template <class T>
HWY_INLINE auto firstOf(const T& v) {
  if constexpr (is_two<T>) {
    return v.a;
  } else {
    return v;
  }
}

template <class T>
HWY_INLINE auto secondOf(const T& v) {
  if constexpr (is_two<T>) {
    return v.b;
  } else {
    return v;
  }
}

template <class T>
HWY_INLINE Two<T> two(const T& a, const T& b) {
  return {a, b};
}

#define SPILLIKIN_LIFT(operation)                                              \
  template <class... A>                                                        \
  HWY_INLINE auto operation(const A&... a) {                                   \
    if constexpr ((is_two<A> || ...)) {                                        \
      return two(hn::operation(firstOf(a)...), hn::operation(secondOf(a)...)); \
    } else {                                                                   \
      return hn::operation(a...);                                              \
    }                                                                          \
  }
SPILLIKIN_LIFT(Abs)
SPILLIKIN_LIFT(Add)
SPILLIKIN_LIFT(And)
SPILLIKIN_LIFT(AndNot)
SPILLIKIN_LIFT(ApproximateReciprocal)
SPILLIKIN_LIFT(Clamp)
SPILLIKIN_LIFT(Div)
SPILLIKIN_LIFT(Eq)
SPILLIKIN_LIFT(Ge)
SPILLIKIN_LIFT(Gt)
SPILLIKIN_LIFT(IfThenElse)
SPILLIKIN_LIFT(IfThenElseZero)
SPILLIKIN_LIFT(IfThenZeroElse)
SPILLIKIN_LIFT(Le)
SPILLIKIN_LIFT(Lt)
SPILLIKIN_LIFT(Max)
SPILLIKIN_LIFT(Min)
SPILLIKIN_LIFT(Mul)
SPILLIKIN_LIFT(MulAdd)
SPILLIKIN_LIFT(Neg)
SPILLIKIN_LIFT(NegMulAdd)
SPILLIKIN_LIFT(Round)
SPILLIKIN_LIFT(Sqrt)
SPILLIKIN_LIFT(Sub)
#undef SPILLIKIN_LIFT

template <class M>
HWY_INLINE bool AllTrue(const M& m) {
  return hn::AllTrue(DF(), firstOf(m)) && hn::AllTrue(DF(), secondOf(m));
}

template <class M>
HWY_INLINE bool AllFalse(const M& m) {
  return hn::AllFalse(DF(), firstOf(m)) && hn::AllFalse(DF(), secondOf(m));
}

template <class M>
HWY_INLINE std::size_t CountTrue(const M& m) {
  if constexpr (is_two<M>) {
    return hn::CountTrue(DF(), m.a) + hn::CountTrue(DF(), m.b);
  } else {
    return hn::CountTrue(DF(), m);
  }
}

// The same vector for each.
template <class V>
HWY_INLINE V same(VF v) {
  if constexpr (is_two<V>) {
    return {v, v};
  } else {
    return v;
  }
}

// The vectors of an array that begin at `first`.
template <class At>
HWY_INLINE auto load(const float* values, const At& first) {
  if constexpr (is_two<At>) {
    return two(hn::Load(DF(), values + first.a), hn::Load(DF(), values + first.b));
  } else {
    return hn::Load(DF(), values + first);
  }
}

template <class V, class At>
HWY_INLINE void store(const V& v, float* values, const At& first) {
  if constexpr (is_two<At>) {
    hn::Store(v.a, DF(), values + first.a);
    hn::Store(v.b, DF(), values + first.b);
  } else {
    hn::Store(v, DF(), values + first);
  }
}

// Calls f with the places of vectors, two at a time and the last of an odd number alone: `pixel` is where each lies in
// the tile, and in their own array one begins every `step` floats.
template <class F>
HWY_INLINE void byTwos(const std::uint32_t* pixel, std::size_t count, std::size_t step, const F& f) {
  std::size_t k = 0;
  for (; k + 1 < count; k += 2)
    f(Two<std::size_t>{pixel[k], pixel[k + 1]}, Two<std::size_t>{k * step, (k + 1) * step});
  if (k < count) f(std::size_t{pixel[k]}, k * step);
}

}  // namespace wide

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
