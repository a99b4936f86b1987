// Decides which clusters merge, and displaces other near points: rules 4 and 5 of docs/algorithm.md.
#include <cmath>

#include "merge_clusters.h"

namespace marrow::internal {

namespace {

// Returns the samples that conflict with the sample before them along an axis: on both other axes, the
// members of the two are in opposite directions, and no member is on the edge between them.
inline std::uint64_t conflicting(std::size_t axis, const DirectionBits& before, const DirectionBits& here) {
    const std::size_t b = 2 * ((axis + 1) % 3), c = 2 * ((axis + 2) % 3);
    return ((here[b] & before[b + 1]) | (here[b + 1] & before[b])) &
           ((here[c] & before[c + 1]) | (here[c + 1] & before[c])) & ~(before[2 * axis] | here[2 * axis + 1]);
}

// Returns the samples of a word that conflict with the sample before them along any axis.
inline std::uint64_t find_conflicts(const SliceMerge& merge, const ClusterWord& word) {
    const Buffer<DirectionBits>& members = merge.slice.members;
    const DirectionBits &here = members[word.word], &before = members[word.word - 1];
    DirectionBits before_x;
    for (std::size_t d = 0; d < kDirections; ++d) before_x[d] = shift_x(here[d], before[d]);
    return word.clusters &
           (conflicting(0, before_x, here) | conflicting(1, members[word.word - merge.slice.stride], here) |
            conflicting(2, merge.before.members[word.word], here));
}

// Moves a point along its edge to the limit's distance from its sample.
inline void displace(const SliceMerge& merge, std::size_t word, std::uint32_t bit, std::uint32_t direction) {
    const auto [edges, slice] = edges_in_direction(merge, word, direction);
    const std::uint32_t index = point_index(edges, direction, bit);
    const float target = is_negative(direction) ? -merge.limit : merge.limit;
    const float step = target - slice.offsets[index];
    merge.moved[slice.first_point + index] = std::abs(step);
    for (std::size_t r = 0; r < 3; ++r)
        slice.points[index][r] += merge.input.to_physical.matrix[r][axis_of(direction)] * step;
}

void resolve_in_word(const SliceMerge& merge, const ClusterWord& word) {
    Cluster* const clusters = merge.clusters.clusters.data() + word.first_cluster;
    for_each_bit(find_conflicts(merge, word),
                 [&](std::uint32_t bit) { clusters[count_below(word.clusters, bit)].merges = false; });
    // A branch for each cluster would be unpredictable.
    std::uint64_t merging = 0, left = word.clusters;
    for (std::size_t k = 0; left != 0; ++k, left &= left - 1)
        merging |= left & (~left + 1) & (~std::uint64_t{clusters[k].merges} + 1);
    DirectionBits displaced;
    const DirectionBits& members = merge.slice.members[word.word];
    for (std::size_t d = 0; d < kDirections; ++d) displaced[d] = word.near[d] & ~(members[d] & merging);
    for_each_bit(any(displaced), [&](std::uint32_t bit) {
        std::uint32_t directions = 0;
        for (std::uint32_t d = 0; d < kDirections; ++d)
            directions |= static_cast<std::uint32_t>(displaced[d] >> bit & 1) << d;
        for_each_bit(directions,
                     [&](std::uint32_t direction) { displace(merge, word.word, bit, direction); });
    });
}

}  // namespace

void resolve_conflicts(const SliceMerge& merge) {
    const Clusters& clusters = merge.clusters;
    for (std::size_t i = 0; i < clusters.word_count; ++i) resolve_in_word(merge, clusters.words[i]);
}

}  // namespace marrow::internal
