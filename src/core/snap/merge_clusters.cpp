// Merges the points of a slice in phases. docs/algorithm.md explains the rules, which comments name by
// number, and why the result is a manifold.
#include "merge_clusters.h"

#include <cmath>

#include "base/resize_discarding.h"
#include "snap_exceptions.h"

namespace marrow::internal {

namespace {

void average_normals(const SliceMerge& merge, const Cluster& cluster) {
    SnapSlice& slice = merge.slice;
    const DirectionBits& members = slice.members[cluster.word];
    Vec3f sum{0, 0, 0};
    for (std::size_t a = 0; a < 3; ++a) {
        if ((members[cluster.directions[a]] >> cluster.bit & 1) == 0) continue;
        const std::uint32_t point = cluster.points[a];
        const SnapSlice& owner = point < slice.first_point ? merge.before : slice;
        for (std::size_t r = 0; r < 3; ++r) sum[r] += owner.normals[point - owner.first_point][r];
    }
    const float length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    if (length > 0)
        slice.normals[cluster.representative - slice.first_point] = {sum[0] / length, sum[1] / length,
                                                                     sum[2] / length};
}

// Merges the members of cluster k. `first_x`: x of the first sample of its word
inline void merge_cluster(const SliceMerge& merge, std::size_t k, std::int32_t first_x,
                          const Vec3f& row_base) {
    const auto& to_physical = merge.input.to_physical;
    const Clusters& list = merge.clusters;
    const Cluster& cluster = list.clusters[k];
    SnapSlice& slice = merge.slice;
    if (!slice.normals.empty()) average_normals(merge, cluster);
    for (const std::uint32_t point : cluster.points) {
        merge.representatives[point] = cluster.representative;
        merge.moved[point] = list.radius[k];
    }
    const auto x =
        static_cast<float>(to_physical.first[0] + first_x + static_cast<std::int32_t>(cluster.bit));
    const float index[3] = {x + list.centre[0][k], list.centre[1][k], list.centre[2][k]};
    Vec3f& merged = slice.points[cluster.representative - slice.first_point];
    for (std::size_t r = 0; r < 3; ++r) {
        const Vec3f& m = to_physical.matrix[r];
        merged[r] = row_base[r] + (m[0] * index[0] + m[1] * index[1] + m[2] * index[2]);
    }
}

}  // namespace

void Clusters::clear(const EmitInput& input, std::size_t points) {
    count = word_count = 0;
    no_active_words.resize(input.active.masks_per_row);
    words.resize(static_cast<std::size_t>(input.bits.ny) * input.bits.words_per_row);
    if (points / 2 + kSlack <= clusters.size()) return;
    const std::size_t size = points / 2 + points / 8 + kSlack;
    resize_discarding(clusters, size);
    for (Buffer<float>* values :
         {&offsets[0], &offsets[1], &offsets[2], &weight, &centre[0], &centre[1], &centre[2], &radius})
        resize_discarding(*values, size);
}

void merge_clusters(const SliceMerge& merge) {
    const std::size_t points = merge.before.point_count + merge.slice.point_count;
    merge.clusters.clear(merge.input, points);
    if (points == 0) return;
    select_candidates(merge);
    gather_members(merge, 0, merge.clusters.count);
    average_members(merge.clusters);
    limit_clusters(merge);
    merge.exceptions.forbid_merging(merge);
    resolve_conflicts(merge);
    merge_members(merge);
}

void merge_members(const SliceMerge& merge) {
    const InsideBits& bits = merge.input.bits;
    const Clusters& list = merge.clusters;
    SnapSlice& slice = merge.slice;
    slice.merged_before.resize(list.count + 1);
    std::size_t merged_before = 0;
    std::int64_t y = -1;
    Vec3f row_base{};
    for (std::size_t i = 0; i < list.word_count; ++i) {
        const ClusterWord& word = list.words[i];
        if (word.y != y)
            row_base = merge.input.to_physical.row_base(word.y - bits.first_y, merge.z - bits.first_z);
        y = word.y;
        const std::size_t end = i + 1 < list.word_count ? list.words[i + 1].first_cluster : list.count;
        for (std::size_t k = word.first_cluster; k < end; ++k) {
            const Cluster& cluster = list.clusters[k];
            if (!cluster.merges) continue;
            merge_cluster(merge, k, word.first_x, row_base);
            // An edge along z can start in the slice before. If this one does not, the next overwrites it.
            slice.merged_before[merged_before] = {cluster.points[2], cluster.representative};
            merged_before += cluster.points[2] < slice.first_point;
        }
    }
    slice.merged_before.resize(merged_before);
}

}  // namespace marrow::internal
