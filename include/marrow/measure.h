/// Numbers about meshes.
#pragma once

#include <cstdint>

#include <marrow/mesh.h>

namespace marrow {

/// What `measure` finds. Lengths are in the mesh's unit (mm).
struct MeshMeasures {
    std::int64_t points = 0;
    std::int64_t triangles = 0;
    std::int64_t components = 0;      ///< sets of triangles connected through shared points
    std::int64_t boundary_edges = 0;  ///< edges with one triangle; 0: closed
    std::int64_t nonmanifold_edges =
        0;  ///< edges with more than two triangles, or two that disagree in orientation
    std::int64_t euler_characteristic = 0;  ///< points - edges + triangles
    double area = 0;                        ///< mm^2
    double volume = 0;     ///< mm^3 enclosed, by the divergence theorem; means little with boundary edges
    Vec3f lower{0, 0, 0};  ///< bounding box
    Vec3f upper{0, 0, 0};
};

/// Measures a mesh in near-linear time. \throw InputError where a triangle names a point that is not there.
MeshMeasures measure(const Mesh& mesh);

}  // namespace marrow
