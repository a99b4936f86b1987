// Vectors in space, one in each lane. Each SIMD target includes this file once.
#if defined(MARROW_REDUCTION_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_REDUCTION_VECTORS_INL_H
#undef MARROW_REDUCTION_VECTORS_INL_H
#else
#define MARROW_REDUCTION_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include <marrow/vector.h>

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The lanes of up to eight edges or triangles; results do not depend on how many there are.
using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;

struct Vectors {
    V x, y, z;
};
HWY_INLINE Vectors operator+(const Vectors& a, const Vectors& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE Vectors operator-(const Vectors& a, const Vectors& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vectors operator*(V s, const Vectors& a) {
    return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)};
}
HWY_INLINE V dot(const Vectors& a, const Vectors& b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vectors cross(const Vectors& a, const Vectors& b) {
    return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
            hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
template <class Mask>
HWY_INLINE Vectors choose(Mask mask, const Vectors& yes, const Vectors& no) {
    return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
            hn::IfThenElse(mask, yes.z, no.z)};
}
HWY_INLINE Vectors everywhere(const Vec3d& v) {
    const D d;
    return {hn::Set(d, v[0]), hn::Set(d, v[1]), hn::Set(d, v[2])};
}

HWY_INLINE V load(const float* from) {
    return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), from));
}
template <std::size_t kCount>
HWY_INLINE Vectors load(const float (&from)[3][kCount], std::size_t first) {
    return {load(from[0] + first), load(from[1] + first), load(from[2] + first)};
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
