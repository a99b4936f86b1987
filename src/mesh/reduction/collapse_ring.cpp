// Compares rings before and after a collapse. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/reduction/collapse_ring.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "collapse_ring.h"
#include "lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A triangle is thin if its height is below this fraction of its longest edge. A collapse must not make it
// thinner by more than this factor: the points around a sample that equals the isovalue are so close to each
// other that merging any two changes the slivers beside them much, until these vanish too.
constexpr double kThin = 0.05;
constexpr double kMostThinning = 2;
constexpr double kMinCosine = 0.2;  // between the normals of a triangle before and after a collapse

// Normals as long as twice the area, and their sum.
struct Normals {
    HWY_INLINE Normals(const Ring& ring, const Vec3d& at) {
        const D d;
        for (std::size_t k = 0; k < ring.size; k += hn::Lanes(d)) {
            const Vectors<D> n = cross(load(ring.position, k) - everywhere(D(), at),
                                       load(ring.position, k + 1) - everywhere(D(), at));
            hn::Store(n.x, d, x + k);
            hn::Store(n.y, d, y + k);
            hn::Store(n.z, d, z + k);
        }
        for (std::size_t k = 0; k < ring.size; ++k) sum = sum + Vec3d{x[k], y[k], z[k]};
    }
    HWY_INLINE Vectors<D> from(std::size_t k) const {
        const D d;
        return {hn::Load(d, x + k), hn::Load(d, y + k), hn::Load(d, z + k)};
    }

    alignas(64) double x[Ring::kCapacity], y[Ring::kCapacity], z[Ring::kCapacity];
    Vec3d sum{};
};

// The longest edge of triangles with the edges u and w, and a third one whose squared length is `across`,
// to the fourth power.
HWY_INLINE V longest_edge(const Vectors<D>& u, const Vectors<D>& w, V across) {
    const V edge = hn::Max(hn::Max(dot(u, u), dot(w, w)), across);
    return hn::Mul(edge, edge);
}

// The normal of a thin triangle means little, so the sum of the ring's normals replaces it.
bool ring_keeps_shape(const Ring& ring, const Vec3d& here, const Vec3d& there) {
    const D d;
    const V zero = hn::Zero(d);
    const Normals normals(ring, here);
    for (std::size_t k = 0; k + 1 < ring.size; k += hn::Lanes(d)) {
        const Vectors<D> u = load(ring.position, k), w = load(ring.position, k + 1),
                         old_normal = normals.from(k);
        const Vectors<D> new_u = u - everywhere(D(), there), new_w = w - everywhere(D(), there);
        const Vectors<D> normal = cross(new_u, new_w);
        // Areas are squared and edges to the fourth power, so that their ratio compares with kThin squared.
        const V area = dot(normal, normal), old_area = dot(old_normal, old_normal);
        const V across = dot(w - u, w - u), edge = longest_edge(new_u, new_w, across),
                old_edge = longest_edge(u - everywhere(D(), here), w - everywhere(D(), here), across);
        const auto times = [&](double factor, V v) HWY_ATTR { return hn::Mul(hn::Set(d, factor), v); };
        const auto is_thin = hn::Not(hn::Gt(area, times(kThin * kThin, edge))),
                   was_thin = hn::Not(hn::Gt(old_area, times(kThin * kThin, old_edge)));
        const auto has_edge = hn::Gt(edge, zero);
        const auto is_thinner =
            hn::Or(hn::And(has_edge, hn::Lt(hn::Mul(times(kMostThinning * kMostThinning, area), old_edge),
                                            hn::Mul(old_area, edge))),
                   hn::AndNot(has_edge, hn::Gt(old_area, zero)));
        const Vectors<D> facing = choose(was_thin, everywhere(D(), normals.sum), old_normal);
        const V cosine = dot(facing, normal), sizes = hn::Mul(dot(facing, facing), area);
        const auto agrees = hn::And(hn::Gt(cosine, zero),
                                    hn::Gt(hn::Mul(cosine, cosine), times(kMinCosine * kMinCosine, sizes)));
        const auto flips = hn::AndNot(agrees, hn::Gt(sizes, zero));
        auto wrong = hn::And(hn::Or(flips, hn::And(is_thin, is_thinner)), hn::FirstN(d, ring.size - 1 - k));
        if (k == 0) wrong = hn::AndNot(hn::FirstN(d, 1), wrong);
        if (!hn::AllFalse(d, wrong)) return false;
    }
    return true;
}

std::size_t count_shared_points(const Ring& a, const Ring& b) {
    const hn::CappedTag<std::uint32_t, 8> d;
    auto shared = hn::Zero(d);
    for (std::size_t i = 0; i < a.size; i += hn::Lanes(d)) {
        const auto of_a = hn::LoadU(d, a.points + i);
        auto equal = hn::Zero(d);
        for (std::size_t k = 0; k < b.size; ++k)
            equal = hn::Add(equal, hn::IfThenElseZero(hn::Eq(of_a, hn::Set(d, b.points[k])), hn::Set(d, 1u)));
        shared = hn::Add(shared, hn::IfThenElseZero(hn::FirstN(d, a.size - i), equal));
    }
    return hn::GetLane(hn::SumOfLanes(d, shared));
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(ring_keeps_shape);
HWY_EXPORT(count_shared_points);

bool keeps_shape(const Ring& ring, const Vec3d& here, const Vec3d& there) {
    return HWY_DYNAMIC_DISPATCH(ring_keeps_shape)(ring, here, there);
}

std::size_t count_shared(const Ring& a, const Ring& b) {
    return HWY_DYNAMIC_DISPATCH(count_shared_points)(a, b);
}

}  // namespace marrow::internal
#endif
