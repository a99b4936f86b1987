// Looks at each fan along the mean of its normals. If each of its triangles shows its front, and they go
// around the point only once, then none hides another. Highway compiles this file once for each SIMD target.
//
// The coordinates are float values, so the float difference of two is as exact as a float can be.
// What follows has errors of some 1e-6 times the lengths of the edges. That is far below
// kLeastSine, the sine of the least angle at the point, as it is seen. Edges that could make a
// float overflow or underflow are left out.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/intersections/simple_fans.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <span>
#include <utility>

#include "simple_fans.h"

#include "base/parallel.h"
#include "mesh/geometry/load_points-inl.h"
#include "mesh/geometry/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr float kLeastSine = 2e-3f;
constexpr float kLeastLength = 1e-4f, kMostLength = 1e4f;
constexpr std::size_t kMostLanes = 8;

using D = hn::CappedTag<float, kMostLanes>;
using V = hn::Vec<D>;

// Tests as many fans at once as a vector has lanes. All have this number of triangles. `wanted` are places in
// the list of all such points of a chunk.
template <std::size_t kTriangles>
HWY_INLINE void test_fans(const MeshView& mesh, std::span<const std::uint32_t> listed,
                          const std::uint32_t* rings, std::span<const std::uint32_t> wanted,
                          std::uint8_t* simple) {
    const D d;
    const std::size_t lanes = hn::Lanes(d);
    const PointLoader loader(mesh.points);
    for (std::size_t first = 0; first < wanted.size(); first += lanes) {
        const std::size_t count = std::min(lanes, wanted.size() - first);
        // The last fan also fills the other lanes.
        const auto place = [&](std::size_t lane) { return wanted[first + std::min(lane, count - 1)]; };
        const auto point_of = [&](std::size_t lane) { return listed[place(lane)]; };
        V centre[3];
        loader.load(d, point_of, centre);
        Vectors<D> edges[kTriangles], normals[kTriangles];
        for (std::size_t n = 0; n < kTriangles; ++n) {
            V neighbour[3];
            loader.load(
                d, [&](std::size_t lane) { return rings[place(lane) * kTriangles + n]; }, neighbour);
            edges[n] = {hn::Sub(neighbour[0], centre[0]), hn::Sub(neighbour[1], centre[1]),
                        hn::Sub(neighbour[2], centre[2])};
        }
        Vectors<D> sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
        for (std::size_t n = 0; n < kTriangles; ++n) {
            const Vectors<D> normal = normals[n] = cross(edges[n], edges[(n + 1) % kTriangles]);
            sum = {hn::Add(sum.x, normal.x), hn::Add(sum.y, normal.y), hn::Add(sum.z, normal.z)};
        }
        const V factor = hn::Div(hn::Set(d, 1), hn::Sqrt(dot(sum, sum)));
        const Vectors<D> view{hn::Mul(factor, sum.x), hn::Mul(factor, sum.y), hn::Mul(factor, sum.z)};
        // An axis across the view. Edges rise above it once for each time that the fan goes around.
        const auto use_x = hn::Lt(hn::Abs(view.x), hn::Set(d, 0.8f));
        const V zero = hn::Zero(d);
        const Vectors<D> up{hn::IfThenElse(use_x, zero, hn::Neg(view.z)), hn::IfThenElse(use_x, view.z, zero),
                            hn::IfThenElse(use_x, hn::Neg(view.y), view.x)};
        V squares[kTriangles], heights[kTriangles];
        for (std::size_t n = 0; n < kTriangles; ++n) {
            squares[n] = dot(edges[n], edges[n]);
            heights[n] = dot(edges[n], up);
        }
        auto good = hn::Lt(zero, hn::Set(d, 1));
        V rises = zero;
        for (std::size_t n = 0; n < kTriangles; ++n) {
            const std::size_t next = (n + 1) % kTriangles;
            const V front = dot(normals[n], view), square = hn::Mul(squares[n], squares[next]);
            good = hn::And(good, hn::And(hn::Gt(front, zero),
                                         hn::Gt(hn::Mul(front, front),
                                                hn::Mul(hn::Set(d, kLeastSine * kLeastSine), square))));
            good = hn::And(good, hn::And(hn::Ge(squares[n], hn::Set(d, kLeastLength * kLeastLength)),
                                         hn::Le(squares[n], hn::Set(d, kMostLength * kMostLength))));
            const auto rise = hn::And(hn::Lt(heights[n], zero), hn::Ge(heights[next], zero));
            rises = hn::Add(rises, hn::IfThenElseZero(rise, hn::Set(d, 1)));
        }
        good = hn::And(good, hn::Eq(rises, hn::Set(d, 1)));
        alignas(64) float is_good[kMostLanes];
        hn::Store(hn::IfThenElseZero(good, hn::Set(d, 1)), d, is_good);
        for (std::size_t lane = 0; lane < count; ++lane) simple[point_of(lane)] = is_good[lane] > 0;
    }
}

// Tests the points of a list whose entry in `simple` is 1.
template <std::size_t kTriangles>
HWY_INLINE void test_wanted(const MeshView& mesh, const OneRings& rings, std::size_t chunk,
                            std::uint8_t* simple) {
    const std::span<const std::uint32_t> listed = rings.listed(chunk, kTriangles);
    if (listed.empty()) return;
    std::uint32_t wanted[OneRings::kChunk];
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < listed.size(); ++i) {
        wanted[count] = i;
        count += simple[listed[i]];
    }
    test_fans<kTriangles>(mesh, listed, rings.of(listed[0]).data(), {wanted, count}, simple);
}

template <std::size_t... kTriangles>
HWY_INLINE void test_all(const MeshView& mesh, const OneRings& rings, std::size_t chunk, std::uint8_t* simple,
                         std::index_sequence<kTriangles...>) {
    (test_wanted<kTriangles + 3>(mesh, rings, chunk, simple), ...);
    // Others are not simple.
    for (std::size_t n = 0; n < 3; ++n) {
        for (const std::uint32_t p : rings.listed(chunk, n)) simple[p] = 0;
    }
}

void test_chunk(const MeshView& mesh, const OneRings& rings, std::size_t chunk, std::uint8_t* simple) {
    test_all(mesh, rings, chunk, simple, std::make_index_sequence<OneRings::kMostInFan - 2>());
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(test_chunk);

Buffer<std::uint8_t> find_simple_fans(const MeshView& mesh, const OneRings& rings) {
    Buffer<std::uint8_t> simple(rings.size());
    std::fill(simple.begin(), simple.end(), std::uint8_t{0});
    parallel_for_ranges(std::size_t{0}, mesh.triangles.size(), 4096, [&](const auto& range) {
        for (std::size_t t = range.begin(); t < range.end(); ++t) {
            for (const std::uint32_t p : mesh.triangles[t])
                std::atomic_ref(simple[p]).store(1, std::memory_order_relaxed);
        }
    });
    parallel_for(std::size_t{0}, rings.chunks(), [&](std::size_t chunk) {
        HWY_DYNAMIC_DISPATCH(test_chunk)(mesh, rings, chunk, simple.data());
    });
    return simple;
}

}  // namespace marrow::internal
#endif
