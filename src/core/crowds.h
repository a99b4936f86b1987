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
    std::array<float, 6> offsets;      ///< from the sample along their edges' axes, in edges
    std::array<std::uint8_t, 6> axes;  ///< of their edges
    std::uint8_t size;
    std::uint8_t joining;  ///< so many of them, the first, can become one as far as the sample's surroundings
                           ///< tell; 0: none can, or will
    std::uint8_t faces;  ///< of an open volume's box that have one of these: bit a where it ends along axis a
    float moved;         ///< the furthest that one of these moves when they become one, in edges
    Vec3f middle;        ///< where they do, from the sample, in edges
};

/// Appends the crowds of the samples of slices [begin, end), in order, and after each slice their number to
/// `slice_ends`. `points`: all of the surface's. \throw std::bad_alloc
void find_crowds(const EmitInput& input, float limit, const Vec3f* points, std::size_t begin, std::size_t end,
                 std::vector<Crowd>& crowds, std::vector<std::size_t>& slice_ends);

}  // namespace marrow::internal
