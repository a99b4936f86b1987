// The lanes in which collapses are looked at. Each SIMD target includes this file once.
#if defined(MARROW_REDUCTION_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_REDUCTION_LANES_INL_H
#undef MARROW_REDUCTION_LANES_INL_H
#else
#define MARROW_REDUCTION_LANES_INL_H
#endif

#include <hwy/highway.h>

#include "mesh/geometry/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The lanes of up to eight edges or triangles; results do not depend on how many there are.
using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;

HWY_INLINE V load(const float* from) {
    return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), from));
}
template <std::size_t kCount>
HWY_INLINE Vectors<D> load(const float (&from)[3][kCount], std::size_t first) {
    return {load(from[0] + first), load(from[1] + first), load(from[2] + first)};
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
