// Arithmetic of positions.
#pragma once

#include <cmath>

#include <marrow/volume.h>

namespace marrow::viewer {

inline Vec3d minus(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Vec3d unit(const Vec3d& a) {
    const double length = std::sqrt(dot(a, a));
    return {a[0] / length, a[1] / length, a[2] / length};
}

/// Where one step along an index axis leads, mm.
inline Vec3d step_along(const Geometry& geometry, std::size_t axis) {
    const Mat3d m = geometry.index_to_physical();
    return {m[0][axis], m[1][axis], m[2][axis]};
}

}  // namespace marrow::viewer
