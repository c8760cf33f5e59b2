// Tiny cells: of the series about a small cell's middle (native_small-inl.h), the first terms. With n and f the
// nearness of a fragment's ends, the scalar half way is linear in n, f and the pixel, and the depth is (n - f) times
// what is linear in n and f. The square of n - f that the scalar's shift takes is a line there, too: over [0, E] it is
// E (n - f) - E^2 / 8 but for E^2 / 8. Of what squares add to a depth, E (n - f) alone is left, which is right for the
// fragments that go all the way through a cell and, on the average, for those that go half of it. Included once per
// instruction set.

#if defined(SPILLIKIN_NATIVE_TINY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_TINY_INL_H
#undef SPILLIKIN_NATIVE_TINY_INL_H
#else
#define SPILLIKIN_NATIVE_TINY_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <type_traits>

#include "spillikin/composite/native_batch.h"
#include "spillikin/composite/native_certificate-inl.h"
#include "spillikin/composite/native_fit-inl.h"
#include "spillikin/composite/native_kernel.h"
#include "spillikin/composite/native_small-inl.h"

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// What the first terms may leave out of a colour, with what the small cells' series do: a fifth of a display step.
constexpr float tiny_left_out = 8e-4F;
// A cell's depth as a share of its distance, at most: of depths, part of its square is left out.
constexpr float tiny_relative_depth = 0.02F;

// Cells that are tiny, and what is left out of a colour there.
struct Tininess {
  hn::Mask<DF> tiny;
  VF left_out;
};

// Sets what TinyShading takes of the cells from i on, after setColors(). For cells that are not tiny the numbers mean
// nothing.
HWY_INLINE Tininess setTiny(const Looks& looks, const Smallness& small, const Middle& middle, std::size_t i,
                            CellBatch& batch) {
  const DF d;
  const auto set = [](float v) HWY_ATTR { return hn::Set(DF(), v); };
  const auto load = [&](const float* values) HWY_ATTR { return hn::Load(d, values + i); };
  const VF amid = load(batch.amid), nearness = load(batch.middle_nearness);
  const VF twice = hn::Add(nearness, nearness);
  const VF relative = hn::Mul(small.relative, small.relative);
  // As in setSmall(), with the scalar's change with depth as it is amid the range.
  VF steep = hn::Neg(load(batch.apex)), turn = set(-0.5F), per_nearness = set(1.0F), per_sum = hn::Zero(d);
  VF depth = per_nearness, gain = hn::Zero(d);
  if (!batch.parallel) {
    steep = hn::Sub(amid, load(batch.apex));
    turn = hn::Mul(set(-0.5F), middle.depth);
    per_nearness = hn::Mul(middle.depth, middle.depth);
    per_sum = hn::Neg(hn::Mul(per_nearness, middle.depth));
    depth = hn::NegMulAdd(twice, per_sum, per_nearness);
    gain = hn::Mul(hn::Mul(set(-0.25F), small.relative), per_sum);
  }
  const VF longest = hn::Div(load(batch.chord), per_nearness);
  const VF shift = hn::Mul(small.shift, longest);
  const VF bowed = hn::Mul(hn::Mul(shift, longest), set(0.125F));
  const VF turned = hn::Mul(hn::Mul(steep, relative), set(0.125F));
  const VF along = hn::Mul(steep, turn);
  hn::Store(hn::Add(along, shift), d, batch.per_near + i);
  hn::Store(hn::Sub(along, shift), d, batch.per_far + i);
  // Half of what the square of s moves the scalar by goes to all.
  const VF at = hn::Sub(load(batch.at[2]), amid);
  hn::Store(hn::NegMulAdd(along, twice, hn::Add(at, hn::Sub(turned, bowed))), d, batch.tiny_origin + i);
  hn::Store(depth, d, batch.tiny_depth[0] + i);
  hn::Store(hn::Add(per_sum, gain), d, batch.tiny_depth[1] + i);
  hn::Store(hn::Sub(per_sum, gain), d, batch.tiny_depth[2] + i);
  hn::Store(hn::Mul(hn::Abs(steep), hn::Mul(load(batch.half_per_middle), per_nearness)), d, batch.half_change + i);
  // The other half, and how far the change with depth may be from that amid the range.
  const VF unsteady = hn::Mul(hn::Mul(looks.range, small.relative), set(0.25F));
  const VF mean = hn::MulAdd(hn::Abs(turned), set(3.0F), unsteady);
  const VF of_colors = hn::MulAdd(looks.steepest, hn::Add(mean, hn::Abs(bowed)), small.left_out);
  // Extinction is taken at the colours' scalar, all of its shift included.
  const VF of_depths = hn::Mul(hn::Abs(small.extinction_slope), hn::MulAdd(hn::Abs(bowed), set(8.0F), mean));
  const VF left_out = hn::MulAdd(of_depths, set(opacity_of_depth), of_colors);
  const auto little = hn::And(hn::Le(left_out, set(tiny_left_out)), hn::Le(small.relative, set(tiny_relative_depth)));
  return {hn::And(small.thin, little), left_out};
}

