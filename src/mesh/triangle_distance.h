/// The distance of a place from a triangle.
#pragma once

#include <algorithm>
#include <limits>

#include "vector.h"

namespace marrow::internal {

inline double squared_distance_to_segment(const Vec3d& place, const Vec3d& a, const Vec3d& b) {
    const Vec3d along = b - a, from_a = place - a;
    const double squared_length = dot(along, along);
    const double t = squared_length > 0 ? std::clamp(dot(from_a, along) / squared_length, 0.0, 1.0) : 0;
    const Vec3d apart = from_a - t * along;
    return dot(apart, apart);
}

/// Also of triangles without area. A distance above `most` may come out as infinity, which is faster.
inline double squared_distance_to_triangle(const Vec3d& place, const Vec3d& a, const Vec3d& b, const Vec3d& c,
                                           double most = std::numeric_limits<double>::infinity()) {
    const Vec3d n = cross(b - a, c - a);
    const double squared_area = dot(n, n), height = dot(place - a, n);
    if (height * height > most * squared_area && squared_area > 0)  // most places are far from the plane
        return std::numeric_limits<double>::infinity();
    const bool above = squared_area > 0 && dot(cross(b - a, place - a), n) >= 0 &&
                       dot(cross(c - b, place - b), n) >= 0 && dot(cross(a - c, place - c), n) >= 0;
    if (above) return height * height / squared_area;
    return std::min({squared_distance_to_segment(place, a, b), squared_distance_to_segment(place, b, c),
                     squared_distance_to_segment(place, c, a)});
}

}  // namespace marrow::internal
