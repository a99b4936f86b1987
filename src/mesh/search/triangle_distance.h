/// The distance between a point and a triangle.
#pragma once

#include <algorithm>
#include <limits>

#include <marrow/vector.h>

namespace marrow::internal {

/// A triangle counts as flat if the squared cross product of two edges is at most this fraction of the
/// product of their squared lengths. Rounding then decides on which side of an edge the projection of a point
/// falls.
inline constexpr double kFlat = 1e-14;

/// Whether p is above or below the triangle a, b, c, and its squared distance is at most `most`. Faster than
/// squared_distance_to_triangle().
inline bool is_across(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c, double most) {
    const Vec3d u = b - a, v = c - a, from_a = p - a, n = cross(u, v);
    const double nn = dot(n, n), height = dot(from_a, n);
    const double s = dot(cross(from_a, v), n), t = dot(cross(u, from_a), n);
    return nn > 0 && s >= 0 && t >= 0 && s + t <= nn && height * height <= most * nn;
}

/// The squared distance from p to the triangle a, b, c, which may have no area.
inline double squared_distance_to_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    // The projection of p onto the plane is a + (s u + t v) / n.n.
    const Vec3d u = b - a, v = c - a, from_a = p - a, n = cross(u, v);
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), nn = dot(n, n);
    const double u_from = dot(u, from_a), v_from = dot(v, from_a);
    const double s = vv * u_from - uv * v_from, t = uu * v_from - uv * u_from;
    const bool flat = !(nn > kFlat * (uu * vv));
    if (!flat && s >= 0 && t >= 0 && s + t <= nn) {
        const double height = dot(from_a, n);
        return height * height * (1 / nn);
    }
    // Otherwise the nearest point is on an edge that has the projection on its outer side.
    const auto squared = [](const Vec3d& from, const Vec3d& edge, double part, double total) {
        const double along = total > 0 ? std::clamp(part * (1 / total), 0.0, 1.0) : 0;
        const Vec3d difference = from - along * edge;
        return dot(difference, difference);
    };
    double nearest = std::numeric_limits<double>::infinity();
    if (flat || t < 0) nearest = squared(from_a, u, u_from, uu);
    if (flat || s < 0) nearest = std::min(nearest, squared(from_a, v, v_from, vv));
    if (flat || s + t > nn)
        nearest = std::min(nearest,
                           squared(from_a - u, v - u, (v_from - u_from) + (uu - uv), (uu - uv) + (vv - uv)));
    return nearest;
}

}  // namespace marrow::internal
