/// Vectors in double, for measuring meshes whose coordinates are float.
#pragma once

#include <cmath>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal {

inline Vec3d to_double(const Vec3f& p) {
    return {p[0], p[1], p[2]};
}
inline Vec3f to_float(const Vec3d& p) {
    return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}
inline Vec3d operator+(const Vec3d& a, const Vec3d& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vec3d operator-(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec3d operator*(double s, const Vec3d& a) {
    return {s * a[0], s * a[1], s * a[2]};
}
inline double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vec3d& a) {
    return std::sqrt(dot(a, a));
}

/// The corners of a triangle.
struct Corners {
    Vec3d a, b, c;

    Corners(const Mesh& mesh, const Triangle& t)
        : a(to_double(mesh.points[t[0]])), b(to_double(mesh.points[t[1]])), c(to_double(mesh.points[t[2]])) {}
    double area() const { return length(cross(b - a, c - a)) / 2; }
};

}  // namespace marrow::internal
