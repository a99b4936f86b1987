/// The check that every function on meshes begins with: that the triangles' indices are in range.
#pragma once

#include <string>

#include <marrow/error.h>
#include <marrow/mesh.h>

namespace marrow::internal {

/// \throw InputError if a triangle has an index out of range
inline void check_indices(const MeshView& mesh) {
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t p : t) {
            if (p < mesh.points.size()) continue;
            throw InputError("mesh: a triangle refers to point " + std::to_string(p) +
                             ", but there are only " + std::to_string(mesh.points.size()) +
                             " points, numbered from 0");
        }
    }
}

}  // namespace marrow::internal
