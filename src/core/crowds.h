/// Where the surface passes close to a sample: the points that crowd round it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

#include "emit.h"

namespace marrow::internal {

/// Points that belong to one sample, the nearer end of their edges, and hang together by triangles' sides; one
/// of them, at least, is closer to it than the limit.
struct Crowd {
    std::array<std::uint32_t, 6> points;
    std::uint8_t size;
    std::uint8_t joining;  ///< so many of them, the first, can become one as far as the sample's surroundings
                           ///< tell; 0: none can, or will
    std::uint8_t faces;  ///< of an open volume's box that have one of these: bit a where it ends along axis a
    std::array<std::uint8_t, 6> axes;  ///< of the points' edges
    Vec3f step;                        ///< from the first point to where they become one, in edges
    float moved;                       ///< the furthest that one of these moves there, in edges
};

/// Writes, for the points of the rows [row_begin, row_end), how far each lies from the nearer end of its edge:
/// in edges along the axis, with the sign of the direction, -0 to -0.5 where that is the edge's second end.
void measure_offsets(const EmitInput& input, std::size_t row_begin, std::size_t row_end, const Vec3f* points,
                     float* offsets) noexcept;

/// Appends the crowds of the samples of slices [begin, end), in order, and after each slice their number to
/// `slice_ends`. `offsets`: those of all points. \throw std::bad_alloc
void find_crowds(const EmitInput& input, float limit, const float* offsets, std::size_t begin,
                 std::size_t end, std::vector<Crowd>& crowds, std::vector<std::size_t>& slice_ends);

}  // namespace marrow::internal
