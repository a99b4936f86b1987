/// Finds cap triangles, in which one corner is nearly on the line between the two others.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// The tangent of the smallest angle that a triangle with an obtuse angle should have: 6.3 degrees.
inline constexpr double kCapSlope = 0.11;

struct CapTriangle {
    Triangle triangle;
    std::array<float, 3> moved;  ///< how far merging moved each of its points, in edges
    // When all triangles are made, the positions of its points before and after caps are widened.
    std::array<Vec3f, 3> before, after;
};

/// Appends to `caps` the indices of the triangles that may be caps: their height over the longest side is
/// small. \pre a float after the last of `points` can be read
void find_caps(const Vec3f* points, const Triangle* triangles, std::size_t count,
               std::vector<std::uint32_t>& caps);

}  // namespace marrow::internal
