/// A slice of samples on its way through snapping: the points on the edges that start there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <marrow/mesh.h>

#include "core/marching_cubes/emit.h"

namespace marrow::internal {

/// The edges that start at the 64 samples of a word, by axis.
struct WordEdges {
    std::uint64_t crossed[3], near[3];  ///< near: the point is within the limit of the end it belongs to,
    std::uint64_t second[3];            ///< the nearer one: this is the second
    std::uint32_t first_point[3];       ///< in the slice
};

/// The sides of a word's samples on which points may join: 2 * axis, and 1 more towards lower indices.
using WordSides = std::array<std::uint64_t, 6>;

struct SnapSlice {
    std::uint32_t start = 0;  ///< the first point's number
    std::uint32_t size = 0;   ///< points
    Buffer<Vec3f> points, normals;
    Buffer<float> offsets;  ///< of the points from the end that they belong to, along the edge, in edges
    /// By row, with a row of zeros before the first and a word of zeros before each; 0 where the surface is
    /// not.
    Buffer<WordEdges> edges;
    Buffer<WordSides> sides;
    std::size_t stride = 0;            ///< of rows, in words
    std::vector<std::uint8_t> in_use;  ///< the rows where edges or sides are not all 0
    /// Points of the slice before that join one of this, and that.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> from_before;

    static constexpr std::size_t kSlack = 16;  ///< elements behind the last of points and offsets

    std::size_t first_word(std::int64_t y) const { return static_cast<std::size_t>(y + 1) * stride + 1; }
    /// Makes room for `size` points, and removes the edges.
    void clear(const InsideBits& bits, bool normals_wanted);
    std::size_t bytes() const;
};

/// The inverse of an index-to-physical matrix: a row for each axis.
Mat3d inverse_of(const Mat3d& m);

/// Measures the points of slice z, how far along their edges is in `offsets` before: makes `offsets` and
/// `edges`.
void measure_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice);

}  // namespace marrow::internal
