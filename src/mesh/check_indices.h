/// What every measure asks of a mesh.
#pragma once

#include <string>

#include <marrow/error.h>
#include <marrow/mesh.h>

namespace marrow::internal {

/// \throw InputError where a triangle names a point that is not there.
inline void check_triangles(const Mesh& mesh) {
    for (const Triangle& t : mesh.triangles) {
        for (std::uint32_t p : t) {
            if (p >= mesh.points.size())
                throw InputError("mesh: a triangle names point " + std::to_string(p) +
                                 ", which is not there");
        }
    }
}

}  // namespace marrow::internal