// How a tiny cell's colours run over its range.
enum class Run { line, parabola, bend };

// Blends the fragments of a tiny cell.
template <Run run>
class TinyShading : public SmallCheck {
 public:
  static constexpr bool short_chain = true;
  HWY_INLINE TinyShading(const TileView& view, const CellBatch& batch, std::size_t i)
      : SmallCheck(batch, i), colors_(view, batch, i) {
    const auto set = [](float v) HWY_ATTR { return hn::Set(DF(), v); };
    near_ = set(batch.per_near[i]);
    far_ = set(batch.per_far[i]);
    depth_ = set(batch.tiny_depth[0][i]);
    depth_near_ = set(batch.tiny_depth[1][i]);
    depth_far_ = set(batch.tiny_depth[2][i]);
    change_ = set(batch.half_change[i] * (run == Run::parabola ? third_per_half : 1.0F));
  }

  template <class V, class M, class At>
  HWY_INLINE void blend(const Crossed<V>& ray, const M& inside, const At& first, Pixels& pixels) const {
    const V &near = ray.near, &far = ray.far, &at = ray.at;
    const V extent = wide::Sub(near, far);
    const V value = wide::MulAdd(near_, near, wide::MulAdd(far_, far, at));
    const V per = wide::MulAdd(depth_near_, near, wide::MulAdd(depth_far_, far, depth_));
    const V in_world = wide::Mul(wide::Mul(extent, wide::load(pixels.length.data(), first)), per);
    const V depth = wide::IfThenElseZero(inside, wide::Mul(in_world, colors_.extinction(value)));
    const V a = fade(depth, first, pixels);
    const V change = wide::Mul(extent, change_);
    Light<V> light(pixels, first);
    light.add(colors_.tint(value, change, inside), a, inside);
    light.store(first, pixels);
  }

 private:
  SmallColors<run == Run::bend ? 1 : 0, run == Run::parabola> colors_;
  VF near_, far_, depth_, depth_near_, depth_far_, change_;
};

// Calls f with what shades small and tiny cells of a kind: up to Kind::small_bends4.
template <bool Parallel, class F>
HWY_INLINE auto withSmallShading(Kind kind, const F& f) {
  switch (kind) {
    case Kind::tiny:
      return f(std::type_identity<TinyShading<Run::line>>());
    case Kind::tiny_curved:
      return f(std::type_identity<TinyShading<Run::parabola>>());
    case Kind::tiny_bend:
      return f(std::type_identity<TinyShading<Run::bend>>());
    case Kind::small_curved:
      return f(std::type_identity<SmallShading<Parallel, 0, true>>());
    case Kind::small:
      return f(std::type_identity<SmallShading<Parallel, 0>>());
    case Kind::small_bends1:
      return f(std::type_identity<SmallShading<Parallel, 1>>());
    case Kind::small_bends2:
      return f(std::type_identity<SmallShading<Parallel, 2>>());
    case Kind::small_bends3:
      return f(std::type_identity<SmallShading<Parallel, 3>>());
    default:
      return f(std::type_identity<SmallShading<Parallel, 4>>());
  }
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
