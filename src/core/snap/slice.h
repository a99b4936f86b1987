/// A slice of the grid during snapping: the points on the edges that start at its samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

#include "core/marching_cubes/inside_bits.h"
#include "directions.h"

namespace marrow::internal {

/// The edges that start at the 64 samples of a word, by axis. Bit i belongs to sample i.
struct EdgeBits {
    std::uint64_t crossed[3];        ///< the surface crosses the edge: there is a point on it
    std::uint64_t near[3];           ///< the point is within the limit of the nearer end of its edge
    std::uint64_t at_second_end[3];  ///< the nearer end is the one where the edge does not start
    std::uint32_t first_point[3];    ///< index in the slice of the first of the word's points
};

/// A point and the point that it merges into.
struct MergedPoint {
    std::uint32_t point, representative;
};

/// The points of a slice have consecutive numbers in a slab of slices.
struct SnapSlice {
    std::uint32_t first_point = 0;  ///< number of the slice's first point
    std::uint32_t point_count = 0;
    Buffer<Vec3f> points, normals;
    Buffer<float> offsets;  ///< from the nearer end of its edge to each point, in edges
    /// Rows of words, with a row of zeros before the first row and a word of zeros before each.
    Buffer<EdgeBits> edges;
    Buffer<DirectionBits> members;           ///< the points in each sample's cluster; laid out as `edges`
    std::size_t stride = 0;                  ///< words from one row to the next
    std::vector<std::uint8_t> rows_in_use;   ///< whether a row's edges or members may differ from 0
    std::vector<MergedPoint> merged_before;  ///< points of the slice before that merge into this slice

    static constexpr std::size_t kSlack = 16;  ///< elements after the last point and the last offset

    std::size_t first_word(std::int64_t y) const { return static_cast<std::size_t>(y + 1) * stride + 1; }
    /// Makes room for `point_count` points, and sets the edges and members to 0.
    void clear(const InsideBits& bits, bool normals_wanted);
    std::size_t bytes() const;
};

}  // namespace marrow::internal
