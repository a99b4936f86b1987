/// Measuring meshes, whose coordinates are float, in double.
#pragma once

#include <marrow/mesh.h>
#include <marrow/vector.h>

namespace marrow::internal {

inline Vec3d to_double(const Vec3f& p) {
    return {p[0], p[1], p[2]};
}
inline Vec3f to_float(const Vec3d& p) {
    return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

/// The corners of a triangle.
struct Corners {
    Vec3d a, b, c;

    Corners(const Mesh& mesh, const Triangle& t)
        : a(to_double(mesh.points[t[0]])), b(to_double(mesh.points[t[1]])), c(to_double(mesh.points[t[2]])) {}
    double area() const { return length(cross(b - a, c - a)) / 2; }
};

}  // namespace marrow::internal
