/// Vertex clustering around the samples of a slice: points near a sample merge, or are moved away from it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/marching_cubes/emit.h"
#include "slice.h"

namespace marrow::internal {

/// A sample whose points may merge into one: two or three points, at most one on each axis.
struct Cluster {
    std::uint32_t word, bit;       ///< the sample: the index of its word in the slice, and its bit there
    std::uint32_t points[3];       ///< the member on each axis; the representative where there is none
    std::uint32_t representative;  ///< the first member in the sample's slice; it becomes the merged point
    std::uint8_t directions[3];    ///< from the sample to the members, on each axis
    bool merges;
};

/// A word of samples, some of which have clusters or points to displace.
struct ClusterWord {
    std::uint32_t word;           ///< index in the slice
    std::int32_t first_x;         ///< x of its first sample in the volume
    std::int64_t y;               ///< row of the grid
    std::uint32_t first_cluster;  ///< its clusters are listed from here on, in the order of their samples
    std::uint64_t clusters;       ///< the samples that have a cluster
    DirectionBits near;           ///< the points that must merge or be displaced
};

/// The clusters of a slice. Later slices use the same memory again.
struct Clusters {
    static constexpr std::size_t kSlack = 8;  ///< elements after the last cluster

    /// Removes the clusters. Makes room for those of a slice; `points` counts its points and those before it.
    void clear(const EmitInput& input, std::size_t points);
    std::size_t bytes() const {
        return clusters.size() * (sizeof clusters[0] + 8 * sizeof(float)) + words.size() * sizeof words[0];
    }

    std::size_t count = 0, word_count = 0;
    Buffer<Cluster> clusters;
    Buffer<ClusterWord> words;
    // For each cluster, in edges:
    Buffer<float> offsets[3];  ///< from the sample to the member on each axis; 0 where there is none
    Buffer<float> weight;      ///< 1 / number of members
    Buffer<float> centre[3];   ///< from the sample to where the members merge
    Buffer<float> radius;      ///< distance from the centre to the furthest member
    std::vector<std::uint64_t> no_active_words;  ///< a row of masks without an active word
};

class SnapExceptions;

/// The data of the slice that is being merged.
struct SliceMerge {
    const EmitInput& input;
    const SnapExceptions& exceptions;
    float limit;  ///< as IsosurfaceOptions::snap
    std::int64_t z;
    SnapSlice& before;  ///< slice z - 1; it has no points if z is 0
    SnapSlice& slice;
    Clusters& clusters;
    std::uint32_t* representatives;  ///< for each point, the point that it merges into
    float* moved;                    ///< for each point, how far it was moved, in edges
};

/// Merges the points around each sample of slice z, or displaces those that are near. Representatives move to
/// the merged positions. \pre both slices are measured, and the one before is merged, except for the first
/// slice of a slab; each point that did not merge represents itself
void merge_clusters(const SliceMerge& merge);

// The phases of merge_clusters(), in this order.

/// Lists the samples whose points may merge, and sets the bits of the members of their clusters.
void select_candidates(const SliceMerge& merge);
/// Fills the clusters [begin, end) from the bits of their members.
void gather_members(const SliceMerge& merge, std::size_t begin, std::size_t end);
/// Finds the mean of the members of each cluster, and how far the furthest would move there.
void average_members(Clusters& clusters);
/// Finds another centre for each cluster whose members would move further than the limit, if necessary
/// without one of the members. Marks clusters without such a centre as not merging.
void limit_clusters(const SliceMerge& merge);
/// Marks clusters as not merging that would pinch the surface together with a neighbour. Then moves the near
/// points that do not merge to the limit's distance from their sample.
void resolve_conflicts(const SliceMerge& merge);
/// Moves the representatives to the centres, and averages their normals.
void merge_members(const SliceMerge& merge);

/// The index of a point in its slice, given the word of edges that it is on. \pre the edge is crossed
inline std::uint32_t point_index(const EdgeBits& edges, std::uint32_t direction, std::uint32_t bit) {
    const std::uint32_t axis = axis_of(direction);
    // The edge in direction -x starts at the sample before, so its point precedes those from `bit` on.
    return edges.first_point[axis] + count_below(edges.crossed[axis], bit) - (direction == kMinusX);
}

/// The edges in one direction from a word's samples, and the slice in which these start.
struct EdgesInDirection {
    const EdgeBits& edges;
    SnapSlice& slice;
};
inline EdgesInDirection edges_in_direction(const SliceMerge& merge, std::size_t word,
                                           std::uint32_t direction) {
    SnapSlice& slice = direction == kMinusZ ? merge.before : merge.slice;
    return {slice.edges[direction == kMinusY ? word - slice.stride : word], slice};
}

}  // namespace marrow::internal
