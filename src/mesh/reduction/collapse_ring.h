/// What the collapse of an edge does to the triangles around its ends.
#pragma once

#include <cstddef>
#include <cstdint>

#include <marrow/vector.h>

namespace marrow::internal {

/// The neighbours of a point. Triangle k has the neighbours k and k + 1. The first neighbour is repeated
/// after the last one, and kernels read beyond it.
struct Ring {
    static constexpr std::size_t kMost = 32;
    static constexpr std::size_t kCapacity = kMost + 8;

    std::size_t size = 0;
    std::uint32_t points[kCapacity] = {};
    float position[3][kCapacity] = {};  ///< by axis

    void set(std::size_t k, std::uint32_t point, const Vec3f& at) {
        points[k] = point;
        for (std::size_t axis = 0; axis < 3; ++axis) position[axis][k] = at[axis];
    }
};

/// The number of points that both rings have.
std::size_t count_shared(const Ring& a, const Ring& b);

/// Whether the triangles around a point keep their shape if it moves from `here` to `there`, except the first
/// and the last one, which vanish: they neither flip nor become much thinner while thin. The result is the
/// same on every SIMD target.
bool keeps_shape(const Ring& ring, const Vec3d& here, const Vec3d& there);

}  // namespace marrow::internal
