/// The corners of a triangle, and its normal, area and centroid.
#pragma once

#include <array>

#include <marrow/mesh.h>
#include <marrow/vector.h>

namespace marrow::internal {

/// The points of a mesh are float. Geometry is computed in double.
using TriangleCorners = std::array<Vec3d, 3>;

/// \pre the triangle's indices are in range
inline TriangleCorners corners_of(const MeshView& mesh, const Triangle& t) {
    return {to_double(mesh.points[t[0]]), to_double(mesh.points[t[1]]), to_double(mesh.points[t[2]])};
}

/// The outward normal. Its length is twice the area.
inline Vec3d scaled_normal(const TriangleCorners& t) {
    return cross(t[1] - t[0], t[2] - t[0]);
}

inline double area(const TriangleCorners& t) {
    return length(scaled_normal(t)) / 2;
}

inline Vec3d centroid(const TriangleCorners& t) {
    return (1.0 / 3) * (t[0] + t[1] + t[2]);
}

}  // namespace marrow::internal
