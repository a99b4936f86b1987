/// The distance of a place from a triangle.
#pragma once

#include <algorithm>

#include "vector.h"

namespace marrow::internal {

inline double squared_distance_to_segment(const Vec3d& place, const Vec3d& a, const Vec3d& b) {
    const Vec3d along = b - a, from_a = place - a;
    const double squared_length = dot(along, along);
    const double t = squared_length > 0 ? std::clamp(dot(from_a, along) / squared_length, 0.0, 1.0) : 0;
    const Vec3d apart = from_a - t * along;
    return dot(apart, apart);
}

/// Also of triangles without area.
inline double squared_distance_to_triangle(const Vec3d& place, const Vec3d& a, const Vec3d& b,
                                           const Vec3d& c) {
    const Vec3d n = cross(b - a, c - a);
    const double squared_area = dot(n, n);
    const bool above = squared_area > 0 && dot(cross(b - a, place - a), n) >= 0 &&
                       dot(cross(c - b, place - b), n) >= 0 && dot(cross(a - c, place - c), n) >= 0;
    if (above) {
        const double height = dot(place - a, n);
        return height * height / squared_area;
    }
    return std::min({squared_distance_to_segment(place, a, b), squared_distance_to_segment(place, b, c),
                     squared_distance_to_segment(place, c, a)});
}

}  // namespace marrow::internal
