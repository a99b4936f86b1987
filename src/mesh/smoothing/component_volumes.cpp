// Adds up the volumes between triangles and a plane, several triangles at once. Highway compiles this
// file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/smoothing/component_volumes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>

#include "component_volumes.h"

#include "base/parallel.h"
#include "mesh/geometry/load_points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Returns six times the volume between triangles and the plane at this height, if the z axis points up.
double volume_above(std::span<const Vec3f> points, std::span<const Triangle> triangles, float height) {
    constexpr std::size_t kMostLanes = 16;
    const hn::CappedTag<float, kMostLanes> d;
    const PointLoader loader(points);
    const auto plane = hn::Set(d, height);
    double sum = 0;
    for (std::size_t first = 0; first < triangles.size(); first += hn::Lanes(d)) {
        const std::size_t count = std::min(hn::Lanes(d), triangles.size() - first);
        hn::Vec<decltype(d)> a[3], b[3], c[3];
        const auto load = [&](std::size_t corner, auto& xyz) HWY_ATTR {
            loader.load(
                d, [&](std::size_t lane) { return triangles[first + std::min(lane, count - 1)][corner]; },
                xyz);
        };
        load(0, a);
        load(1, b);
        load(2, c);
        const auto twice_area = hn::Sub(hn::Mul(hn::Sub(b[0], a[0]), hn::Sub(c[1], a[1])),
                                        hn::Mul(hn::Sub(b[1], a[1]), hn::Sub(c[0], a[0])));
        const auto thrice_height =
            hn::Add(hn::Add(hn::Sub(a[2], plane), hn::Sub(b[2], plane)), hn::Sub(c[2], plane));
        HWY_ALIGN float areas[kMostLanes], heights[kMostLanes];
        hn::Store(twice_area, d, areas);
        hn::Store(thrice_height, d, heights);
        // One after another, so that the sum does not depend on the number of lanes; in
        // double, which does not overflow.
        for (std::size_t lane = 0; lane < count; ++lane) sum += double{areas[lane]} * double{heights[lane]};
    }
    return sum;
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(volume_above);

// Above the lowest point of each component, because distant coordinates would cancel.
std::vector<ComponentVolumes> component_volumes(const MeshView& before, std::span<const Vec3f> after,
                                                const std::vector<std::uint32_t>& lowest) {
    constexpr std::size_t kSection = 8192;  // triangles; the sums do not depend on the threads
    const std::span<const Triangle> triangles = before.triangles;
    std::vector<std::vector<ComponentVolumes>> sections((triangles.size() + kSection - 1) / kSection);
    parallel_for(std::size_t{0}, sections.size(), [&](std::size_t s) {
        const std::size_t end = std::min((s + 1) * kSection, triangles.size());
        for (std::size_t i = s * kSection; i < end;) {
            // The triangles of a component that follow each other.
            const std::size_t begin = i;
            const std::uint32_t own = lowest[triangles[i][0]];
            while (i < end && lowest[triangles[i][0]] == own) ++i;
            const auto volume = [&](std::span<const Vec3f> points) {
                return HWY_DYNAMIC_DISPATCH(volume_above)(points, triangles.subspan(begin, i - begin),
                                                          points[own][2]) /
                       6;
            };
            sections[s].push_back({own, volume(before.points), volume(after)});
        }
    });
    std::vector<ComponentVolumes> parts, sums;
    for (const std::vector<ComponentVolumes>& section : sections)
        parts.insert(parts.end(), section.begin(), section.end());
    std::stable_sort(parts.begin(), parts.end(), [](const ComponentVolumes& a, const ComponentVolumes& b) {
        return a.lowest < b.lowest;
    });
    for (const ComponentVolumes& part : parts) {
        if (sums.empty() || sums.back().lowest != part.lowest) sums.push_back({part.lowest});
        sums.back().before += part.before;
        sums.back().after += part.after;
    }
    return sums;
}

}  // namespace marrow::internal
#endif
