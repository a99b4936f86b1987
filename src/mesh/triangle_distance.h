/// The distance of a place from a triangle.
#pragma once

#include <algorithm>
#include <limits>

#include "vector.h"

namespace marrow::internal {

/// Of the squared sizes of two edges: the squared cross product below which rounding decides on which side of an edge a
/// place's foot in the plane is.
inline constexpr double kFlat = 1e-14;

/// Also of triangles without area.
inline double squared_distance_to_triangle(const Vec3d& place, const Vec3d& a, const Vec3d& b,
                                           const Vec3d& c) {
    // The place's foot in the plane is a + (s u + t v) / n.n.
    const Vec3d u = b - a, v = c - a, from_a = place - a, n = cross(u, v);
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), nn = dot(n, n);
    const double u_from = dot(u, from_a), v_from = dot(v, from_a);
    const double s = vv * u_from - uv * v_from, t = uu * v_from - uv * u_from;
    const bool flat = !(nn > kFlat * (uu * vv));
    if (!flat && s >= 0 && t >= 0 && s + t <= nn) {
        const double height = dot(from_a, n);
        return height * height / nn;
    }
    // Else the nearest place is on an edge that the foot is beyond.
    const auto squared = [&](double along_u, double along_v) {
        const Vec3d apart = from_a - along_u * u - along_v * v;
        return dot(apart, apart);
    };
    const auto along = [](double part, double whole) {
        return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0;
    };
    double nearest = std::numeric_limits<double>::infinity();
    if (flat || t < 0) nearest = squared(along(u_from, uu), 0);
    if (flat || s < 0) nearest = std::min(nearest, squared(0, along(v_from, vv)));
    if (flat || s + t > nn) {
        const double k = along((v_from - u_from) + (uu - uv), (uu - uv) + (vv - uv));
        nearest = std::min(nearest, squared(1 - k, k));
    }
    return nearest;
}

}  // namespace marrow::internal
