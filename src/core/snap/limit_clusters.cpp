// Finds another centre for clusters whose members would move too far: rule 3 of docs/algorithm.md.
#include <algorithm>
#include <cmath>

#include "merge_clusters.h"

namespace marrow::internal {

namespace {

// Whether a sample of a slice has an incident point in a direction. `bit` may be -1 or 64.
bool has_incident(const SliceMerge& merge, const SnapSlice& slice, std::int64_t word, std::int64_t bit,
                  std::uint32_t direction) {
    const std::size_t axis = axis_of(direction);
    if (direction == kMinusX) --bit;
    if (direction == kMinusY) word -= static_cast<std::int64_t>(slice.stride);
    word += bit < 0 ? -1 : bit / 64;
    const SnapSlice& start = direction == kMinusZ ? merge.before : slice;
    const EdgeBits& edges = start.edges[static_cast<std::size_t>(word)];
    const std::uint64_t incident =
        is_negative(direction) ? edges.at_second_end[axis] : edges.crossed[axis] & ~edges.at_second_end[axis];
    return incident >> (bit & 63) & 1;
}

// Whether the member on an axis prevents a conflict (rule 4) with the sample at the other end of its edge: on
// both other axes, that sample has incident points in the directions opposite to the members'. In direction
// +z, the points of that sample are not known yet.
bool prevents_conflict(const SliceMerge& merge, const Cluster& cluster, std::size_t axis) {
    const std::uint32_t direction = cluster.directions[axis];
    if (direction == kPlusZ) return false;
    std::int64_t word = cluster.word, bit = cluster.bit;
    const int step = is_negative(direction) ? -1 : 1;
    if (axis == 0) bit += step;
    if (axis == 1) word += step * static_cast<std::int64_t>(merge.slice.stride);
    const SnapSlice& slice = axis == 2 ? merge.before : merge.slice;
    return has_incident(merge, slice, word, bit, opposite(cluster.directions[(axis + 1) % 3])) &&
           has_incident(merge, slice, word, bit, opposite(cluster.directions[(axis + 2) % 3]));
}

// Merges three members at the centre of the smallest ball that contains them, unless that is too far. Members
// on perpendicular axes form a triangle without an obtuse angle, so this is the centre of its circumcircle.
bool use_smallest_ball(const SliceMerge& merge, std::size_t k) {
    Clusters& clusters = merge.clusters;
    float squared[3], weights[3], sum = 0;
    for (std::size_t a = 0; a < 3; ++a) {
        const float offset = clusters.offsets[a][k];
        squared[a] = std::max(offset * offset, 1e-12f);
    }
    for (std::size_t a = 0; a < 3; ++a) {
        weights[a] = squared[a] * (squared[(a + 1) % 3] + squared[(a + 2) % 3]);
        sum += weights[a];
    }
    // The radius follows from the lengths of the triangle's sides.
    const float radius = std::sqrt((squared[0] + squared[1]) * (squared[1] + squared[2]) *
                                   (squared[2] + squared[0]) / (2 * sum));
    if (!(radius <= merge.limit)) return false;
    for (std::size_t a = 0; a < 3; ++a) clusters.centre[a][k] = weights[a] / sum * clusters.offsets[a][k];
    clusters.radius[k] = radius;
    return true;
}

// Removes one of three members and merges the two others half-way between them. The member furthest from the
// sample goes first, unless it prevents a conflict. Returns false if none can be removed.
bool remove_member(const SliceMerge& merge, std::size_t k) {
    Clusters& clusters = merge.clusters;
    const Cluster& cluster = clusters.clusters[k];
    const auto offset = [&](std::size_t axis) { return clusters.offsets[axis % 3][k]; };
    std::size_t removed = 3;
    float highest = -2;
    for (std::size_t a = 0; a < 3; ++a) {
        const float b = offset(a + 1), c = offset(a + 2);
        // A member in direction +z is the last choice: it could prevent a conflict that is not known yet.
        const float score = std::abs(offset(a)) - (cluster.directions[a] == kPlusZ ? 1.0f : 0.0f);
        if (std::sqrt(b * b + c * c) / 2 > merge.limit || score <= highest) continue;
        if (prevents_conflict(merge, cluster, a)) continue;
        removed = a;
        highest = score;
    }
    if (removed == 3) return false;
    merge.slice.members[cluster.word][cluster.directions[removed]] &= ~bit_at(cluster.bit);
    gather_members(merge, k, k + 1);
    float squared = 0;
    for (std::size_t a = 0; a < 3; ++a) {
        clusters.centre[a][k] = offset(a) / 2;
        squared += clusters.centre[a][k] * clusters.centre[a][k];
    }
    clusters.radius[k] = std::sqrt(squared);
    return true;
}

}  // namespace

void limit_clusters(const SliceMerge& merge) {
    Clusters& clusters = merge.clusters;
    for (std::size_t k = 0; k < clusters.count; ++k) {
        if (!(clusters.radius[k] > merge.limit)) continue;
        const bool has_three = clusters.weight[k] < 0.5f;
        clusters.clusters[k].merges = has_three && (use_smallest_ball(merge, k) || remove_member(merge, k));
    }
}

}  // namespace marrow::internal
