// Directions, beside marrow/vector.h.
#pragma once

#include <marrow/vector.h>
#include <marrow/volume.h>

namespace marrow::viewer {

inline Vec3d unit(const Vec3d& a) {
    return 1 / length(a) * a;
}

/// Where one step along an index axis leads, mm.
inline Vec3d step_along(const Geometry& geometry, std::size_t axis) {
    const Mat3d m = geometry.index_to_physical();
    return {m[0][axis], m[1][axis], m[2][axis]};
}

}  // namespace marrow::viewer
