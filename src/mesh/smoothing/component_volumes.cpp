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

constexpr std::size_t kMostLanes = 16;
using D = hn::CappedTag<float, kMostLanes>;

// Adds up six times the volume between triangles and the plane at a height, if the z axis points up.
class VolumeAbove {
  public:
    VolumeAbove(std::span<const Vec3f> points, float height) : loader_(points), height_(height) {}

    // Adds the first `count` of the triangles in all lanes.
    HWY_INLINE void add(const Triangle* triangles, std::size_t count) {
        const D d;
        hn::Vec<D> a[3], b[3], c[3];
        load(triangles, 0, a);
        load(triangles, 1, b);
        load(triangles, 2, c);
        const auto twice_area = hn::Sub(hn::Mul(hn::Sub(b[0], a[0]), hn::Sub(c[1], a[1])),
                                        hn::Mul(hn::Sub(b[1], a[1]), hn::Sub(c[0], a[0])));
        const auto plane = hn::Set(d, height_);
        const auto thrice_height =
            hn::Add(hn::Add(hn::Sub(a[2], plane), hn::Sub(b[2], plane)), hn::Sub(c[2], plane));
        HWY_ALIGN float areas[kMostLanes], heights[kMostLanes];
        hn::Store(twice_area, d, areas);
        hn::Store(thrice_height, d, heights);
        // One after another, so that the sum does not depend on the number of lanes; in
        // double, which does not overflow.
        for (std::size_t lane = 0; lane < count; ++lane) sum_ += double{areas[lane]} * double{heights[lane]};
    }
    double sum() const { return sum_; }

  private:
    HWY_INLINE void load(const Triangle* triangles, std::size_t corner, hn::Vec<D> (&xyz)[3]) const {
        loader_.load(
            D(), [&](std::size_t lane) HWY_ATTR { return triangles[lane][corner]; }, xyz);
    }

    const PointLoader loader_;
    const float height_;
    double sum_ = 0;
};

// Adds the volumes between triangles and the plane through a point, before and after points moved.
// Both together, as each sum waits for itself.
void add_volumes(std::span<const Vec3f> before, std::span<const Vec3f> after,
                 std::span<const Triangle> triangles, ComponentVolumes& volumes) {
    VolumeAbove above_before(before, before[volumes.lowest][2]), above_after(after, after[volumes.lowest][2]);
    for (std::size_t first = 0; first < triangles.size(); first += hn::Lanes(D())) {
        const std::size_t count = std::min(hn::Lanes(D()), triangles.size() - first);
        Triangle padded[kMostLanes];
        const Triangle* const group = in_all_lanes(&triangles[first], count, hn::Lanes(D()), padded);
        above_before.add(group, count);
        above_after.add(group, count);
    }
    volumes.before += above_before.sum() / 6;
    volumes.after += above_after.sum() / 6;
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(add_volumes);

// Above the lowest point of each component, because distant coordinates would cancel.
std::vector<ComponentVolumes> component_volumes(const MeshView& before, std::span<const Vec3f> after,
                                                const Buffer<std::uint32_t>& lowest) {
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
            ComponentVolumes& volumes = sections[s].emplace_back(ComponentVolumes{own});
            HWY_DYNAMIC_DISPATCH(add_volumes)
            (before.points, after, triangles.subspan(begin, i - begin), volumes);
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
