/// The checks that functions on meshes begin with.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <marrow/error.h>
#include <marrow/mesh.h>

#include "base/all_finite.h"

namespace marrow::internal {

/// \throw InputError if a triangle has an index out of range, or some points have normals and others do not
inline void check_arrays(const MeshView& mesh) {
    if (!mesh.normals.empty() && mesh.normals.size() != mesh.points.size())
        throw InputError("mesh: there are " + std::to_string(mesh.points.size()) + " points but " +
                         std::to_string(mesh.normals.size()) + " normals");
    const auto is_wrong = [&](std::uint32_t p) { return p >= mesh.points.size(); };
    bool any = false;  // without a branch, so that compilers make vectors
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t p : t) any |= is_wrong(p);
    }
    if (!any) return;
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t p : t) {
            if (!is_wrong(p)) continue;
            throw InputError("mesh: a triangle refers to point " + std::to_string(p) +
                             ", but there are only " + std::to_string(mesh.points.size()) +
                             " points, numbered from 0");
        }
    }
}

/// \throw InputError if a coordinate is NaN or infinite
inline void check_coordinates(std::span<const Vec3f> points) {
    if (!all_finite(points)) throw InputError("mesh: a coordinate is NaN or infinite");
}

/// \throw LimitError if the triangles cannot be numbered with 32 bits. The message begins with `task`.
inline void check_triangle_count(const MeshView& mesh, const char* task) {
    if (std::uint64_t{mesh.triangles.size()} >> 32)
        throw LimitError(std::string(task) + ": the mesh has 2^32 triangles or more");
}

}  // namespace marrow::internal
