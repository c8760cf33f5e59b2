// Vectors of points in double precision, for the set-up of cells. Included once per instruction set.

#if defined(SPILLIKIN_NATIVE_VEC3D_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SPILLIKIN_NATIVE_VEC3D_INL_H
#undef SPILLIKIN_NATIVE_VEC3D_INL_H
#else
#define SPILLIKIN_NATIVE_VEC3D_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace spillikin::composite::native::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DD = hn::CappedTag<double, 8>;
using VD = hn::Vec<DD>;
using MD = hn::Mask<DD>;
using DH = hn::Rebind<float, DD>;  // as many floats as there are doubles
using DI = hn::Rebind<std::int32_t, DD>;

struct Vec3D {
  VD x, y, z;
};

HWY_INLINE Vec3D operator-(const Vec3D& a, const Vec3D& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

HWY_INLINE Vec3D cross(const Vec3D& a, const Vec3D& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}

HWY_INLINE VD dot(const Vec3D& a, const Vec3D& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

}  // namespace
}  // namespace spillikin::composite::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
