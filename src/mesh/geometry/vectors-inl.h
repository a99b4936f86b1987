// Vectors in space, one in each lane. Each SIMD target includes this file once.
#if defined(MARROW_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_VECTORS_INL_H
#undef MARROW_VECTORS_INL_H
#else
#define MARROW_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include <marrow/vector.h>

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct Vectors {
    hn::Vec<D> x, y, z;
};

template <class D>
HWY_INLINE Vectors<D> operator+(const Vectors<D>& a, const Vectors<D>& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
template <class D>
HWY_INLINE Vectors<D> operator-(const Vectors<D>& a, const Vectors<D>& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
template <class D>
HWY_INLINE Vectors<D> operator*(hn::Vec<D> factor, const Vectors<D>& a) {
    return {hn::Mul(factor, a.x), hn::Mul(factor, a.y), hn::Mul(factor, a.z)};
}
template <class D>
HWY_INLINE hn::Vec<D> dot(const Vectors<D>& a, const Vectors<D>& b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
template <class D>
HWY_INLINE Vectors<D> cross(const Vectors<D>& a, const Vectors<D>& b) {
    return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
            hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
template <class D>
HWY_INLINE Vectors<D> choose(hn::Mask<D> which, const Vectors<D>& yes, const Vectors<D>& no) {
    return {hn::IfThenElse(which, yes.x, no.x), hn::IfThenElse(which, yes.y, no.y),
            hn::IfThenElse(which, yes.z, no.z)};
}

// The same vector in each lane, of doubles.
template <class D>
HWY_INLINE Vectors<D> everywhere(D d, const Vec3d& v) {
    return {hn::Set(d, v[0]), hn::Set(d, v[1]), hn::Set(d, v[2])};
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
