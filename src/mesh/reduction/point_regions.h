/// Divides points into compact regions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <marrow/buffer.h>
#include <marrow/vector.h>

namespace marrow::internal {

/// Returns the number of the region of each point, from 1 to `count`. Regions are successive
/// cells of a coarse grid along a Morton curve, with about as many points each. They depend only
/// on the points. Runs on all threads.
/// \pre 0 < count < 2^16
Buffer<std::uint16_t> divide_points(std::span<const Vec3f> points, std::size_t count);

}  // namespace marrow::internal
