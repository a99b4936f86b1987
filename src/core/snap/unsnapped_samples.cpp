// Finds samples by position, and clears the bits of their edges.
#include "unsnapped_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace marrow::internal {

Vec3d UnsnappedSamples::index_of(const Vec3f& point) const {
    const Vec3d index = to_index_ * (to_double(point) - input_.to_physical.origin);
    const auto pad = static_cast<double>(input_.bits.pad);
    return {index[0] + static_cast<double>(input_.bits.first_x), index[1] + pad, index[2] + pad};
}

void UnsnappedSamples::add(const Mesh& mesh, const Triangle& triangle, std::int64_t rings) {
    Vec3d lower = index_of(mesh.points[triangle[0]]), upper = lower;
    for (const std::uint32_t p : triangle) {
        const Vec3d index = index_of(mesh.points[p]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], index[axis]);
            upper[axis] = std::max(upper[axis], index[axis]);
        }
    }
    const auto first = [&](std::size_t axis) {
        return static_cast<std::int64_t>(std::floor(lower[axis])) - rings;
    };
    const auto last = [&](std::size_t axis) {
        return static_cast<std::int64_t>(std::ceil(upper[axis])) + rings;
    };
    const InsideBits& bits = input_.bits;
    const std::int64_t nx = 64 * static_cast<std::int64_t>(bits.words_per_row);
    for (std::int64_t z = std::max<std::int64_t>(first(2), 0); z <= std::min(last(2), bits.nz - 1); ++z) {
        for (std::int64_t y = std::max<std::int64_t>(first(1), 0); y <= std::min(last(1), bits.ny - 1); ++y) {
            for (std::int64_t x = std::max<std::int64_t>(first(0), 0); x <= std::min(last(0), nx - 1); ++x)
                samples_.insert({z, y, x});
        }
    }
}

bool UnsnappedSamples::has_nearest_to(const Vec3f& point) const {
    const Vec3d index = index_of(point);
    return samples_.count({std::llround(index[2]), std::llround(index[1]), std::llround(index[0])}) > 0;
}

void UnsnappedSamples::remove_near_points(std::int64_t z, SnapSlice& slice) const {
    // The point of the edge that starts at a sample of this slice belongs to that sample, or to the other end.
    const auto remove = [&](const Sample& start, std::size_t axis, bool second_end) {
        const auto [start_z, y, x] = start;
        if (start_z != z || y < 0 || x < 0) return;
        EdgeBits& edges = slice.edges[slice.first_word(y) + static_cast<std::size_t>(x / 64)];
        const std::uint64_t belongs = second_end ? edges.at_second_end[axis] : ~edges.at_second_end[axis];
        edges.near[axis] &= ~(belongs & std::uint64_t{1} << x % 64);
    };
    const std::int64_t least = std::numeric_limits<std::int64_t>::min();
    for (auto at = samples_.lower_bound({z, least, least}); at != samples_.end() && (*at)[0] <= z + 1; ++at) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Sample before = *at;
            --before[2 - axis];
            remove(*at, axis, false);
            remove(before, axis, true);
        }
    }
}

}  // namespace marrow::internal
