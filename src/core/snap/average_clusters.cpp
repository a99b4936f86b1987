// Gathers the members of each cluster and averages them. Averaging uses vectors. Gathering is compiled per
// SIMD target because it counts bits: without the instruction POPCNT, snapping takes 3 % longer.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/snap/average_clusters.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "merge_clusters.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Returns the value if all bits of the mask are set, and 0 if none is. A branch would be unpredictable.
HWY_INLINE float masked(float value, std::uint32_t mask) {
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) & mask);
}

HWY_INLINE void gather_members_of(const SliceMerge& merge, std::size_t k) {
    Clusters& clusters = merge.clusters;
    Cluster& cluster = clusters.clusters[k];
    const DirectionBits& members = merge.slice.members[cluster.word];
    const std::uint32_t bit = cluster.bit;
    std::uint32_t representative = ~std::uint32_t{0}, count = 0, masks[3];
    for (std::uint32_t a = 0; a < 3; ++a) {
        const auto negative = static_cast<std::uint32_t>(members[2 * a + 1] >> bit & 1);
        const std::uint32_t direction = 2 * a + negative;
        const auto is_member = static_cast<std::uint32_t>(members[direction] >> bit & 1);
        const auto [edges, slice] = edges_in_direction(merge, cluster.word, direction);
        masks[a] = ~is_member + 1;
        const std::uint32_t point = point_index(edges, direction, bit) & masks[a];
        cluster.directions[a] = static_cast<std::uint8_t>(direction);
        clusters.offsets[a][k] = masked(slice.offsets[point], masks[a]);
        cluster.points[a] = slice.first_point + point;
        count += is_member;
        const std::uint32_t in_slice = a == 2 ? masks[a] & (negative - 1) : masks[a];
        representative = std::min(representative, cluster.points[a] | ~in_slice);
    }
    for (std::size_t a = 0; a < 3; ++a)
        cluster.points[a] = (cluster.points[a] & masks[a]) | (representative & ~masks[a]);
    cluster.representative = representative;
    clusters.weight[k] = count == 3 ? 1.0f / 3 : 1.0f / 2;
    cluster.merges = true;
}

void gather_members_target(const SliceMerge& merge, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) gather_members_of(merge, k);
}

// Two members are on perpendicular axes, so the sample is as far from their mean as they are. Therefore an
// axis without a member may count as a member at the sample.
void average_members_target(Clusters& clusters) {
    const hn::CappedTag<float, Clusters::kSlack> d;
    using V = hn::Vec<decltype(d)>;
    for (std::size_t k = 0; k < clusters.count; k += hn::Lanes(d)) {
        const V weight = hn::LoadU(d, clusters.weight.data() + k);
        V offset[3], centre[3], squares[3], furthest = hn::Zero(d);
        for (std::size_t a = 0; a < 3; ++a) {
            offset[a] = hn::LoadU(d, clusters.offsets[a].data() + k);
            centre[a] = hn::Mul(weight, offset[a]);
            squares[a] = hn::Mul(centre[a], centre[a]);
            hn::StoreU(centre[a], d, clusters.centre[a].data() + k);
        }
        const V squared = hn::Add(hn::Add(squares[0], squares[1]), squares[2]);
        for (std::size_t a = 0; a < 3; ++a) {
            const V along = hn::Sub(offset[a], centre[a]);
            furthest = hn::Max(furthest, hn::Add(hn::Sub(squared, squares[a]), hn::Mul(along, along)));
        }
        hn::StoreU(hn::Sqrt(furthest), d, clusters.radius.data() + k);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(gather_members_target);
HWY_EXPORT(average_members_target);

void gather_members(const SliceMerge& merge, std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(gather_members_target)(merge, begin, end);
}

void average_members(Clusters& clusters) {
    HWY_DYNAMIC_DISPATCH(average_members_target)(clusters);
}

}  // namespace marrow::internal
#endif
