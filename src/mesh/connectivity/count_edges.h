/// Counts the edges of a mesh.
#pragma once

#include <cstdint>

#include <marrow/mesh.h>

#include "one_rings.h"

namespace marrow::internal {

struct EdgeCounts {
    std::int64_t all = 0;
    std::int64_t boundary = 0;     ///< with one triangle
    std::int64_t nonmanifold = 0;  ///< with others than one triangle, or two that agree in orientation
    std::int64_t misoriented = 0;  ///< of these, those with two triangles
};

/// Takes nearly no time if all points are regular, and else linear time. `rings` are those of the mesh.
EdgeCounts count_edges(const MeshView& mesh, const OneRings& rings);

}  // namespace marrow::internal
